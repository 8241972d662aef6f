"""Dead-band between actuator and robot: after a reversal the input moves and nothing follows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.effect import Effect, Form, Parameter, Role, Stage, Values
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects.shared import (
    TO_SI,
    actuation_unit,
    added_at,
    common_and_each,
    common_then_each,
    groups_at,
    in_si,
    places,
    scale_of,
)
from catheter_sim.mechanics.hysteresis import closing_play, closing_play_step, play, play_step

_THROUGH = "soft_through"
_SERVO_TIME, _SERVO_TIME_S = "servo_time_s", 20.0  # unless it is given
# Bound, and a change that matters: in mm, or in tensions that bend the robot by a radian.
_SIZE = {"N": (25.0, 0.1), "mm": (5.0, 0.1)}


def _names(robot: RobotSpec) -> tuple[str, str]:
    unit = scale_of(robot)
    return f"width_{unit}", f"width_{{}}_{unit}"


def _parameter(robot: RobotSpec, name: str) -> Parameter:
    bound, scale = (round(size * actuation_unit(robot), 9) for size in _SIZE[scale_of(robot)])
    return Parameter(name, null=0.0, lower=0.0, upper=bound, scale=scale, start=2.0 * scale)


def _widths(robot: RobotSpec) -> tuple[Parameter, ...]:
    common, each = _names(robot)
    if places(robot, Role.DRIVE_PLAY):  # each joint has a drive of its own kind
        return common_and_each(robot, _parameter(robot, common), each)
    return (_parameter(robot, common),)


def _width_groups(robot: RobotSpec) -> tuple[tuple[str, ...], ...]:
    common, each = _names(robot)
    return common_then_each(robot, common, each) if places(robot, Role.DRIVE_PLAY) else ((common,),)


def _uneven(robot: RobotSpec) -> tuple[Parameter, ...]:
    """Return a width for each channel of drives that are alike."""
    common, each = _names(robot)
    if places(robot, Role.DRIVE_PLAY):
        return ()
    return common_and_each(robot, _parameter(robot, common), each)[1:]


def _soft_names(robot: RobotSpec) -> tuple[str, str]:
    common, each = _names(robot)
    return f"soft_{common}", f"soft_{each}"


def _soft(robot: RobotSpec) -> tuple[Parameter, ...]:
    through = Parameter(_THROUGH, null=0.0, lower=0.0, upper=0.95, scale=0.05, start=0.3)
    return _parameter(robot, _soft_names(robot)[0]), through


def _slack(robot: RobotSpec) -> tuple[Parameter, ...]:
    names = dict.fromkeys(item.parameter for item in places(robot, Role.SLACK))
    return tuple(_parameter(robot, name) for name in names)


@dataclass(frozen=True)
class _Playing:
    """The whole dead-bands, and where the plays are, shape (t,) each, SI; the share that goes through."""

    width: Array
    now: Array
    through: float


@dataclass(frozen=True)
class _Play:
    """A play on each tendon's input, and beside it a spring that lets a share of the input through.

    Attributes:
        names: of the widths: the common one's, and of each channel's (with `{}`).
        through: name of the share; "": no spring.
    """

    names: Callable[[RobotSpec], tuple[str, str]]
    through: str = ""
    timed = False

    def start(self, robot: RobotSpec, values: Values, rest: Array) -> _Playing | None:
        """Return the state at rest, the plays centred; None without dead-band."""
        width = _widths_of(robot, self.names, values)
        return _Playing(width, rest, values.get(self.through, 0.0)) if width.any() else None

    def step(self, state: _Playing, before: Array, after: Array, dt_s: float) -> tuple[_Playing, Array]:
        """Return the state and what arrives when the inputs have moved from `before` to `after`."""
        now = play_step(state.now, after, state.width)
        return _Playing(state.width, now, state.through), now + state.through * (after - now)

    def series(self, robot: RobotSpec, values: Values, rest: Array, time_s: Array, rows: Array) -> Array:
        """Return what arrives at each row, same shape as `rows` (r, t), from rest."""
        now = play(rows, _widths_of(robot, self.names, values), rest)
        return now + values.get(self.through, 0.0) * (rows - now)


def _widths_of(robot: RobotSpec, names: Callable[[RobotSpec], tuple[str, str]], values: Values) -> Array:
    """Return the whole dead-band of each tendon, shape (t,), SI, whichever way its channel moves it."""
    return np.abs(in_si(robot, names(robot), values))


def _servo_names(robot: RobotSpec) -> tuple[str, str]:
    common, each = _names(robot)
    return f"servo_{common}", f"servo_{each}"


def _servo(robot: RobotSpec) -> tuple[Parameter, ...]:
    # Faster than a second no row shows the dead-band, slower than ten minutes it never closes.
    usual = _SERVO_TIME_S
    time_s = Parameter(_SERVO_TIME, usual, 1.0, 600.0, scale=0.1 * usual, start=usual, of_shape=True)
    return _parameter(robot, _servo_names(robot)[0]), time_s


@dataclass(frozen=True)
class _Closing:
    """The whole dead-bands, and where the drives are, shape (t,) each, SI; the time in which they close."""

    width: Array
    now: Array
    time_s: float


@dataclass(frozen=True)
class _Servo:
    """Drives that start only beyond a dead-band, and close what is left of it slowly."""

    timed = True

    def start(self, robot: RobotSpec, values: Values, rest: Array) -> _Closing | None:
        """Return the state at rest, on the command; None without dead-band."""
        width = _widths_of(robot, _servo_names, values)
        return _Closing(width, rest, values.get(_SERVO_TIME, _SERVO_TIME_S)) if width.any() else None

    def step(self, state: _Closing, before: Array, after: Array, dt_s: float) -> tuple[_Closing, Array]:
        """Return the state and what arrives when the inputs have moved from `before` to `after`."""
        now = closing_play_step(state.now, before, after, state.width, state.time_s, dt_s)
        return replace(state, now=now), now

    def series(self, robot: RobotSpec, values: Values, rest: Array, time_s: Array, rows: Array) -> Array:
        """Return what arrives at each row, same shape as `rows` (r, t), from rest."""
        width = _widths_of(robot, _servo_names, values)
        if not width.any():
            return rows
        return closing_play(time_s, rows, width, values.get(_SERVO_TIME, _SERVO_TIME_S), rest)


def _hole_names(robot: RobotSpec) -> tuple[str, str]:
    unit = scale_of(robot)
    return f"hole_width_{unit}", f"hole_range_{unit}"


def _in_hole(robot: RobotSpec) -> tuple[Parameter, ...]:
    width, beyond = _hole_names(robot)
    usual = actuation_unit(robot)
    return (
        _parameter(robot, width),
        Parameter(beyond, usual, 0.1 * usual, 10.0 * usual, scale=0.1 * usual, start=usual, of_shape=True),
    )


def _across_holes(robot: RobotSpec, inputs: Inputs, values: Values) -> Inputs:
    width, beyond = _hole_names(robot)
    unit, usual = TO_SI[scale_of(robot)], actuation_unit(robot)
    half = 0.5 * values.get(width, 0.0) * unit
    if half <= 0.0:
        return inputs
    over = max(values.get(beyond, usual) * unit, half)  # nothing bends back as it is pulled
    return replace(inputs, tendon=inputs.tendon - half * np.tanh(inputs.tendon / over))


_PLAY = _Play(_names)
EFFECT = Effect(
    name="backlash",
    summary="dead-band between each actuator and its tendon. Whole widths, of all and of each, add up. "
    "Of a soft one `soft_through` of the input goes on at once",
    trace="a loop of constant width in the input, and a standstill after each reversal",
    bench="Hold the tip still and turn each actuator gently to and fro. The dead-band is how far it "
    "goes before the tendon pulls. Look at knots, clamps, couplings and gears.",
    varies=("time", "level", "path", "largest", "turns"),  # of each side: another form
    forms=(
        Form(
            name="play",
            equation="y = clip(y before, u - width / 2, u + width / 2) (Krasnosel'skii's play operator)",
            stage=Stage.COMMAND,
            parameters=_widths,
            groups=_width_groups,
            memory=_PLAY,
        ),
        Form(
            name="uneven",
            equation="y = clip(y before, u - width_<channel> / 2, u + width_<channel> / 2), a width for "
            "each channel",
            stage=Stage.COMMAND,
            parameters=_uneven,
            memory=_PLAY,
            further=True,
        ),
        Form(
            name="soft",
            equation="u' = soft_through * u + (1 - soft_through) * y, y the play's output: a spring "
            "across the dead-band",
            stage=Stage.COMMAND,
            parameters=_soft,
            memory=_Play(_soft_names, _THROUGH),
            further=True,
        ),
        Form(
            name="servo",
            equation="y = play(u, servo_width), and inside the dead-band T dy/dt = u - y: a drive's "
            "controller starts late and closes what is left slowly",
            stage=Stage.COMMAND,
            parameters=_servo,
            memory=_Servo(),
            further=True,
        ),
        Form(
            name="in_hole",
            equation="u' = u - hole_width / 2 * tanh(u / hole_range): a tendon goes across its hole before "
            "it lies on the other side; bending is soft about straight, without a loop",
            stage=Stage.COMMAND,
            parameters=_in_hole,
            command=_across_holes,
            further=True,
        ),
        Form(
            name="slack",
            equation="each tendon is too long by slack: a pair draws sign(u) * max(|u| - slack, 0); "
            "its elastic return leaves no loop",
            stage=Stage.SPECIFICATION,
            parameters=_slack,
            groups=lambda robot: groups_at(robot, Role.SLACK),
            specify=lambda robot, values: added_at(robot, Role.SLACK, values),
        ),
    ),
)
