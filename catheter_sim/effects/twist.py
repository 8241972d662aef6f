"""The tendons' holes turn about the backbone along the robot: out-of-plane motion that grows."""

from __future__ import annotations

import math

from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.kinds import Robot, with_segments
from catheter_sim.robots.specification import ContinuumRobot


def _parameters(robot: Robot) -> tuple[Parameter, ...]:
    if not isinstance(robot, ContinuumRobot):
        return ()  # its holes are in its links, which do not turn
    if any(segment.bending_axes != "xy" for segment in robot.segments):
        return ()  # hinges of a planar robot keep its plane
    bound = 90.0 / sum(segment.length_m for segment in robot.segments)
    return (Parameter("rate_deg_per_m", null=0.0, lower=-bound, upper=bound, scale=0.02 * bound, start=0.0),)


def _change_robot(robot: Robot, values: Values) -> Robot:
    assert isinstance(robot, ContinuumRobot)
    added = math.radians(values["rate_deg_per_m"])
    return with_segments(
        robot, ({"rest_twist_rad_per_m": segment.rest_twist_rad_per_m + added} for segment in robot.segments)
    )


EFFECT = Effect(
    name="twist",
    summary="the tendons' holes turn about the backbone at a constant rate along the robot",
    trace="a bending plane that turns from segment to segment",
    parameters=_parameters,
    change_robot=_change_robot,
)
