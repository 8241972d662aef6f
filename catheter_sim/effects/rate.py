"""The response depends on speed: a lag, a delay or a drive's top speed, or the robot's own viscous loss.

In it: its material resists a rate of strain by more, or by less, than is specified. Before it: a viscous
drive, a slow servo. Behind it: a tracker that filters, or is late. Each trial starts at rest at its own first
row; what is observed has been watched long enough before that to show the first row as it is. Friction and
play run on what arrives at the rows; a turning point that a delay moves between two rows is seen at the rows
beside it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.document import number
from catheter_sim.core.effect import Effect, Form, Parameter, Role, Stage, Timing, Values
from catheter_sim.core.robot import R, RobotSpec
from catheter_sim.effects.shared import (
    TO_SI,
    Late,
    actuation_unit,
    added_at,
    common_and_each,
    common_then_each,
    in_si,
    places,
    scale_of,
)
from catheter_sim.mechanics.hysteresis import limited, limited_step

_VISCOUS = "damping_time_s"
_MOST_DAMPING_S = 0.3  # by which most robots swing no more
_DAMPING_SCALE = 0.1  # of a change that matters, of the damping that is specified
_LEAST_DAMPING_SCALE_S = 1e-3
_LONGEST_S = 10.0  # what is slower creeps: see `drift`
# [s] for a mm, or for the tension that bends the robot by a radian: bound, a change that matters, start.
_SERVO_S = (20.0, 0.1, 1.0)
# [s] scale and start: between held rows seconds pass, in motion hundredths of a second (assumed)
_HELD_S, _MOVING_S = (0.1, 0.2), (0.01, 0.02)


def _form(name: str, equation: str, parameter: str, memory: Late) -> Form:
    # Off zero the response has a slope by either also where a trial begins with a step.
    scale, start = _HELD_S
    item = Parameter(parameter, 0.0, 0.0, _LONGEST_S, scale=scale, start=start, in_motion=_MOVING_S)
    behind = memory is _BEHIND
    lags = parameter == memory.lag
    return Form(
        name=name,
        equation=equation,
        stage=Stage.OBSERVATION if behind else Stage.COMMAND,
        parameters=lambda robot: (item,),
        memory=memory,
        in_place=behind,
        timing=_timing(parameter, lags, behind),
    )


def _timing(parameter: str, lags: bool, behind: bool) -> Callable[[Values], Timing] | None:
    """Return what MJCF has of a form: actuators with lag and delay, sensors with a delay."""
    if lags and behind:
        return None
    if lags:
        return lambda values: Timing(lag_s=values.get(parameter, 0.0))
    return lambda values: Timing(delay_s=values.get(parameter, 0.0))


def _damping(robot: RobotSpec) -> tuple[Parameter, ...]:
    where = places(robot, Role.DAMPING)
    if not where:
        return ()
    specified_s = number(robot, where[0].key)
    scale = max(_DAMPING_SCALE * specified_s, _LEAST_DAMPING_SCALE_S)
    return (Parameter(_VISCOUS, 0.0, -specified_s, _MOST_DAMPING_S, scale=scale, start=0.0),)


def _damped(robot: R, values: Values) -> R:
    return added_at(robot, Role.DAMPING, values)


def _servo_names(robot: RobotSpec) -> tuple[str, str]:
    unit = scale_of(robot)
    return f"servo_s_per_{unit}", f"servo_{{}}_s_per_{unit}"


def _servo(robot: RobotSpec) -> tuple[Parameter, ...]:
    common, each = _servo_names(robot)
    bound, scale, start = (round(size / actuation_unit(robot), 9) for size in _SERVO_S)
    item = Parameter(common, 0.0, 0.0, bound, scale=scale, start=start, in_motion=(0.1 * scale, 0.1 * start))
    return common_and_each(robot, item, each)


@dataclass(frozen=True)
class _Limited:
    """The most that each drive moves in a second, and where the drives are, shape (t,) each, SI."""

    most_per_s: Array
    now: Array


@dataclass(frozen=True)
class _TopSpeed:
    """Drives that follow their commands at no more than a speed."""

    timed = True

    def start(self, robot: RobotSpec, values: Values, rest: Array) -> _Limited | None:
        """Return the state at rest; None where every drive is as fast as its command."""
        most = self._most(robot, values)
        return _Limited(most, rest) if np.isfinite(most).any() else None

    def step(self, state: _Limited, before: Array, after: Array, dt_s: float) -> tuple[_Limited, Array]:
        """Return the state and what arrives when the inputs have moved from `before` to `after`."""
        now = limited_step(state.now, before, after, state.most_per_s, dt_s)
        return replace(state, now=now), now

    def series(self, robot: RobotSpec, values: Values, rest: Array, time_s: Array, rows: Array) -> Array:
        """Return what arrives at each row, same shape as `rows` (r, t), from rest."""
        most = self._most(robot, values)
        return limited(time_s, rows, most, rest) if np.isfinite(most).any() else rows

    def _most(self, robot: RobotSpec, values: Values) -> Array:
        """Return the most that each tendon's drive moves in a second, shape (t,), SI; inf: no limit."""
        unit = TO_SI[scale_of(robot)]
        slowness = np.abs(in_si(robot, _servo_names(robot), values)) / unit  # s a mm, or s a N
        with np.errstate(divide="ignore"):
            return np.asarray(unit / slowness)


_BEFORE, _BEHIND = Late("lag_s", "delay_s"), Late("output_lag_s", "output_delay_s")
EFFECT = Effect(
    name="rate",
    summary="inputs, or what is observed but for tensions, come late by a lag or a delay, all alike. Or a "
    "drive has a top speed, or the material resists a rate of strain",
    trace="a loop whose width grows with the speed, and which closes where the input is held",
    bench="Step one input and record as fast as the tracker can. How long until the tip moves, and "
    "until it rests? Check that inputs and tracker share one clock.",
    forms=(
        _form("input_lag", "lag_s * dy/dt = u - y", "lag_s", _BEFORE),
        _form("input_delay", "y(t) = u(t - delay_s)", "delay_s", _BEFORE),
        Form(
            name="viscous",
            equation="stress = E * (strain + (T + damping_time_s) * strain rate), T as specified "
            "(Kelvin and Voigt)",
            stage=Stage.SPECIFICATION,
            parameters=_damping,
            specify=_damped,
            in_motion=True,
        ),
        Form(
            name="servo",
            equation="y follows u, |dy/dt| at most 1 / (servo + servo_<channel>): a drive at its top speed",
            stage=Stage.COMMAND,
            parameters=_servo,
            groups=lambda robot: common_then_each(robot, *_servo_names(robot)),
            memory=_TopSpeed(),
            further=True,
        ),
        _form("output_lag", "output_lag_s * dy/dt = x - y", "output_lag_s", _BEHIND),
        _form("output_delay", "y(t) = x(t - output_delay_s)", "output_delay_s", _BEHIND),
    ),
    advice={
        frozenset({"backlash", "tendon_friction"}): "Play the same loops at half and at twice the speed, and "
        "hold still in the middle of each way. The loop of a lag changes its width with the speed and closes "
        "in the hold. The others' loops do neither.",
    },
)
