"""The elastic law softens or stiffens with bending, as of superelastic NiTi."""

from __future__ import annotations

from catheter_sim.core.effect import Effect, Form, Parameter, Role, Stage, Values
from catheter_sim.core.robot import R, RobotSpec
from catheter_sim.core.variation import ALONG_ROWS
from catheter_sim.effects.shared import added_everywhere, places, sizes, with_values

_CUBIC, _QUINTIC = "cubic_mm2", "quintic_mm4"
_PLASTIC = ("plastic_share", "yield_per_m")


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


def _plastic(robot: RobotSpec) -> tuple[Parameter, ...]:
    if not places(robot, Role.PLASTIC_SHARE):
        return ()
    share, yielding = _PLASTIC
    usual = round(0.1 * sizes(robot).curvature_per_m, 6)
    return (
        Parameter(share, null=0.0, lower=0.0, upper=3.0, scale=0.05, start=0.2),
        Parameter(
            yielding,
            null=usual,
            lower=0.05 * usual,
            upper=10.0 * usual,
            scale=0.2 * usual,
            start=usual,
            of_shape=True,
        ),
    )


def _yielding(robot: R, values: Values) -> R:
    share, yielding = _PLASTIC
    if not values.get(share):
        return robot
    at = values.get(yielding, _plastic(robot)[1].null)
    stiffer = added_everywhere(robot, Role.PLASTIC_SHARE, values[share])
    return with_values(stiffer, {item.key: at for item in places(robot, Role.YIELD_CURVATURE)})


def _bent_on(robot: R, values: Values) -> R:
    return added_everywhere(robot, Role.QUINTIC, values[_QUINTIC]) if _QUINTIC in values else robot


def _stiffened(robot: R, values: Values) -> R:
    return added_everywhere(robot, Role.CUBIC, values[_CUBIC]) if _CUBIC in values else robot


EFFECT = Effect(
    name="nonlinear_stiffness",
    summary="moment EI * (k + cubic * k^3 + quintic * k^5) of the bend per length k, and what a part that "
    "yields carries, added to the specified law",
    trace="an error that grows faster than the bending, alike in all directions",
    bench="With slack tendons, bend the robot at its tip with a spring scale, first a little, then "
    "far. Does the force stay in proportion?",
    varies=tuple(along for along in ALONG_ROWS if along != "level"),  # with the bending it is another power
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
        Form(
            name="hysteretic",
            equation="moment + EI * plastic_share * e: e follows k as far as |e| = yield and slips from "
            "there on (Prandtl 1928)",
            stage=Stage.SPECIFICATION,
            parameters=_plastic,
            specify=_yielding,
            remembers=True,
            further=True,
        ),
    ),
    same_as=frozenset({Role.CUBIC, Role.QUINTIC}),
)
