"""The corrections of Nayar 2022: modified kinematics, Prandtl-Ishlinskii models, their hybrid."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import posture_columns
from catheter_sim.core.inputs import Inputs
from catheter_sim.errors import InputError
from catheter_sim.robots.catheter import measured as modified
from catheter_sim.robots.catheter.kinematics import angle_rad
from catheter_sim.robots.catheter.measured import (
    PrandtlIshlinskii,
    identified,
    identify,
    plays,
    training_loop,
)
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.theory.static_models import STATIC_MODELS
from reference.catheter import torsion_as_printed_rad

ROBOT = load_robot("mitral_transseptal")
assert isinstance(ROBOT, CatheterRobot)
PROXIMAL, BENDING, _, DISTAL = ROBOT.segments
BENDING_PAIR, PROXIMAL_PAIR, DISTAL_PAIR = 0, 1, 2


def drive(rows: np.ndarray) -> Inputs:
    """Return rows of inputs in mm, in the order of the robot's channels."""
    zeros = np.zeros((len(rows), 3))
    return Inputs(np.arange(len(rows), dtype=float), "displacement", rows * 1e-3, zeros, zeros)


def solve(model: str, rows: np.ndarray) -> dict[str, np.ndarray]:
    """Return every output column of a static model."""
    return posture_columns(ROBOT, STATIC_MODELS[model].solve(ROBOT, drive(rows), np.zeros(3)).postures)


def triangle(top_m: float, steps: int = 100) -> np.ndarray:
    """Return a way from zero to the top and back, shape (2 steps + 1,) [m]."""
    ramp = np.linspace(0.0, top_m, steps + 1)
    return np.concatenate([ramp, ramp[-2::-1]])


def test_bending_lines_meet_where_printed() -> None:
    """Eq. 25 is continuous at l* to 0.1 deg, at 3.6 to 3.7 deg, when read in degrees per millimetre."""
    below, above = np.degrees(modified.bending_rad(BENDING, np.array([1.7750e-3, 1.7750e-3 + 1e-12])))
    assert 0.0 < below - above < 0.1
    assert 3.6 < above < 3.7


def test_bending_falls_short_of_pure_kinematics() -> None:
    """At 6 mm MK bends by 84.6 deg where pure kinematics bends by 191 deg: Table III's tens of mm."""
    assert np.degrees(modified.bending_rad(BENDING, np.array([6e-3])))[0] == pytest.approx(84.6, abs=0.05)
    assert math.degrees(angle_rad(BENDING, 6e-3)) == pytest.approx(188.0, abs=4.0)


@pytest.mark.parametrize(
    ("segment", "calibration", "upper", "lower", "width_mm"),
    [
        (PROXIMAL, modified.TORSION_PROXIMAL, 58.8, 10.0, 1.35),
        (DISTAL, modified.TORSION_DISTAL, 73.0, 12.0, 0.83),
    ],
)
def test_torsion_loop_has_the_printed_dead_bands(segment, calibration, upper, lower, width_mm) -> None:
    """Plateaus at Y_L and Y_U; after each reversal the angle stands still over d_b."""
    top = modified.plateau_displacement_m(segment, calibration)
    loop = triangle(top, 4000)
    angle = np.degrees(modified.torsion_rad(segment, np.concatenate([loop, loop[1:]]), calibration))
    assert angle.max() == pytest.approx(upper)
    assert angle.min() == pytest.approx(lower)
    down = angle[4000:8001]
    assert 1e3 * (top - loop[4000:][down > upper - 1e-6].min()) == pytest.approx(width_mm, abs=2e-3)
    up = angle[8000:12001]
    assert 1e3 * loop[:4001][up < lower + 1e-6].max() == pytest.approx(width_mm, abs=2e-3)


@pytest.mark.parametrize(
    ("segment", "calibration"),
    [(PROXIMAL, modified.TORSION_PROXIMAL), (DISTAL, modified.TORSION_DISTAL)],
)
def test_torsion_is_the_printed_equation_on_full_loops(segment, calibration) -> None:
    """On loops that reach the upper plateau the angle with a history is Eqs 26-28, row by row."""
    loop = triangle(1.02 * modified.plateau_displacement_m(segment, calibration))
    loop = np.concatenate([loop, loop[1:]])
    np.testing.assert_allclose(
        modified.torsion_rad(segment, loop, calibration),
        torsion_as_printed_rad(segment, loop, calibration),
        atol=1e-12,
    )


