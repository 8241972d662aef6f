"""The unloaded robot is not straight; of a catheter, its exposed tube or its bending joints."""

from __future__ import annotations

import math

from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.catheter_layout import bent_by
from catheter_sim.robots.kinds import Robot, with_segments
from catheter_sim.robots.rolling import RollingRobot, RollingSegment
from catheter_sim.robots.specification import ContinuumRobot, Segment

Curved = ContinuumRobot | RollingRobot
_TUBE = {axis: f"curvature_{axis}_per_m" for axis in "xy"}
_MOST_REST_DEG = 30.0
_REST_SCALE_DEG = 1.0  # as 0.02 over a length is for a curvature


def _axes(robot: Curved) -> str:
    return "xy" if any(segment.bending_axes == "xy" for segment in robot.segments) else "x"


def _common(robot: Curved) -> dict[str, str]:
    return {axis: f"curvature_{axis}_per_m" for axis in _axes(robot)}


def _each(segment: Segment | RollingSegment) -> dict[str, str]:
    return {axis: f"curvature_{segment.name}_{axis}_per_m" for axis in segment.bending_axes}


def _parameter(name: str, length_m: float) -> Parameter:
    bound = 2.0 / length_m  # some 115 deg over the length
    return Parameter(name, 0.0, -bound, bound, scale=0.02 / length_m, start=0.0)


def _stroke_m(robot: CatheterRobot) -> float:
    return max((part.stroke_m for part in robot.segments if part.joint == "prismatic"), default=0.0)


def _rests(robot: CatheterRobot) -> dict[str, str]:
    """Return the parameter of each bending joint, by its segment's name."""
    return {segment.name: f"{segment.name}_deg" for segment in bent_by(robot).values()}


def _catheter_parameters(robot: CatheterRobot) -> tuple[Parameter, ...]:
    stroke = _stroke_m(robot)
    found = [_parameter(name, stroke) for name in _TUBE.values()] if stroke else []
    return (
        *found,
        *(
            Parameter(name, 0.0, -_MOST_REST_DEG, _MOST_REST_DEG, scale=_REST_SCALE_DEG, start=0.0)
            for name in _rests(robot).values()
        ),
    )


def _parameters(robot: Robot) -> tuple[Parameter, ...]:
    if isinstance(robot, CatheterRobot):
        return _catheter_parameters(robot)
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
        parts = (tuple(_TUBE.values()) if _stroke_m(robot) else (), tuple(_rests(robot).values()))
        return tuple(names for names in parts if names)
    common = tuple(_common(robot).values())
    if len(robot.segments) == 1:
        return (common,)
    return (common, tuple(name for segment in robot.segments for name in _each(segment).values()))


def _curved_catheter(robot: CatheterRobot, values: Values) -> CatheterRobot:
    rests = _rests(robot)
    changes: list[dict[str, float]] = []
    for segment in robot.segments:
        if segment.joint == "prismatic":
            change = {
                f"tube_{name}": getattr(segment, f"tube_{name}") + values.get(name, 0.0)
                for name in _TUBE.values()
            }
        elif segment.name in rests:
            added = math.radians(values.get(rests[segment.name], 0.0))
            change = {"rest_rad": segment.rest_rad + added}
        else:
            change = {}
        changes.append(change)
    return with_segments(robot, changes)


def _change_robot(robot: Robot, values: Values) -> Robot:
    if isinstance(robot, CatheterRobot):
        return _curved_catheter(robot, values)
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
    summary="the unloaded robot is bent: a rest curvature (of a catheter, its exposed tube's, or a bending "
    "joint's rest bend) is added to its own",
    trace="an error that is largest near rest, where the tip is off the axis",
    parameters=_parameters,
    change_robot=_change_robot,
    variants=_variants,
)
