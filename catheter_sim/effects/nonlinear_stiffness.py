"""The elastic law softens or stiffens with bending, as of superelastic NiTi."""

from __future__ import annotations

from dataclasses import replace

from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.specification import ContinuumRobot


def _parameters(robot: ContinuumRobot) -> tuple[Parameter, ...]:
    # At a bend of one radian over the shortest segment the moment changes by c3 / L^2.
    unit = min(segment.length_m for segment in robot.segments) ** 2 * 1e6
    return (
        Parameter("cubic_mm2", null=0.0, lower=-0.3 * unit, upper=5.0 * unit, scale=0.05 * unit, start=0.0),
    )


def _change_robot(robot: ContinuumRobot, values: Values) -> ContinuumRobot:
    added = values["cubic_mm2"] * 1e-6
    return replace(
        robot,
        segments=tuple(
            replace(segment, stiffness_cubic_m2=segment.stiffness_cubic_m2 + added)
            for segment in robot.segments
        ),
    )


EFFECT = Effect(
    name="nonlinear_stiffness",
    summary="moment EI (k + cubic k^3) of the curvature k, added to the specified law",
    trace="an error that grows faster than the bending, alike in all directions",
    parameters=_parameters,
    change_robot=_change_robot,
)
