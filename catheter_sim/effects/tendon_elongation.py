"""Tendons stretch with tension, so that less of a displacement arrives."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.document import si_of, with_values
from catheter_sim.core.effect import Effect, Form, Parameter, Role, Stage, Values
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import R, RobotSpec
from catheter_sim.effects.shared import TO_SI, actuation_unit, in_series_at, places, scale_of
from catheter_sim.mechanics.hysteresis import Past, lagged, late_step

_STIFFNESS = "stiffness_N_per_mm"
_CYCLIC = "cyclic_length_mm"
_SET = "set_share"
_CREEP, _CREEP_TIME_S, _ELEMENTS = ("creep_share", "creep_time_s"), 10.0, 4


def _spring(robot: RobotSpec) -> tuple[Parameter, ...]:
    if not places(robot, Role.TENDON_STIFFNESS):
        return ()
    return (
        Parameter(_STIFFNESS, null=math.inf, lower=0.5, upper=math.inf, scale=0.02, start=30.0, inverse=True),
    )


def _softened(robot: R, values: Values) -> R:
    if _STIFFNESS not in values:
        return robot
    return in_series_at(robot, Role.TENDON_STIFFNESS, values[_STIFFNESS] * 1e3)


def _cyclic(robot: RobotSpec) -> tuple[Parameter, ...]:
    if not places(robot, Role.TENDON_LENGTH):
        return ()
    return (Parameter(_CYCLIC, null=0.0, lower=0.0, upper=5000.0, scale=20.0, start=100.0),)


def _stretched(robot: R, values: Values) -> R:
    length_mm = values.get(_CYCLIC, 0.0)
    if length_mm <= 0.0:
        return robot
    changes: dict[str, float | str] = {}
    for item in places(robot, Role.TENDON_LENGTH):
        changes |= {item.key: si_of(robot, item.key, length_mm), **item.along}
    return with_values(robot, changes)


def _set(robot: RobotSpec) -> tuple[Parameter, ...]:
    if not places(robot, Role.TENDON_STIFFNESS):
        return ()
    # Off zero a fit sees which way it goes.
    return (Parameter(_SET, null=0.0, lower=0.0, upper=0.9, scale=0.01, start=0.02),)


@dataclass(frozen=True)
class _Pulled:
    """By how much each tendon has been pulled at most, either way of a pair, shape (t,) each [m].

    Attributes:
        share: of it that stays.
        pairs: which of them are antagonistic pairs, whose other tendon pulls below zero.
        most, least: the largest and the smallest input so far.
    """

    share: float
    pairs: Array
    most: Array
    least: Array


@dataclass(frozen=True)
class _Lengthened:
    """Tendons that stay longer by a share of the most that they have been pulled."""

    timed = False

    def start(self, robot: RobotSpec, values: Values, rest: Array) -> _Pulled | None:
        """Return the state at rest, no tendon pulled yet; None without a permanent set."""
        share = values.get(_SET, 0.0)
        nothing = np.zeros_like(rest)
        return _Pulled(share, _pairs(robot), nothing, nothing) if share > 0.0 else None

    def step(self, state: _Pulled, before: Array, after: Array, dt_s: float) -> tuple[_Pulled, Array]:
        """Return the state and what arrives when the inputs have moved from `before` to `after`."""
        now = replace(state, most=np.maximum(state.most, after), least=np.minimum(state.least, after))
        return now, _arriving(after, state.share * now.most, state.share * now.least, state.pairs)

    def series(self, robot: RobotSpec, values: Values, rest: Array, time_s: Array, rows: Array) -> Array:
        """Return what arrives at each row, same shape as `rows` (r, t), from rest."""
        share = values.get(_SET, 0.0)
        most = np.maximum(np.maximum.accumulate(rows, axis=0), 0.0)
        least = np.minimum(np.minimum.accumulate(rows, axis=0), 0.0)
        return _arriving(rows, share * most, share * least, _pairs(robot))


def _creeping(robot: RobotSpec) -> tuple[Parameter, ...]:
    if not places(robot, Role.TENDON_STIFFNESS):
        return ()
    share, time_s = _CREEP
    return (
        Parameter(share, null=0.0, lower=0.0, upper=0.9, scale=0.01, start=0.02),
        Parameter(time_s, _CREEP_TIME_S, 1.0, 100.0, scale=2.0, start=_CREEP_TIME_S, of_shape=True),
    )


@dataclass(frozen=True)
class _Lengthening:
    """What creeps of each tendon's pull, forth and back of a pair.

    Attributes:
        share: of a pull that creeps in the end.
        pairs: as of `_Pulled`.
        elements: each as a lag of the pulls, shape (2, t) [m].
    """

    share: float
    pairs: Array
    elements: tuple[Past, ...]


@dataclass(frozen=True)
class _Creep:
    """Tendons that lengthen slowly under a pull and shorten slowly without it."""

    timed = True

    def start(self, robot: RobotSpec, values: Values, rest: Array) -> _Lengthening | None:
        """Return the state at rest, no tendon pulled yet; None without creep."""
        share = values.get(_CREEP[0], 0.0)
        nothing = np.zeros((2, len(rest)))
        elements = tuple(Past(time_s, 0.0, nothing) for time_s in _creep_times_s(values))
        return _Lengthening(share, _pairs(robot), elements) if share > 0.0 else None

    def step(
        self, state: _Lengthening, before: Array, after: Array, dt_s: float
    ) -> tuple[_Lengthening, Array]:
        """Return the state and what arrives when the inputs have moved from `before` to `after`."""
        pulls = _pulls(before), _pulls(after)
        steps = [late_step(item, *pulls, dt_s) for item in state.elements]
        forth, back = state.share * np.mean([crept for _, crept in steps], axis=0)
        now = replace(state, elements=tuple(item for item, _ in steps))
        return now, _arriving(after, forth, -back, state.pairs)

    def series(self, robot: RobotSpec, values: Values, rest: Array, time_s: Array, rows: Array) -> Array:
        """Return what arrives at each row, same shape as `rows` (r, t), from rest."""
        pulls = np.moveaxis(_pulls(rows), 0, 1)
        crept = np.mean([lagged(time_s, pulls, lag_s) for lag_s in _creep_times_s(values)], axis=0)
        forth, back = values.get(_CREEP[0], 0.0) * np.moveaxis(crept, 1, 0)
        return _arriving(rows, forth, -back, _pairs(robot))


def _creep_times_s(values: Values) -> list[float]:
    """Return the elements' time constants [s]."""
    return [values.get(_CREEP[1], _CREEP_TIME_S) * 4.0**k for k in range(_ELEMENTS)]


