"""Capstan friction of the tendons differs from the specification, or their path is tortuous."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.document import number, with_values
from catheter_sim.core.effect import Effect, Form, Parameter, Role, Stage, Values
from catheter_sim.core.inputs import Quantity, quantity_of
from catheter_sim.core.robot import R, RobotSpec
from catheter_sim.effects.shared import added_at, places
from catheter_sim.mechanics.hysteresis import rubbed

_MU, _PATH, _LOSS = "mu", "path_deg", "path_loss"
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


def _loss(robot: RobotSpec) -> tuple[Parameter, ...]:
    if quantity_of(robot.actuation) is not Quantity.TENSION:
        return ()
    return (Parameter(_LOSS, null=0.0, lower=0.0, upper=1.0, scale=0.02, start=0.05),)


@dataclass(frozen=True)
class _Held:
    """What the path takes, and the tensions behind it, shape (t,) [N]."""

    loss: float
    behind: Array


@dataclass(frozen=True)
class _Path:
    """Friction on the way to the robot: the tensions before and behind it differ by at most exp(loss)."""

    timed = False

    def start(self, robot: RobotSpec, values: Values, rest: Array) -> _Held | None:
        """Return the state at rest; None without a path."""
        loss = values.get(_LOSS, 0.0)
        return _Held(loss, rest) if loss > 0.0 else None

    def step(self, state: _Held, before: Array, after: Array, dt_s: float) -> tuple[_Held, Array]:
        """Return the state and what arrives when the tensions have moved from `before` to `after`."""
        behind = np.clip(state.behind, after * math.exp(-state.loss), after * math.exp(state.loss))
        return replace(state, behind=behind), behind

    def series(self, robot: RobotSpec, values: Values, rest: Array, time_s: Array, rows: Array) -> Array:
        """Return what arrives at each row, same shape as `rows` (r, t), from rest."""
        return rubbed(rows, values.get(_LOSS, 0.0), rest)


EFFECT = Effect(
    name="tendon_friction",
    summary="the tendons' capstan friction differs from the specification, or a catheter's path is tortuous, "
    "or tendons that are pulled rub before they reach the robot",
    trace="a loop between loading and unloading whose width grows with tension and bending",
    bench="Bend the robot by hand and hang a weight on one end of a tendon. Pull the other end with "
    "a spring scale. When the tendon starts to slide, force over weight gives the friction. "
    "Look for worn or dirty eyelets.",
    forms=(
        Form(
            name="coefficient",
            equation="the tensions before and after a turn by an angle a differ by at most exp(mu * a) "
            "(Euler)",
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
        Form(
            name="drive",
            equation="before the robot T' stays between T * exp(-path_loss) and T * exp(path_loss) (Euler)",
            stage=Stage.COMMAND,
            parameters=_loss,
            memory=_Path(),
            further=True,
        ),
    ),
    same_as=frozenset({Role.FRICTION}),
    advice={
        frozenset(
            {"backlash"}
        ): "Repeat the loops at two pretensions: friction widens the loop with tension, backlash does not.",
    },
)
