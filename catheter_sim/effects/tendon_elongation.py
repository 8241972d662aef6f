"""Tendons stretch with tension, so that less of a displacement arrives."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, TypeVar

from catheter_sim.effects.axial_compression import in_series
from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.catheter import CatheterRobot, TendonPair
from catheter_sim.robots.catheter_layout import bent_by
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.rolling import RollingRobot
from catheter_sim.robots.specification import Tendon

_STIFFNESS = "stiffness_N_per_mm"
# Length of a catheter's bending tendons that stretches by Nayar 2023, Algorithm 1, permanent set included.
_CYCLIC = "cyclic_length_mm"
T = TypeVar("T", Tendon, TendonPair)


def _parameters(robot: Robot) -> tuple[Parameter, ...]:
    if robot.actuation == "tension" or isinstance(robot, RollingRobot):
        return ()  # a tension arrives whatever the tendon's length
    stiffness = Parameter(
        _STIFFNESS, null=math.inf, lower=0.5, upper=math.inf, scale=0.02, start=30.0, inverse=True
    )
    if not isinstance(robot, CatheterRobot):
        return (stiffness,)
    return stiffness, Parameter(_CYCLIC, null=0.0, lower=0.0, upper=5000.0, scale=20.0, start=100.0)


def _variants(robot: Robot) -> tuple[tuple[str, ...], ...]:
    return ((_STIFFNESS,),)  # the cyclic law is one tendon's, measured; it is set, not fitted


def _change_robot(robot: Robot, values: Values) -> Robot:
    assert not isinstance(robot, RollingRobot)
    added = values[_STIFFNESS] * 1e3

    def longer(tendon: T) -> T:
        return replace(tendon, stiffness_N_per_m=in_series(tendon.stiffness_N_per_m, added))

    if isinstance(robot, CatheterRobot):  # its torsion joints need no tension
        bending = bent_by(robot)
        pairs = [longer(pair) if pair.name in bending else pair for pair in robot.tendons]
        if values[_CYCLIC] > 0.0:
            own: dict[str, Any] = {"law": "uhmwpe", "length_m": values[_CYCLIC] * 1e-3}
            pairs = [replace(pair, **own) if pair.name in bending else pair for pair in pairs]
        return replace(robot, tendons=tuple(pairs))
    return replace(robot, tendons=tuple(longer(tendon) for tendon in robot.tendons))


EFFECT = Effect(
    name="tendon_elongation",
    summary="tendons stretch with tension, in series with the specified stiffness",
    trace="too little bending, in proportion to the tension, alike in all directions",
    parameters=_parameters,
    change_robot=_change_robot,
    variants=_variants,
)
