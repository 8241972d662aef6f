"""The response creeps within a trial: the inputs' zero wanders, or what is held bends on.

A zero that wanders: each channel's zero moves at a constant rate from the trial's own start (a slipping
clamp, a warming sensor). Creep: under a held input the robot comes on by a share of it with a time
constant, as a spring in series with a Kelvin-Voigt element. Below zero it gives back (a tendon that
creeps). What the zero has wandered creeps too. A response that creeps: what is seen goes on in the same way
(a sheath or a glue that gives way slowly), whatever its inputs do to it at once.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.effect import Effect, Form, Parameter, Stage, Timing, Values
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects.shared import (
    common_and_each,
    common_then_each,
    in_si,
    per_tendon,
    scale_of,
    shift_parameters,
    shifted,
    sized_parameter,
)
from catheter_sim.mechanics.hysteresis import Past, lagged, late_step

_CREEP = ("creep", "creep_time_s")
_RESPONSE = ("response_creep", "response_creep_time_s")
_FADE, _FADE_OF, _SHIFT = "fade", "fade_{}", "shift"
_CREEP_TIME_S = 60.0  # unless it is given
# Bound, and a change that matters: in mm, or in tensions that bend the robot by a radian, a minute.
_SIZE = {"N": (50.0, 0.1), "mm": (20.0, 0.1)}
_LOG_SIZE = {"N": (20.0, 0.05), "mm": (5.0, 0.05)}  # the same, for each factor of e in time


def _names(robot: RobotSpec) -> tuple[str, str]:
    unit = scale_of(robot)
    return f"zero_{unit}_per_min", f"zero_{{}}_{unit}_per_min"


def _zeros(robot: RobotSpec) -> tuple[Parameter, ...]:
    common, each = _names(robot)
    return common_and_each(robot, sized_parameter(robot, common, _SIZE), each)


def _creep(names: tuple[str, str]) -> tuple[Parameter, ...]:
    amount, time_s = names
    return (
        Parameter(amount, null=0.0, lower=-0.9, upper=1.0, scale=0.02, start=0.05),
        # Faster than 10 s it would be a lag (`rate`), beyond a quarter of an hour no trial shows its end.
        Parameter(
            time_s,
            null=_CREEP_TIME_S,
            lower=10.0,
            upper=900.0,
            scale=5.0,
            start=_CREEP_TIME_S,
            of_shape=True,
        ),
    )


@dataclass(frozen=True)
class _Drifting:
    """How far a zero has wandered, and what creeps.

    Attributes:
        rate: of each tendon's zero, shape (t,), SI a minute.
        amount: share by which a held input grows.
        elapsed_s: since the first row.
        past: what creeps, as a lag.
    """

    rate: Array
    amount: float
    elapsed_s: float
    past: Past


@dataclass(frozen=True)
class _Drift:
    """A wandering zero and creep as one memory of the inputs."""

    timed = True

    def start(self, robot: RobotSpec, values: Values, rest: Array) -> _Drifting | None:
        """Return the state at rest; None without drift."""
        rate, (amount, constant_s) = _rate(robot, values), _creeping(values)
        if amount == 0.0 and not rate.any():
            return None
        return _Drifting(rate, amount, 0.0, Past(constant_s, 0.0, rest))

    def step(self, state: _Drifting, before: Array, after: Array, dt_s: float) -> tuple[_Drifting, Array]:
        """Return the state and what arrives when the inputs have moved from `before` to `after`."""
        elapsed_s = state.elapsed_s + dt_s
        wandered = state.rate * (elapsed_s / 60.0)
        first = before + state.rate * (state.elapsed_s / 60.0)
        past, crept = late_step(state.past, first, after + wandered, dt_s)
        return replace(state, elapsed_s=elapsed_s, past=past), after + (wandered + state.amount * crept)

    def series(self, robot: RobotSpec, values: Values, rest: Array, time_s: Array, rows: Array) -> Array:
        """Return what arrives at each row, same shape as `rows` (r, t), from rest."""
        rate, (amount, constant_s) = _rate(robot, values), _creeping(values)
        wandered = rate * (time_s[:, np.newaxis] / 60.0)
        if amount != 0.0:
            wandered = wandered + amount * lagged(time_s, rows + wandered, constant_s, rest=rest)
        return rows + wandered


def _rate(robot: RobotSpec, values: Values) -> Array:
    return in_si(robot, _names(robot), values)


def _creeping(values: Values) -> tuple[float, float]:
    return values.get(_CREEP[0], 0.0), values.get(_CREEP[1], _CREEP_TIME_S)


def _timed(values: Values) -> Timing:
    amount, constant_s = _creeping(values)
    return Timing(creep=amount, creep_time_s=constant_s)


@dataclass(frozen=True)
class _Following:
    """What comes on after what is seen.

    Attributes:
        amount: share by which it grows.
        first: what was seen at first, where it has been for long.
        past: what creeps, as a lag.
    """

    amount: float
    first: Array
    past: Past


@dataclass(frozen=True)
class _Response:
    """Creep of what is seen, as a memory."""

    timed = True

    def start(self, robot: RobotSpec, values: Values, rest: Array) -> _Following | None:
        """Return the state at rest; None without creep."""
        amount, constant_s = values.get(_RESPONSE[0], 0.0), values.get(_RESPONSE[1], _CREEP_TIME_S)
        return _Following(amount, rest, Past(constant_s, 0.0, rest)) if amount != 0.0 else None

    def step(self, state: _Following, before: Array, after: Array, dt_s: float) -> tuple[_Following, Array]:
        """Return the state and what is seen when the robot has moved from `before` to `after`."""
        past, crept = late_step(state.past, before, after, dt_s)
        return replace(state, past=past), after + state.amount * (crept - state.first)

    def series(self, robot: RobotSpec, values: Values, rest: Array, time_s: Array, rows: Array) -> Array:
        """Return what is seen at each row, same shape as `rows`, from rest."""
        constant_s = values.get(_RESPONSE[1], _CREEP_TIME_S)
        crept = lagged(time_s, rows, constant_s, rest=rest)
        return rows + values.get(_RESPONSE[0], 0.0) * (crept - rest)


def _log_names(robot: RobotSpec) -> tuple[str, str]:
    return f"log_zero_{scale_of(robot)}", "log_time_s"


def _log_zero(robot: RobotSpec) -> tuple[Parameter, ...]:
    amount, time_s = _log_names(robot)
    usual = _CREEP_TIME_S
    return (
        sized_parameter(robot, amount, _LOG_SIZE),
        Parameter(time_s, usual, 1.0, 900.0, scale=0.2 * usual, start=usual, of_shape=True),
    )


@dataclass(frozen=True)
class _Settling:
    """How far zeros creep a factor of e in time, (t,), SI; their time [s], and since when [s]."""

    amount: Array
    time_s: float
    elapsed_s: float


@dataclass(frozen=True)
class _LogZero:
    """Zeros that creep with the logarithm of time."""

    timed = True

    def start(self, robot: RobotSpec, values: Values, rest: Array) -> _Settling | None:
        """Return the state at rest; None where no zero creeps."""
        amount = in_si(robot, (_log_names(robot)[0], ""), values)
        return _Settling(amount, values.get("log_time_s", _CREEP_TIME_S), 0.0) if amount.any() else None

    def step(self, state: _Settling, before: Array, after: Array, dt_s: float) -> tuple[_Settling, Array]:
        """Return the state and what arrives when the inputs have moved from `before` to `after`."""
        now = replace(state, elapsed_s=state.elapsed_s + dt_s)
        return now, after + state.amount * math.log1p(now.elapsed_s / state.time_s)

    def series(self, robot: RobotSpec, values: Values, rest: Array, time_s: Array, rows: Array) -> Array:
        """Return what arrives at each row, same shape as `rows` (r, t), from rest."""
        state = self.start(robot, values, rest)
        return rows if state is None else rows + state.amount * np.log1p(time_s / state.time_s)[:, np.newaxis]


def _fades(robot: RobotSpec) -> tuple[Parameter, ...]:
    fade = Parameter(_FADE, null=0.0, lower=-0.9, upper=2.0, scale=0.03, start=0.0)
    return common_and_each(robot, fade, _FADE_OF)


def _faded(robot: RobotSpec, inputs: Inputs, values: Values) -> Inputs:
    fade = values.get(_FADE, 0.0) + per_tendon(robot, _FADE_OF, values, 0.0)
    return replace(inputs, tendon=inputs.tendon * (1.0 + fade))


def _fewest_first(robot: RobotSpec, forms: tuple[Form, ...]) -> Iterable[Form]:
    """Return the zero of a single channel before creep, and those of several after it."""
    zero, *creeps = (form for form in forms if not form.only_varies)
    return (zero, *creeps) if len(zero.freed(robot)[0]) == 1 else (*creeps, zero)


_MEMORY = _Drift()
EFFECT = Effect(
    name="drift",
    summary="the inputs' zero wanders by zero + zero_<channel> a minute, or jumps by `shift`, or inputs "
    "fade by `fade`. What arrives (`creep`) or is observed (`response_creep`) may grow slowly under a held "
    "input",
    trace="an error that grows with the time in the trial, also where the same input returns or is held",
    bench="Hold one input for ten minutes, return to zero and wait as long. What keeps moving? Check "
    "temperature, slipping clamps and creeping polymers.",
    varies=(),
    forms=(
        Form(
            name="zero",
            equation="u' = u + zero * t, t from the trial's start",
            stage=Stage.COMMAND,
            parameters=_zeros,
            # One rate for several channels would be a pair's both sides, or joints of several kinds, at once.
            groups=lambda robot: common_then_each(robot, *_names(robot))[-1:],
            memory=_MEMORY,
        ),
        Form(
            name="creep",
            equation="u' = u + creep * y with T dy/dt = u - y: a spring in series with a Kelvin-Voigt "
            "element",
            stage=Stage.COMMAND,
            parameters=lambda robot: _creep(_CREEP),
            memory=_MEMORY,
            timing=_timed,
        ),
        Form(
            name="response",
            equation="x' = x + response_creep * y with T dy/dt = (x - x_first) - y, x as observed",
            stage=Stage.OBSERVATION,
            parameters=lambda robot: _creep(_RESPONSE),
            memory=_Response(),
            in_place=True,
        ),
        Form(
            name="logarithmic",
            equation="u' = u + log_zero * ln(1 + t / log_time), t from the trial's start: a clamp, a glue or "
            "a tendon's end that settles",
            stage=Stage.COMMAND,
            parameters=_log_zero,
            memory=_LogZero(),
            further=True,
        ),
        Form(
            name="fading",
            equation="u' = (1 + fade + fade_<channel>) * u, the fade a function of time: a response that "
            "grows or fades",
            stage=Stage.COMMAND,
            parameters=_fades,
            command=_faded,
            only_varies=True,
            varies=("time",),
        ),
        Form(
            name="jumping",
            equation="u' = u + shift + shift_<channel>, the shift a function of time, or of how far or how "
            "often an input has gone: a zero that jumps or creeps",
            stage=Stage.COMMAND,
            parameters=lambda robot: shift_parameters(robot, _SHIFT, _SIZE),
            command=lambda robot, inputs, values: shifted(robot, inputs, _SHIFT, values),
            only_varies=True,
            varies=("time", "path", "turns"),
        ),
    ),
    advice={
        frozenset({"actuation_offset", "actuation_gain", "stiffness", "tendon_elongation"}): "Hold one input "
        "for several minutes, return to zero and wait as long: only drift keeps moving.",
    },
    # It begins anew with each trial; inside one its slow lines fit whatever else a model lacks.
    least_trials=2,
    in_turn=_fewest_first,
)