def _pulls(inputs: Array) -> Array:
    """Return how far each tendon is pulled, forth and back of a pair, shape (2, t)."""
    return np.stack([np.maximum(inputs, 0.0), np.maximum(-inputs, 0.0)])


def _pairs(robot: RobotSpec) -> Array:
    """Return which tendons are pairs, shape (t,): 1 for a bending joint's, 0 for a tendon alone.

    NaN for what else drives a joint: no tendon of it lengthens.
    """
    lengths = {item.key for item in places(robot, Role.TENDON_LENGTH)}
    if not lengths:
        return np.zeros(len(robot.tendons))
    return np.array(
        [1.0 if f"tendons.{item.name}.length_mm" in lengths else np.nan for item in robot.tendons]
    )


def _arriving(rows: Array, most: Array, least: Array, pairs: Array) -> Array:
    """Return what arrives of `rows`, shape (..., t), where tendons are longer by `most` and `-least`."""
    paired = np.maximum(rows - most, 0.0) + np.minimum(rows - least, 0.0)
    return np.where(np.isnan(pairs), rows, np.where(pairs > 0.0, paired, rows - most))


def _toe_names(robot: RobotSpec) -> tuple[str, str]:
    unit = scale_of(robot)
    return f"toe_{unit}", f"toe_range_{unit}"


def _toe(robot: RobotSpec) -> tuple[Parameter, ...]:
    if not places(robot, Role.TENDON_STIFFNESS):
        return ()
    (length, beyond), unit = _toe_names(robot), actuation_unit(robot)
    return (
        Parameter(length, null=0.0, lower=0.0, upper=5.0 * unit, scale=0.05 * unit, start=0.1 * unit),
        Parameter(beyond, unit, 0.1 * unit, 10.0 * unit, scale=0.1 * unit, start=unit, of_shape=True),
    )


def _bedding(robot: RobotSpec, inputs: Inputs, values: Values) -> Inputs:
    (length, beyond), unit = _toe_names(robot), TO_SI[scale_of(robot)]
    most, over = (
        values.get(name, usual) * unit for name, usual in ((length, 0.0), (beyond, actuation_unit(robot)))
    )
    lost = most * (1.0 - np.exp(-np.abs(inputs.tendon) / over))
    return replace(inputs, tendon=_arriving(inputs.tendon, lost, -lost, _pairs(robot)))


EFFECT = Effect(
    name="tendon_elongation",
    summary="tendons stretch with tension, in series with the specified stiffness, or stay longer by "
    "`set_share` of the most that they have been pulled",
    trace="too little bending, in proportion to the tension, alike in all directions",
    bench="Clamp the robot's end of a tendon, pull with known forces and measure its stretch. Let "
    "go, and check that it returns to its length.",
    forms=(
        Form(
            name="spring",
            equation="a tendon stretches by tension / stiffness, in addition to its specified stretch",
            stage=Stage.SPECIFICATION,
            parameters=_spring,
            specify=_softened,
        ),
        Form(
            name="set",
            equation="y = u - set_share * max(u so far), each tendon of a pair for itself",
            stage=Stage.COMMAND,
            parameters=_set,
            memory=_Lengthened(),
            further=True,
        ),
        Form(
            name="toe",
            equation="a pulled tendon is longer by toe * (1 - exp(-|u| / toe_range)): a braid that gives way "
            "at first; its tension is taken to grow with its input",
            stage=Stage.COMMAND,
            parameters=_toe,
            command=_bedding,
            further=True,
        ),
        Form(
            name="creep",
            equation="y = u - creep_share * x, x the mean of four elements T dx/dt = pull - x, T from "
            "creep_time on by factors of four: about the logarithm of time",
            stage=Stage.COMMAND,
            parameters=_creeping,
            memory=_Creep(),
            further=True,
        ),
        Form(
            name="cyclic",
            equation="a tendon stretches over its length by Nayar 2023, Algorithm 1, permanent set included",
            stage=Stage.SPECIFICATION,
            parameters=_cyclic,
            groups=lambda robot: (),  # it is one tendon's, measured
            specify=_stretched,
        ),
    ),
    same_as=frozenset({Role.TENDON_STIFFNESS, Role.DRIVE_STIFFNESS}),
    advice={
        frozenset({"axial_compression", "nonlinear_stiffness", "actuation_offset"}): "Pull a segment's "
        "tendons together, without bending: the tip sinks only where something gives way along the axis.",
    },
)
