"""Tendons stretch with tension, so that less of a displacement arrives."""

from __future__ import annotations

import math

from catheter_sim.core.effect import Effect, Form, Parameter, Role, Stage, Values
from catheter_sim.core.numbers import si_of, with_values
from catheter_sim.core.robot import R, RobotSpec
from catheter_sim.effects._places import in_series_at, places

_STIFFNESS = "stiffness_N_per_mm"
_CYCLIC = "cyclic_length_mm"


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


EFFECT = Effect(
    name="tendon_elongation",
    summary="tendons stretch with tension, in series with the specified stiffness",
    trace="too little bending, in proportion to the tension, alike in all directions",
    bench="Clamp the robot's end of a tendon, pull with known forces and measure how long it gets; "
    "let go, and see whether it comes back whole.",
    forms=(
        Form(
            name="spring",
            equation="a tendon stretches by tension / stiffness, beside what it does as specified",
            stage=Stage.SPECIFICATION,
            parameters=_spring,
            specify=_softened,
        ),
        Form(
            name="cyclic",
            equation="over its length a tendon stretches by Nayar 2023, Algorithm 1, permanent set included",
            stage=Stage.SPECIFICATION,
            parameters=_cyclic,
            groups=lambda robot: (),  # it is one tendon's, measured
            specify=_stretched,
        ),
    ),
    same_as=frozenset({Role.TENDON_STIFFNESS, Role.DRIVE_STIFFNESS}),
    advice={
        frozenset({"axial_compression", "nonlinear_stiffness", "actuation_offset"}): "Pull a segment's "
        "tendons together, without bending: only what gives way along the axis answers.",
    },
)
