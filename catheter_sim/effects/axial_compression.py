"""The backbone or its mount gives way under the tendons' summed tension, so they all slacken."""

from __future__ import annotations

from dataclasses import replace

from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.specification import Mount


def in_series(first_N_per_m: float, second_N_per_m: float) -> float:
    """Return the stiffness of two springs in series; infinite ones give nothing way."""
    compliance = 1.0 / first_N_per_m + 1.0 / second_N_per_m
    return 1.0 / compliance if compliance > 0.0 else float("inf")


def _parameters(robot: Robot) -> tuple[Parameter, ...]:
    if isinstance(robot, CatheterRobot):
        return ()  # its routing is not modelled
    return (
        Parameter(
            "stiffness_N_per_mm",
            null=float("inf"),
            lower=0.5,
            upper=float("inf"),
            scale=0.005,
            start=100.0,
            inverse=True,
        ),
    )


def _change_robot(robot: Robot, values: Values) -> Robot:
    added = values["stiffness_N_per_mm"] * 1e3
    return replace(
        robot, mount=Mount(axial_stiffness_N_per_m=in_series(robot.mount.axial_stiffness_N_per_m, added))
    )


EFFECT = Effect(
    name="axial_compression",
    summary="backbone and mount give way along the axis, in series with the specified mount",
    trace="too little bending where several tendons pull together, and a tip that sinks with the sum",
    parameters=_parameters,
    change_robot=_change_robot,
)