def test_printed_torsion_jumps_where_the_joint_cannot() -> None:
    """Turning back early, and at rest, Eq. 26 jumps by tens of degrees; the one with a history holds."""
    way = np.array([0.0, 1.0, 2.0, 1.99, 1.99, 1.99]) * 1e-3
    printed = np.degrees(torsion_as_printed_rad(PROXIMAL, way, modified.TORSION_PROXIMAL))
    held = np.degrees(modified.torsion_rad(PROXIMAL, way, modified.TORSION_PROXIMAL))
    assert printed[3] - printed[2] > 20.0
    assert printed[3] - printed[4] > 10.0
    np.testing.assert_array_equal(held[2:], held[2])


def test_torsion_does_not_depend_on_the_rows_spacing() -> None:
    """Turning points alone give the angles that a fine way through them gives."""
    turns = np.array([0.0, 3.0, 1.2, 2.2, 0.3, 3.5]) * 1e-3
    fine = np.concatenate([np.linspace(a, b, 50)[1:] for a, b in pairwise(turns)])
    coarse = modified.torsion_rad(PROXIMAL, turns, modified.TORSION_PROXIMAL)
    dense = modified.torsion_rad(PROXIMAL, np.concatenate([turns[:1], fine]), modified.TORSION_PROXIMAL)
    np.testing.assert_allclose(coarse[1:], dense[49::49], atol=1e-12)


def test_plays_are_krasnoselskiis() -> None:
    """A play of threshold r lags r behind on the way out, stands still over 2 r, lags r on the way back."""
    out = plays(triangle(3.0, 300), np.array([0.0, 0.5]))
    np.testing.assert_array_equal(out[:, 0], triangle(3.0, 300))
    assert out[200, 1] == pytest.approx(1.5)
    assert out[360, 1] == pytest.approx(2.5)
    assert out[500, 1] == pytest.approx(1.5)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(0.0, 2.0), min_size=5, max_size=5), st.integers(0, 1000))
def test_planted_weights_are_found(weights: list[float], seed: int) -> None:
    """From a history that reaches its extremes again and again, non-negative weights come back."""
    draw = np.random.default_rng(seed)
    values = np.concatenate([draw.uniform(-1.0, 1.0, 300), [1.0, -1.0, 1.0]])
    truth = PrandtlIshlinskii(np.arange(5) / 5.0, np.array(weights), 0.0)
    found = identify(values, truth(values), operators=4)
    np.testing.assert_allclose(found.thresholds, truth.thresholds, atol=1e-12)
    np.testing.assert_allclose(found.weights, weights, atol=1e-8)
    assert found.rmse < 1e-8


def test_identified_on_one_half_it_predicts_the_other() -> None:
    """A PI model from half of noisy loops of a dead-band predicts the other half within 10 % of range."""
    draw = np.random.default_rng(4)
    values = np.concatenate([triangle(top, 60)[:-1] for top in (1.0, 0.6, 0.9, 1.0, 0.7, 0.5)])
    measured = 80.0 * plays(values, np.array([0.15]))[:, 0] + draw.normal(0.0, 0.5, len(values))
    half = len(values) // 2
    model = identify(values[:half], measured[:half])
    error = model(values)[half:] - measured[half:]
    assert np.sqrt(np.mean(error**2)) < 0.1 * np.ptp(measured)


def test_weights_are_never_negative() -> None:
    """A loop that softens, which plays cannot, still gets non-negative weights, and a poorer fit."""
    values = triangle(1.0)
    model = identify(values, np.sqrt(values))
    assert (model.weights >= 0.0).all()
    assert model.rmse > 0.05


@pytest.mark.parametrize(
    ("values", "measured", "message"),
    [
        (np.zeros(20), np.zeros(20), "never leaves zero"),
        (np.arange(5.0), np.arange(5.0), "5 inputs and 5 outputs for 11 weights"),
        (np.arange(20.0), np.full(20, np.nan), "finite"),
    ],
)
def test_identification_refuses_what_says_nothing(values, measured, message) -> None:
    """Too few rows, missing values and an input at rest are one line each."""
    with pytest.raises(InputError, match=message):
        identify(values, measured)


