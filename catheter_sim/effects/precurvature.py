"""The unloaded robot is not straight."""

from __future__ import annotations

from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.kinds import Robot, require_no_catheter, with_segments
from catheter_sim.robots.rolling import RollingRobot, RollingSegment
from catheter_sim.robots.specification import ContinuumRobot, Segment

Curved = ContinuumRobot | RollingRobot


def _axes(robot: Curved) -> str:
    return "xy" if any(segment.bending_axes == "xy" for segment in robot.segments) else "x"


def _common(robot: Curved) -> dict[str, str]:
    return {axis: f"curvature_{axis}_per_m" for axis in _axes(robot)}


def _each(segment: Segment | RollingSegment) -> dict[str, str]:
    return {axis: f"curvature_{segment.name}_{axis}_per_m" for axis in segment.bending_axes}


def _parameter(name: str, length_m: float) -> Parameter:
    bound = 2.0 / length_m  # some 115 deg over the length
    return Parameter(name, 0.0, -bound, bound, scale=0.02 / length_m, start=0.0)


def _parameters(robot: Robot) -> tuple[Parameter, ...]:
    if isinstance(robot, CatheterRobot):
        return ()  # has no rest curvature yet
    length = sum(segment.length_m for segment in robot.segments)
    found = [_parameter(name, length) for name in _common(robot).values()]
    if len(robot.segments) > 1:
        found += [
            _parameter(name, segment.length_m)
            for segment in robot.segments
            for name in _each(segment).values()
        ]
    return tuple(found)


def _variants(robot: Robot) -> tuple[tuple[str, ...], ...]:
    if isinstance(robot, CatheterRobot):
        return ((),)
    common = tuple(_common(robot).values())
    if len(robot.segments) == 1:
        return (common,)
    return (common, tuple(name for segment in robot.segments for name in _each(segment).values()))


def _change_robot(robot: Robot, values: Values) -> Robot:
    robot = require_no_catheter(robot, "a rest curvature")
    common = _common(robot)
    changes = []
    for segment in robot.segments:
        added = {
            axis: values.get(common[axis], 0.0) + values.get(name, 0.0)
            for axis, name in _each(segment).items()
        }
        changes.append(
            {
                "rest_curvature_x_per_m": segment.rest_curvature_x_per_m + added["x"],
                "rest_curvature_y_per_m": segment.rest_curvature_y_per_m + added.get("y", 0.0),
            }
        )
    return with_segments(robot, changes)


EFFECT = Effect(
    name="precurvature",
    summary="the unloaded robot is bent: a rest curvature, common and per segment, is added to its own",
    trace="an error that is largest near rest, where the tip is off the axis",
    parameters=_parameters,
    change_robot=_change_robot,
    variants=_variants,
)
