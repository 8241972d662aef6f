"""Tendons stretch with tension, so that less of a displacement arrives."""

from __future__ import annotations

from dataclasses import replace

from catheter_sim.effects.axial_compression import in_series
from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.specification import ContinuumRobot


def _parameters(robot: Robot) -> tuple[Parameter, ...]:
    if robot.actuation == "tension" or not isinstance(robot, ContinuumRobot):
        return ()  # a tension arrives whatever the tendon's length
    return (
        Parameter(
            "stiffness_N_per_mm",
            null=float("inf"),
            lower=0.5,
            upper=float("inf"),
            scale=0.02,
            start=30.0,
            inverse=True,
        ),
    )


def _change_robot(robot: Robot, values: Values) -> Robot:
    assert isinstance(robot, ContinuumRobot)
    added = values["stiffness_N_per_mm"] * 1e3
    return replace(
        robot,
        tendons=tuple(
            replace(tendon, stiffness_N_per_m=in_series(tendon.stiffness_N_per_m, added))
            for tendon in robot.tendons
        ),
    )


EFFECT = Effect(
    name="tendon_elongation",
    summary="tendons stretch with tension, in series with the specified stiffness",
    trace="too little bending, in proportion to the tension, alike in all directions",
    parameters=_parameters,
    change_robot=_change_robot,
)
