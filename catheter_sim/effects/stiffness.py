"""The elastic constant differs from the specification; the law keeps its form."""

from __future__ import annotations

from dataclasses import replace

from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.kinds import Robot


def _parameters(robot: Robot) -> tuple[Parameter, ...]:
    return (Parameter("scale", null=1.0, lower=0.1, upper=10.0, scale=0.05, start=1.0),)


def _change_robot(robot: Robot, values: Values) -> Robot:
    return replace(robot, stiffness_scale=robot.stiffness_scale * values["scale"])


EFFECT = Effect(
    name="stiffness",
    summary="every elastic constant is `scale` times the specified one",
    trace="too little or too much bending under tension or load, in proportion, in every direction",
    parameters=_parameters,
    change_robot=_change_robot,
)
