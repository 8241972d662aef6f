"""Capstan friction of the tendons differs from the specification."""

from __future__ import annotations

import math
from dataclasses import replace

from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.catheter_layout import bent_by, is_extensible
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.specification import Friction


def _parameters(robot: Robot) -> tuple[Parameter, ...]:
    if isinstance(robot, CatheterRobot) and not any(
        is_extensible(pair) for pair in robot.tendons if pair.name in bent_by(robot)
    ):
        return ()  # its joints' angles follow its inextensible tendons' lengths, rubbed or not
    null = robot.friction.mu
    mu = Parameter("mu", null=null, lower=0.0, upper=1.5, scale=0.05, start=round(null + 0.1, 9))
    if not isinstance(robot, CatheterRobot):
        return (mu,)
    most = 1440.0  # four turns
    return mu, Parameter("path_deg", null=0.0, lower=0.0, upper=most, scale=30.0, start=90.0)


def _variants(robot: Robot) -> tuple[tuple[str, ...], ...]:
    return (("mu",),)  # a path's angle does what a larger coefficient does


def _change_robot(robot: Robot, values: Values) -> Robot:
    if isinstance(robot, CatheterRobot):
        robot = replace(robot, path_rad=robot.path_rad + math.radians(values["path_deg"]))
    return replace(robot, friction=Friction(mu=values["mu"]))


EFFECT = Effect(
    name="tendon_friction",
    summary="the tendons' capstan friction differs from the specification, or a catheter's path is tortuous",
    trace="a loop between loading and unloading whose width grows with tension and bending",
    parameters=_parameters,
    change_robot=_change_robot,
    variants=_variants,
)
