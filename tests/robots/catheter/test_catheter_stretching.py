"""The TE model: the 4-DoF robot with tendons that stretch (Nayar 2023, Section III)."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import posture_columns
from catheter_sim.core.inputs import Inputs
from catheter_sim.errors import InputError
from catheter_sim.robots.catheter.kinematics import pulled_m
from catheter_sim.robots.catheter.measured import (
    DISTAL,
    PROXIMAL,
    JointForce,
    loading_N,
    stretching_joints,
)
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.theory.static_models import STATIC_MODELS
from reference.catheter import displacement_for_angles_m

ROBOT = load_robot("mitral_4dof")
assert isinstance(ROBOT, CatheterRobot)
JOINTS = ("bending_proximal", "bending_distal")


def solve(robot: CatheterRobot, **ways_m: np.ndarray) -> dict[str, np.ndarray]:
    """Return every output column of the TE model for ways of the named pairs [m]."""
    rows = len(next(iter(ways_m.values())))
    tendon = np.zeros((rows, len(robot.tendons)))
    for pair, item in enumerate(robot.tendons):
        tendon[:, pair] = ways_m.get(item.name, 0.0)
    zeros = np.zeros((rows, 3))
    inputs = Inputs(np.arange(rows, dtype=float), "displacement", tendon, zeros, zeros)
    run = STATIC_MODELS["te"].solve(robot, inputs, np.zeros(3))
    assert run.residual.max() < 1e-12
    return posture_columns(robot, run.postures)


def there_and_back(*turns: float, steps: int = 15) -> np.ndarray:
    """Return a way through the turns, starting with the first."""
    parts = [np.linspace(a, b, steps + 1)[1:] for a, b in pairwise(turns)]
    return np.concatenate([[turns[0]], *parts])


@pytest.mark.slow
@pytest.mark.parametrize("name", JOINTS)
def test_feedforward_reaches_the_angles(name: str) -> None:
    """Displacements by Eq. 12 plus elongation bend the model's joint along the wanted angles.

    Through both sides, partial turns and the set of earlier cycles, to 1e-4 deg; where the joint needs
    no tension its angle is that of the tendon just taut.
    """
    wanted = there_and_back(0.0, 40.0, 10.0, 70.0, 0.0, -50.0, -20.0, -60.0, 30.0, 0.0)
    joint = stretching_joints(ROBOT)[name]
    ways = displacement_for_angles_m(joint, np.radians(wanted))
    reached = solve(ROBOT, **{name: ways})[f"angle_{name}_deg"]
    np.testing.assert_allclose(reached, wanted, atol=1e-4)


@pytest.mark.parametrize("name", JOINTS)
def test_pure_kinematics_falls_far_short(name: str) -> None:
    """Driven by Eq. 12 alone, new tendons of 350 mm take more than three quarters of the way to 45 deg."""
    joint = stretching_joints(ROBOT)[name]
    wanted = there_and_back(0.0, 45.0)
    reached = solve(ROBOT, **{name: pulled_m(joint.segment, np.radians(wanted))})[f"angle_{name}_deg"]
    assert 0.0 < reached.max() < 0.25 * 45.0


@pytest.mark.slow
def test_short_tendons_do_not_stretch() -> None:
    """As the tendons' length goes to zero, the TE model becomes pure kinematics."""
    way = there_and_back(0.0, 2.0e-3, -1.5e-3)
    short = [f"tendons.{name}.length_mm=1e-6" for name in JOINTS]
    robot = load_robot("mitral_4dof", short)
    assert isinstance(robot, CatheterRobot)
    zeros = np.zeros((len(way), 3))
    tendon = np.stack([way, 0.5 * way, 0.1 * way, np.zeros(len(way))], axis=1)
    inputs = Inputs(np.arange(len(way), dtype=float), "displacement", tendon, zeros, zeros)
    columns = [
        posture_columns(robot, STATIC_MODELS[name].solve(robot, inputs, np.zeros(3)).postures)
        for name in ("te", "pk")
    ]
    for column in ("angle_bending_proximal_deg", "angle_bending_distal_deg", "tip_x_mm", "tip_y_mm"):
        np.testing.assert_allclose(columns[0][column], columns[1][column], atol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "law"), [(JOINTS[0], PROXIMAL), (JOINTS[1], DISTAL)])
