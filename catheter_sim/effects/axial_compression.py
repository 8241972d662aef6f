"""The backbone or its mount gives way under the tendons' summed tension, so they all slacken."""

from __future__ import annotations

import math

from catheter_sim.core.effect import Effect, Form, Parameter, Role, Stage, Values
from catheter_sim.core.robot import R, RobotSpec
from catheter_sim.effects.shared import in_series_at, places

_STIFFNESS = "stiffness_N_per_mm"


def _parameters(robot: RobotSpec) -> tuple[Parameter, ...]:
    if not places(robot, Role.MOUNT):
        return ()
    return (
        Parameter(
            _STIFFNESS, null=math.inf, lower=0.5, upper=math.inf, scale=0.005, start=100.0, inverse=True
        ),
    )


def _given_way(robot: R, values: Values) -> R:
    if _STIFFNESS not in values:
        return robot
    return in_series_at(robot, Role.MOUNT, values[_STIFFNESS] * 1e3)


EFFECT = Effect(
    name="axial_compression",
    summary="backbone and mount give way along the axis, in series with the specified mount",
    trace="too little bending where several tendons pull together, and a tip that sinks with the sum",
    bench="Pull all tendons of a segment together. Watch base plate and backbone with a dial gauge: "
    "which of the two moves?",
    forms=(
        Form(
            name="mount",
            equation="the base sinks by the sum of the tensions / stiffness",
            stage=Stage.SPECIFICATION,
            parameters=_parameters,
            specify=_given_way,
        ),
    ),
    same_as=frozenset({Role.MOUNT}),
    advice={
        frozenset({"tendon_elongation", "stiffness"}): "Measure the tendons' tensions and the shift of the "
        "base: they say which part gives way.",
    },
)
