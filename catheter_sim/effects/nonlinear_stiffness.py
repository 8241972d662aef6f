"""The elastic law softens or stiffens with bending, as of superelastic NiTi."""

from __future__ import annotations

from catheter_sim.core.effect import Effect, Form, Parameter, Role, Stage, Values
from catheter_sim.core.robot import R, RobotSpec
from catheter_sim.effects._places import added_everywhere, places, sizes

_CUBIC = "cubic_mm2"


def _parameters(robot: RobotSpec) -> tuple[Parameter, ...]:
    if not places(robot, Role.CUBIC):
        return ()
    unit = 1e6 / sizes(robot).curvature_per_m ** 2  # the moment doubles there
    return (Parameter(_CUBIC, null=0.0, lower=-0.3 * unit, upper=5.0 * unit, scale=0.05 * unit, start=0.0),)


def _stiffened(robot: R, values: Values) -> R:
    return added_everywhere(robot, Role.CUBIC, values[_CUBIC]) if _CUBIC in values else robot


EFFECT = Effect(
    name="nonlinear_stiffness",
    summary="moment EI (k + cubic k^3) of the bend per length k, added to the specified law",
    trace="an error that grows faster than the bending, alike in all directions",
    bench="With slack tendons, bend the robot at its tip with a spring scale to small and to large "
    "angles: does the force stay in proportion?",
    forms=(
        Form(
            name="cubic",
            equation="moment EI (k + cubic k^3) of the bend per length k",
            stage=Stage.SPECIFICATION,
            parameters=_parameters,
            specify=_stiffened,
        ),
    ),
    same_as=frozenset({Role.CUBIC}),
)