def test_pi_suits_torsion_better_than_bending() -> None:
    """Of MK's loops a PI model misses torsion by under 10 % of its range, and bending by more than it does.

    The paper's finding (Section IV-C): bending's loop is not symmetric, which plays are.
    """
    misses = {}
    for pair in (BENDING_PAIR, PROXIMAL_PAIR, DISTAL_PAIR):
        _, angles = training_loop(ROBOT, pair)
        misses[pair] = identified(ROBOT, pair).rmse / float(np.ptp(angles))
    assert misses[PROXIMAL_PAIR] < 0.10
    assert misses[DISTAL_PAIR] < 0.10
    assert misses[BENDING_PAIR] > max(misses[PROXIMAL_PAIR], misses[DISTAL_PAIR])


def test_hybrid_takes_bending_from_mk_and_torsion_from_pi() -> None:
    """The hybrid's angles are those of the two models that it is made of."""
    way = 1e3 * triangle(2.5e-3, 40)
    rows = np.stack([2.0 * way, way, way, np.full(len(way), 20.0)], axis=1)
    columns = {model: solve(model, rows) for model in ("mk", "pi", "hybrid")}
    bending, torsion = "angle_bending_deg", "angle_torsion_distal_deg"
    np.testing.assert_array_equal(columns["hybrid"][bending], columns["mk"][bending])
    np.testing.assert_array_equal(columns["hybrid"][torsion], columns["pi"][torsion])
    assert np.abs(columns["mk"][torsion] - columns["pi"][torsion]).max() > 0.1
    assert np.abs(columns["mk"][bending] - columns["pi"][bending]).max() > 1.0


def test_mk_tip_is_equation_15_of_its_angles() -> None:
    """The tip follows the corrected angles by the same kinematics as pure kinematics does."""
    columns = solve("mk", np.array([[4.0, 2.5, 1.5, 10.0]]))
    b, p = (math.radians(columns[f"angle_{name}_deg"][0]) for name in ("bending", "torsion_proximal"))
    radial = 31.84 * (1.0 - math.cos(b)) / b + math.sin(b) * 20.5
    assert columns["tip_x_mm"][0] == pytest.approx(radial * math.cos(p))
    assert columns["tip_y_mm"][0] == pytest.approx(radial * math.sin(p))


def test_each_torsion_joint_has_its_own_plateau() -> None:
    """Pulled far, MK has the proximal torsion at 58.8 deg, the distal one at 73.0; let go, at 10 and 12."""
    columns = solve("mk", np.array([[2.0, 0, 0, 0], [2.0, 3.8, 3.8, 0], [2.0, 0, 0, 0]]))
    np.testing.assert_allclose(columns["angle_torsion_proximal_deg"], [10.0, 58.8, 10.0])
    np.testing.assert_allclose(columns["angle_torsion_distal_deg"], [12.0, 73.0, 12.0])


@pytest.mark.parametrize(
    ("model", "row", "message"),
    [
        ("mk", [-1.0, 0, 0, 0], "displacement_bending_mm = -1: calibrated for 0 or more only"),
        ("hybrid", [-1.0, 0, 0, 0], "displacement_bending_mm = -1: calibrated for 0 or more only"),
        ("mk", [0, 5.0, 0, 0], "displacement_torsion_proximal_mm = 5: beyond the range of its joint"),
        ("pi", [60.0, 0, 0, 0], "displacement_bending_mm = 60: beyond the range of its joint"),
        ("mk", [60.0, 0, 0, 0], "displacement_bending_mm = 60: beyond the range of its joint"),
    ],
)
def test_what_the_corrections_do_not_cover_is_refused(model, row, message) -> None:
    """One line names the row, the model, the column and the value."""
    with pytest.raises(InputError, match=message) as caught:
        solve(model, np.array([[0.0, 0.0, 0.0, 0.0], row]))
    assert str(caught.value).startswith("row 2 ")
    assert "\n" not in str(caught.value)


def test_the_corrections_are_offered_for_their_design_alone() -> None:
    """The 4-DoF robot has pure kinematics of the models of 2022."""
    other = load_robot("mitral_4dof")
    offered = [name for name in ("pk", "mk", "pi", "hybrid") if STATIC_MODELS[name].applies_to(other)]
    assert offered == ["pk"]
