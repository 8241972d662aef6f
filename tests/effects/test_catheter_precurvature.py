"""Claims about the rest curvature of catheters: of the exposed tube, or of a bending joint."""

from __future__ import annotations

import math

import numpy as np
import pytest

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.effects import EFFECTS
from catheter_sim.effects.apply import check_effects, with_built_in_effects, with_effects
from catheter_sim.errors import InputError
from catheter_sim.robots.catheter.kinematics import pk
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.simulation.replay import simulate

PRECURVATURE = EFFECTS["precurvature"]
ROWS_MM = np.array([(0, 0, 0, 0), (0, 0, 0, 40), (2, 1, -1, 40), (-1.5, 1, 0.5, 20)])


def catheter(name: str, **values: float) -> CatheterRobot:
    """Return a robot with the effect in it."""
    robot = with_built_in_effects(with_effects(load_robot(name), {"precurvature": values}))
    assert isinstance(robot, CatheterRobot)
    return robot


def tips_mm(robot: CatheterRobot, solver: str = "pk") -> Array:
    zeros = np.zeros((len(ROWS_MM), 3))
    inputs = Inputs(np.arange(len(ROWS_MM), dtype=float), "displacement", 1e-3 * ROWS_MM, zeros, zeros)
    if solver == "pk":
        postures = pk(robot, inputs, np.zeros(3)).postures
    else:
        postures = simulate(robot, inputs, np.zeros(3)).postures
    return 1e3 * np.array([posture.p_w[-1] for posture in postures])


def test_the_tube_alone_is_the_simplest_way_then_the_joints() -> None:
    """Two variants; a joint's bend bears its segment's name, in degrees; nulls do nothing."""
    assert PRECURVATURE.variants(load_robot("mitral_transseptal")) == (
        ("curvature_x_per_m", "curvature_y_per_m"),
        ("bending_deg",),
    )
    assert PRECURVATURE.variants(load_robot("mitral_4dof")) == (
        ("curvature_x_per_m", "curvature_y_per_m"),
        ("bending_proximal_deg", "bending_distal_deg"),
    )
    for name in ("mitral_transseptal", "mitral_4dof"):
        robot = load_robot(name)
        nulls = {item.name: item.null for item in PRECURVATURE.parameters(robot)}
        assert with_built_in_effects(with_effects(robot, {"precurvature": nulls})) == robot


def test_curved_tube_shows_as_far_as_it_is_out() -> None:
    """At no advance nothing; at 40 mm the tip is off by s^2 k / 2 and by the lever of what is beyond, 10.5
    mm times s k, to first order; in y as in x.
    """
    straight = tips_mm(catheter("mitral_transseptal"))
    off = tips_mm(catheter("mitral_transseptal", curvature_x_per_m=2.0, curvature_y_per_m=-1.0)) - straight
    assert off[0] == pytest.approx(np.zeros(3), abs=1e-12)
    assert off[1, :2] == pytest.approx((0.8 + 0.42) * np.array([2.0, -1.0]), rel=5e-3)


def test_bent_joint_adds_its_bend_at_every_input() -> None:
    """At rest the tip is that of the joint bent by so much; the joint of this segment and no other."""
    robot = catheter("mitral_4dof", bending_distal_deg=10.0)
    rests = [math.degrees(segment.rest_rad) for segment in robot.segments]
    assert rests == pytest.approx([0.0, 0.0, 10.0, 0.0, 0.0, 0.0])
    bend, length, beyond = math.radians(10.0), 15.66, 2.0 + 5.0 + 15.0
    across = length * (1 - math.cos(bend)) / bend + beyond * math.sin(bend)
    assert tips_mm(robot)[0, :2] == pytest.approx([0.0, across], abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    "values", [{"curvature_x_per_m": 6.0, "curvature_y_per_m": 9.0}, {"bending_deg": -8.0}]
)
def test_simulation_and_twin_carry_the_same_effect(values: dict[str, float]) -> None:
    """The effect moves the tip by millimetres, the simulated one as the twin's: within 0.05 mm."""
    robot = catheter("mitral_transseptal", **values)
    twin = tips_mm(robot)
    assert np.abs(twin - tips_mm(catheter("mitral_transseptal")))[1:].max() > 3.0
    assert np.abs(tips_mm(robot, "simulation") - twin).max() < 0.05


def test_what_the_robot_does_not_have_is_refused() -> None:
    """The other robot's joint, and a bend beyond 30 deg."""
    robot = load_robot("mitral_transseptal")
    for values, told in (({"bending_distal_deg": 1.0}, "bending_deg"), ({"bending_deg": 31.0}, "-30 to 30")):
        with pytest.raises(InputError, match=told):
            check_effects(with_effects(robot, {"precurvature": values}))
