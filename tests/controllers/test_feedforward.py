"""Claims about feedforward: each model's displacements bring the same model to the desired angles."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from catheter_sim.arrays import Array
from catheter_sim.controllers.loop import along, feedforward
from catheter_sim.core.inputs import Inputs
from catheter_sim.errors import InputError
from catheter_sim.robots.catheter.kinematics import pk
from catheter_sim.robots.catheter.measured import mk, stretching_joints, te
from catheter_sim.robots.catheter.published import mitral_4dof, mitral_transseptal
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.validation.mitral import joint_angles_deg
from reference.catheter import displacement_for_angles_m

NO_GRAVITY = np.zeros(3)


def path(*corners: float, steps: int = 30) -> Array:
    """Return a way straight through the corners."""
    parts = [np.linspace(a, b, steps, endpoint=False) for a, b in itertools.pairwise(corners)]
    return np.concatenate([*parts, [corners[-1]]])


def desired(robot: CatheterRobot, **columns: Array) -> Array:
    """Return rows of joint values in the order of the pairs, by name [deg or m]; others 0."""
    rows = len(next(iter(columns.values())))
    zero = np.zeros(rows)
    names = [pair.name for pair in robot.tendons]
    assert set(columns) <= set(names)
    return np.stack(
        [
            columns.get(name, zero) if name == "advance" else np.radians(columns.get(name, zero))
            for name in names
        ],
        axis=1,
    )


def inputs(displacement_m: Array) -> Inputs:
    nothing = np.zeros((len(displacement_m), 3))
    times = np.arange(len(displacement_m), dtype=float)
    return Inputs(times, "displacement", displacement_m, nothing, nothing)


@pytest.mark.parametrize("robot", [mitral_4dof(), mitral_transseptal()], ids=lambda robot: robot.name)
def test_pk_brings_pk_to_the_desired_angles(robot: CatheterRobot) -> None:
    """Every joint, to both sides; the advance is passed on."""
    wave = path(0.0, 60.0, -40.0, 0.0)
    bends = {pair.name: wave for pair in robot.tendons if pair.name != "advance"}
    wanted = desired(robot, advance=wave * 1e-4, **bends)
    way = along(feedforward(robot, "pk"), wanted)
    found = joint_angles_deg(robot, pk(robot, inputs(way), NO_GRAVITY).postures)
    for name in bends:
        np.testing.assert_allclose(found[name], wave, atol=1e-9)
    np.testing.assert_array_equal(way[:, -1], wave * 1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bending_proximal", "bending_distal"])
def test_te_brings_te_to_the_desired_angles(name: str) -> None:
    """Through two cycles of growing size and a partial return the static model TE ends where it was sent."""
    robot = mitral_4dof()
    wave = path(5.0, 40.0, 5.0, 70.0, 30.0, 65.0, steps=8)
    way = along(feedforward(robot, "te"), desired(robot, **{name: wave}))
    found = joint_angles_deg(robot, te(robot, inputs(way), NO_GRAVITY).postures)[name]
    np.testing.assert_allclose(found, wave, atol=1e-6)


@pytest.mark.parametrize("name", ["bending_proximal", "bending_distal"])
def test_te_step_by_step_is_te_at_once(name: str) -> None:
    """Called angle by angle it gives what the static model gives for the whole way, to both sides."""
    robot = mitral_4dof()
    wave = path(0.0, 50.0, 10.0, 60.0, -30.0, 20.0, steps=12)
    pair = [item.name for item in robot.tendons].index(name)
    way = along(feedforward(robot, "te"), desired(robot, **{name: wave}))[:, pair]
    expected = displacement_for_angles_m(stretching_joints(robot)[name], np.radians(wave))
    np.testing.assert_allclose(way, expected, atol=1e-12)


def test_te_starts_from_rest_in_small_steps() -> None:
    """A slow start asks a new tendon for less than its envelope begins with: it has not stretched yet."""
    robot = mitral_4dof()
    joint = robot.segments[0]
    wave = np.linspace(0.0, 3.55, 1000)  # Algorithm 2 asks for 0.03 N at 3.56 deg
    way = along(feedforward(robot, "te"), desired(robot, bending_proximal=wave))[:, 0]
    pure = along(feedforward(robot, "pk"), desired(robot, bending_proximal=wave))[:, 0]
    assert joint.name == "bending_proximal"
    np.testing.assert_allclose(way, pure, atol=1e-9)


def test_te_pulls_further_than_pk_and_less_on_the_second_way_back() -> None:
    """The stretch adds to Eq. 12; after a cycle the permanent set is left in the displacement."""
    robot = mitral_4dof()
    wave = path(1.0, 60.0, 1.0)
    way = along(feedforward(robot, "te"), desired(robot, bending_proximal=wave))[:, 0]
    pure = along(feedforward(robot, "pk"), desired(robot, bending_proximal=wave))[:, 0]
    assert way[30] > 3.0 * pure[30]
    assert way[-1] > way[0] + 1e-3


def test_dead_band_compensation_undoes_a_play() -> None:
    """Behind a play of the width that is compensated, torsion goes where it is sent, also after reversals."""
    robot, width = mitral_4dof(), 0.8e-3
    wave = path(0.0, 40.0, -30.0, 10.0)
    way = along(feedforward(robot, "te", {"torsion": width}), desired(robot, torsion=wave))[:, 2]
    behind, now = [], 0.0
    for drive in way:
        now = min(max(now, drive - 0.5 * width), drive + 0.5 * width)
        behind.append(now / 2.1e-3)
    np.testing.assert_allclose(np.degrees(behind), wave, atol=1e-9)


def test_mk_brings_mk_to_the_desired_angles() -> None:
    """Bending to 0.05 deg (Eq. 25's two lines miss each other by 0.04), torsion exactly, over its loop."""
    robot = mitral_transseptal()
    bend = path(0.0, 80.0, 5.0)
    proximal, distal = path(10.0, 58.8, 10.0), path(12.0, 73.0, 12.0)
    wanted = desired(robot, bending=bend, torsion_proximal=proximal, torsion_distal=distal)
    way = along(feedforward(robot, "mk"), wanted)
    found = joint_angles_deg(robot, mk(robot, inputs(way), NO_GRAVITY).postures)
    np.testing.assert_allclose(found["bending"], bend, atol=0.05)
    for name, wave in (("torsion_proximal", proximal), ("torsion_distal", distal)):
        np.testing.assert_allclose(found[name], wave, atol=1e-6)


def test_mk_torsion_crosses_its_dead_band_at_a_reversal() -> None:
    """Turning back in mid-loop, the displacement drops by d_b: 1.35 mm of the proximal joint."""
    robot = mitral_transseptal()
    wanted = desired(robot, torsion_proximal=np.array([10.0, 40.0, 40.0, 39.999999]))
    way = along(feedforward(robot, "mk"), wanted)[:, 1]
    assert way[2] == way[1]
    assert way[2] - way[3] == pytest.approx(1.35e-3, abs=1e-8)


@pytest.mark.parametrize(
    ("robot", "model", "bands", "message"),
    [
        (mitral_4dof(), "ke", None, "unknown feedforward 'ke'; choices: pk, te, mk"),
        (mitral_4dof(), "mk", None, "'mk' is of another design"),
        (mitral_transseptal(), "te", None, "'te' is of another design"),
        (mitral_4dof(), "te", {"bending_distal": 1e-3}, "'bending_distal'; choices: torsion"),
    ],
)
def test_what_does_not_fit_is_refused(
    robot: CatheterRobot, model: str, bands: dict[str, float] | None, message: str
) -> None:
    """A model of the other robot, an unknown one, a dead-band of a joint without one: one line."""
    with pytest.raises(InputError, match=message) as caught:
        feedforward(robot, model, bands)
    assert "\n" not in str(caught.value)


def test_angles_stay_in_radians() -> None:
    """An advance is a length, an angle is in radians: 1 rad of torsion is the drum's radius."""
    robot = mitral_4dof()
    way = along(feedforward(robot, "pk"), np.array([[0.0, 0.0, 1.0, 0.02]]))
    assert way[0, 2] == pytest.approx(2.1e-3)
    assert way[0, 3] == 0.02
    assert math.isfinite(way.sum())
