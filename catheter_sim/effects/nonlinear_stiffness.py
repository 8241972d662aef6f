"""The elastic law softens or stiffens with bending, as of superelastic NiTi."""

from __future__ import annotations

from catheter_sim.effects._scales import sharpest_curvature_per_m
from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.kinds import Robot, require_no_catheter, with_segments


def _parameters(robot: Robot) -> tuple[Parameter, ...]:
    if isinstance(robot, CatheterRobot):
        return ()  # its joints' angles follow the tendons' lengths
    unit = 1e6 / sharpest_curvature_per_m(robot) ** 2  # the moment doubles there
    return (
        Parameter("cubic_mm2", null=0.0, lower=-0.3 * unit, upper=5.0 * unit, scale=0.05 * unit, start=0.0),
    )


def _change_robot(robot: Robot, values: Values) -> Robot:
    robot = require_no_catheter(robot, "a nonlinear elastic law")
    added = values["cubic_mm2"] * 1e-6
    return with_segments(
        robot, ({"stiffness_cubic_m2": segment.stiffness_cubic_m2 + added} for segment in robot.segments)
    )


EFFECT = Effect(
    name="nonlinear_stiffness",
    summary="moment EI (k + cubic k^3) of the bend per length k, added to the specified law",
    trace="an error that grows faster than the bending, alike in all directions",
    parameters=_parameters,
    change_robot=_change_robot,
)
