"""Capstan friction of the tendons differs from the specification, or their path is tortuous."""

from __future__ import annotations

from catheter_sim.core.effect import Effect, Form, Parameter, Role, Stage, Values
from catheter_sim.core.numbers import number, with_values
from catheter_sim.core.robot import R, RobotSpec
from catheter_sim.effects._places import added_at, places

_MU, _PATH = "mu", "path_deg"
_MOST_PATH_DEG = 1440.0  # four turns


def _coefficient(robot: RobotSpec) -> tuple[Parameter, ...]:
    keys = [item.key for item in places(robot, Role.FRICTION)]
    if not keys:
        return ()
    null = number(robot, keys[0])
    return (Parameter(_MU, null=null, lower=0.0, upper=1.5, scale=0.05, start=round(null + 0.1, 9)),)


def _rubbed(robot: R, values: Values) -> R:
    if _MU not in values:
        return robot
    return with_values(robot, {item.key: values[_MU] for item in places(robot, Role.FRICTION)})


def _path(robot: RobotSpec) -> tuple[Parameter, ...]:
    if not places(robot, Role.PATH):
        return ()
    return (Parameter(_PATH, null=0.0, lower=0.0, upper=_MOST_PATH_DEG, scale=30.0, start=90.0),)


EFFECT = Effect(
    name="tendon_friction",
    summary="the tendons' capstan friction differs from the specification, or a catheter's path is tortuous",
    trace="a loop between loading and unloading whose width grows with tension and bending",
    bench="Hang a weight on one end of a tendon, bend the robot by hand, and pull the other end with "
    "a spring scale: the force at which the tendon starts to slide, over the weight, is what "
    "friction makes of it. Look for worn or dirty eyelets.",
    forms=(
        Form(
            name="coefficient",
            equation="the tensions before and after a turn by an angle a differ by at most exp(mu a) (Euler)",
            stage=Stage.SPECIFICATION,
            parameters=_coefficient,
            specify=_rubbed,
        ),
        Form(
            name="path",
            equation="before the robot the tendons turn by path_deg, and rub there as by Euler's law",
            stage=Stage.SPECIFICATION,
            parameters=_path,
            groups=lambda robot: (),  # it does what a larger coefficient does
            specify=lambda robot, values: added_at(robot, Role.PATH, values),
        ),
    ),
    same_as=frozenset({Role.FRICTION}),
    advice={
        frozenset(
            {"backlash"}
        ): "Repeat the loops at two pretensions: friction widens the loop with tension, backlash does not.",
    },
)
