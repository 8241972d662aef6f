"""The unloaded robot is not straight."""

from __future__ import annotations

from dataclasses import replace

from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.specification import ContinuumRobot, Segment


def _names(robot: ContinuumRobot, segment: Segment) -> dict[str, str]:
    middle = "" if len(robot.segments) == 1 else f"{segment.name}_"
    return {axis: f"curvature_{middle}{axis}_per_m" for axis in segment.bending_axes}


def _parameters(robot: ContinuumRobot) -> tuple[Parameter, ...]:
    found = []
    for segment in robot.segments:
        bound = 2.0 / segment.length_m  # some 115 deg over the segment
        for name in _names(robot, segment).values():
            found.append(Parameter(name, 0.0, -bound, bound, scale=0.02 / segment.length_m, start=0.0))
    return tuple(found)


def _change_robot(robot: ContinuumRobot, values: Values) -> ContinuumRobot:
    segments = []
    for segment in robot.segments:
        names = _names(robot, segment)
        segments.append(
            replace(
                segment,
                rest_curvature_x_per_m=segment.rest_curvature_x_per_m + values[names["x"]],
                rest_curvature_y_per_m=segment.rest_curvature_y_per_m
                + (values[names["y"]] if "y" in names else 0.0),
            )
        )
    return replace(robot, segments=tuple(segments))


EFFECT = Effect(
    name="precurvature",
    summary="the unloaded robot is bent: a rest curvature is added to each segment's own",
    trace="an error that is largest near rest, where the tip is off the axis",
    parameters=_parameters,
    change_robot=_change_robot,
)
