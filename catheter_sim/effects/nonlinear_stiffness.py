"""The elastic law softens or stiffens with bending, as of superelastic NiTi."""

from __future__ import annotations

from catheter_sim.core.effect import Effect, Form, Parameter, Role, Stage, Values
from catheter_sim.core.robot import R, RobotSpec
from catheter_sim.effects.shared import added_everywhere, places, sizes

_CUBIC, _QUINTIC = "cubic_mm2", "quintic_mm4"


def _parameters(robot: RobotSpec) -> tuple[Parameter, ...]:
    if not places(robot, Role.CUBIC):
        return ()
    unit = 1e6 / sizes(robot).curvature_per_m ** 2  # the moment doubles there
    # It doubles at a sixth of that curvature already, as at the quintic term's bound.
    return (Parameter(_CUBIC, null=0.0, lower=-0.3 * unit, upper=30.0 * unit, scale=0.05 * unit, start=0.0),)


def _with_quintic(robot: RobotSpec) -> tuple[Parameter, ...]:
    if not places(robot, Role.QUINTIC):
        return ()
    unit = 1e12 / sizes(robot).curvature_per_m ** 4  # the moment doubles there
    # A robot that bends less than it is made for has the same share of its moment by a far larger number.
    return (Parameter(_QUINTIC, 0.0, lower=-2.0 * unit, upper=1000.0 * unit, scale=0.05 * unit, start=0.0),)


def _bent_on(robot: R, values: Values) -> R:
    return added_everywhere(robot, Role.QUINTIC, values[_QUINTIC]) if _QUINTIC in values else robot


def _stiffened(robot: R, values: Values) -> R:
    return added_everywhere(robot, Role.CUBIC, values[_CUBIC]) if _CUBIC in values else robot


EFFECT = Effect(
    name="nonlinear_stiffness",
    summary="moment EI * (k + cubic * k^3 + quintic * k^5) of the bend per length k, added to the "
    "specified law",
    trace="an error that grows faster than the bending, alike in all directions",
    bench="With slack tendons, bend the robot at its tip with a spring scale, first a little, then "
    "far. Does the force stay in proportion?",
    varies=("time", "sign", "direction"),
    forms=(
        Form(
            name="cubic",
            equation="moment = EI * (k + cubic * k^3), k the bend per length",
            stage=Stage.SPECIFICATION,
            parameters=_parameters,
            specify=_stiffened,
            local=True,
        ),
        Form(
            name="quintic",
            equation="moment = EI * (k + cubic * k^3 + quintic * k^5): it may soften and stiffen again, "
            "a plateau",
            stage=Stage.SPECIFICATION,
            parameters=_with_quintic,
            # Alone, or beside the cubic term.
            groups=lambda robot: ((_QUINTIC,), (_CUBIC, _QUINTIC)) if _with_quintic(robot) else (),
            specify=_bent_on,
            # Two more powers of the bend fit whatever a model lacks a little: only where the third one pays.
            in_place=True,
        ),
    ),
    same_as=frozenset({Role.CUBIC, Role.QUINTIC}),
)