def test_tension_is_the_joints_and_loops(name: str, law: JointForce) -> None:
    """On the way out the tension is the joint's own loading cubic, on the way back it is less."""
    columns = solve(ROBOT, **{name: there_and_back(0.0, 10e-3, 0.0, steps=40)})
    angle, tension = columns[f"angle_{name}_deg"], columns[f"tension_{name}_N"]
    np.testing.assert_allclose(tension[5:41], loading_N(law, angle[5:41]), atol=1e-9)
    back = np.interp(30.0, angle[:40:-1], tension[:40:-1])
    assert back < 0.75 * np.interp(30.0, angle[:41], tension[:41])


@pytest.mark.slow
def test_a_joint_holds_between_the_curves() -> None:
    """Pulled again after a partial return, the tension rises first, the angle stands still."""
    columns = solve(ROBOT, bending_distal=there_and_back(0.0, 10e-3, 8e-3, 9.9e-3, steps=40))
    angle, tension = columns["angle_bending_distal_deg"], columns["tension_bending_distal_N"]
    still = np.isclose(angle[81:], angle[80], atol=1e-9)
    assert still[:5].all()
    assert not still[-1]
    assert (np.diff(tension[80:86]) > 0.0).all()


@pytest.mark.slow
def test_a_set_is_a_dead_band() -> None:
    """After a cycle the joint is straight before the displacement is back at zero, on both sides."""
    columns = solve(ROBOT, bending_distal=there_and_back(0.0, 10e-3, 0.0, steps=50))
    angle = columns["angle_bending_distal_deg"]
    assert angle[-1] == pytest.approx(0.0, abs=1e-9)
    assert np.isclose(angle[51:], 0.0, atol=1e-9).sum() > 10


@pytest.mark.slow
def test_rows_spacing_does_not_matter() -> None:
    """Through the turning points alone the angles are those of small steps."""
    turns = (0.0, 9e-3, 4e-3, 8e-3, -6e-3, 3e-3)
    coarse = solve(ROBOT, bending_proximal=np.array(turns))["angle_bending_proximal_deg"]
    fine = solve(ROBOT, bending_proximal=there_and_back(*turns, steps=12))["angle_bending_proximal_deg"]
    np.testing.assert_allclose(fine[::12], coarse, atol=1e-6)


@pytest.mark.slow
def test_the_sides_are_alike() -> None:
    """The reversed displacement bends the other way by as much."""
    way = there_and_back(0.0, 8e-3, 1e-3)
    name = "bending_proximal"
    right, left = (solve(ROBOT, bending_proximal=sign * way)[f"angle_{name}_deg"] for sign in (1.0, -1.0))
    np.testing.assert_allclose(left, -right, atol=1e-12)


def test_torsion_and_advance_stay_kinematic() -> None:
    """The torsion joint turns by displacement over radius, its tendon carries nothing."""
    columns = solve(ROBOT, torsion=np.array([0.0, 1e-3]), advance=np.array([0.0, 20e-3]))
    assert columns["angle_torsion_deg"][1] == pytest.approx(math.degrees(1.0 / 2.1))
    assert columns["tip_z_mm"][1] == pytest.approx(68.18)
    assert not columns["tension_torsion_N"].any()


@pytest.mark.parametrize(
    ("settings", "way_m", "message"),
    [
        (["tendons.bending_distal.length_mm=0"], 1e-3, "length_mm = 0: static model 'te' needs"),
        (["tendons.bending_distal.stiffness_N_per_mm=5"], 1e-3, "stiffness_N_per_mm = 5: .* must be inf"),
        ([], 30e-3, r"row 2 .* displacement_bending_distal_mm = 30: bends beyond its joint's limit of 120"),
        ([], -30e-3, r"row 2 .* displacement_bending_distal_mm = -30: bends beyond"),
    ],
)
def test_what_it_does_not_cover_is_refused(settings: list[str], way_m: float, message: str) -> None:
    """A pair without a length, with a stiffness of its own, or pulled too far: one line."""
    robot = load_robot("mitral_4dof", settings)
    assert isinstance(robot, CatheterRobot)
    with pytest.raises(InputError, match=message) as caught:
        solve(robot, bending_distal=np.array([0.0, way_m]))
    assert "\n" not in str(caught.value)


def test_it_is_offered_for_its_design_alone() -> None:
    """TE knows the 4-DoF robot, not the transseptal one, nor a shorter row of joints."""
    model = STATIC_MODELS["te"]
    assert model.applies_to(ROBOT)
    assert not model.applies_to(load_robot("mitral_transseptal"))
    assert not model.applies_to(replace(ROBOT, segments=ROBOT.segments[:-1]))
