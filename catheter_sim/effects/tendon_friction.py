"""Capstan friction of the tendons differs from the specification."""

from __future__ import annotations

from dataclasses import replace

from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.specification import Friction


def _parameters(robot: Robot) -> tuple[Parameter, ...]:
    if isinstance(robot, CatheterRobot):
        return ()  # its joints' angles follow the tendons' lengths
    null = robot.friction.mu
    return (Parameter("mu", null=null, lower=0.0, upper=1.5, scale=0.05, start=round(null + 0.1, 9)),)


def _change_robot(robot: Robot, values: Values) -> Robot:
    return replace(robot, friction=Friction(mu=values["mu"]))


EFFECT = Effect(
    name="tendon_friction",
    summary="capstan friction of the tendons differs from the specification",
    trace="a loop between loading and unloading whose width grows with tension and bending",
    parameters=_parameters,
    change_robot=_change_robot,
)
