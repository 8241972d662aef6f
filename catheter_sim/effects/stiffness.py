"""The elastic constant differs from the specification; the law keeps its form."""

from __future__ import annotations

from catheter_sim.core.document import number, with_values
from catheter_sim.core.effect import Effect, Form, Parameter, Role, Stage, Values
from catheter_sim.core.robot import R, RobotSpec
from catheter_sim.core.variation import ALONG_ROWS
from catheter_sim.effects.shared import places

_SCALE = "scale"
_LIKELY = (0.4, 2.5)  # assumed: a material's modulus is known to a third, a thickness to a quarter, cubed


def _parameters(robot: RobotSpec) -> tuple[Parameter, ...]:
    if not places(robot, Role.ELASTIC_SCALE):
        return ()
    return (Parameter(_SCALE, null=1.0, lower=0.1, upper=10.0, scale=0.05, start=1.0, likely=_LIKELY),)


def _sections(robot: RobotSpec) -> tuple[Parameter, ...]:
    names = [item.parameter for item in places(robot, Role.ELASTIC_CONSTANT) if item.parameter]
    if len(names) < 2 or not places(robot, Role.ELASTIC_SCALE):
        return ()
    return tuple(
        Parameter(name, 1.0, lower=0.1, upper=10.0, scale=0.05, start=1.0, likely=_LIKELY) for name in names
    )


def _section_scaled(robot: R, values: Values) -> R:
    found = {
        item.key: values[item.parameter]
        for item in places(robot, Role.ELASTIC_CONSTANT)
        if item.parameter in values
    }
    return with_values(robot, {key: number(robot, key) * factor for key, factor in found.items()})


def _each(robot: RobotSpec) -> tuple[tuple[str, ...], ...]:
    names = tuple(item.name for item in _sections(robot))
    return (*((name,) for name in names), names) if names else ()


def _scaled(robot: R, values: Values) -> R:
    if _SCALE not in values:
        return robot
    keys = [item.key for item in places(robot, Role.ELASTIC_SCALE)]
    return with_values(robot, {key: number(robot, key) * values[_SCALE] for key in keys})


EFFECT = Effect(
    name="stiffness",
    summary="every elastic constant is `scale` times the specified one, or those of a section are",
    trace="too little or too much bending under tension or load, in proportion, in every direction",
    bench="With slack tendons, hang a known weight on the tip and measure how far it sinks. Compare "
    "the material, diameter and wall of each bending part with the robot's file.",
    varies=tuple(along for along in ALONG_ROWS if along != "level"),  # with the bending it is nonlinear
    forms=(
        Form(
            name="scale",
            equation="moment = scale * EI * k, k the bend per length",
            stage=Stage.SPECIFICATION,
            parameters=_parameters,
            specify=_scaled,
            local=True,
        ),
        Form(
            name="section",
            equation="moment = scale_<section> * EI * k in one section, k the bend per length",
            stage=Stage.SPECIFICATION,
            parameters=_sections,
            groups=_each,
            specify=_section_scaled,
            further=True,
        ),
    ),
    same_as=frozenset({Role.ELASTIC_SCALE, Role.ELASTIC_CONSTANT}),
    advice={
        frozenset({"actuation_gain", "nonlinear_stiffness"}): "Hang a known weight on the tip at rest: its "
        "sag depends on the stiffness, not on the inputs' scale.",
    },
)
