"""The zero of the input channels is wrong, pretension included."""

from __future__ import annotations

from dataclasses import replace

from catheter_sim.core.effect import Effect, Form, Parameter, Stage, Values
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects.shared import common_and_each, common_then_each, in_si, scale_of, sized_parameter

# Bound, and a change that matters: in mm, or in tensions that bend the robot by a radian.
_SIZE = {"N": (100.0, 0.25), "mm": (5.0, 0.1)}


def _names(robot: RobotSpec) -> tuple[str, str]:
    unit = scale_of(robot)
    return f"offset_{unit}", f"offset_{{}}_{unit}"


def _parameters(robot: RobotSpec) -> tuple[Parameter, ...]:
    common, each = _names(robot)
    return common_and_each(robot, sized_parameter(robot, common, _SIZE), each)


def _shifted(robot: RobotSpec, inputs: Inputs, values: Values) -> Inputs:
    return replace(inputs, tendon=inputs.tendon + in_si(robot, _names(robot), values))


EFFECT = Effect(
    name="actuation_offset",
    summary="the input channels' zero is wrong: what arrives is input + offset + offset_<channel>",
    trace="an error that is there at zero input already, and does not depend on direction",
    bench="At zero command, measure every tendon's tension or position at the robot. Set zero and "
    "pretension again before each recording.",
    forms=(
        Form(
            name="zero",
            equation="u' = u + offset + offset_<channel>",
            stage=Stage.COMMAND,
            parameters=_parameters,
            groups=lambda robot: common_then_each(robot, *_names(robot)),
            command=_shifted,
            varies=(),  # with time it is drift, with direction or side backlash, with level gain
        ),
    ),
)
