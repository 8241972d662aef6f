"""The zero of the input channels is wrong, pretension included."""

from __future__ import annotations

from catheter_sim.effects._channels import (
    TO_SI,
    added,
    common_and_each,
    common_then_each,
    per_tendon,
    scale_of,
    sized_parameter,
)
from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.channels import Inputs
from catheter_sim.robots.kinds import Robot

# Bound, and a change that matters: in mm, or in tensions that bend the robot by a radian.
_SIZE = {"N": (100.0, 0.25), "mm": (5.0, 0.1)}


def _names(robot: Robot) -> tuple[str, str]:
    unit = scale_of(robot)
    return f"offset_{unit}", f"offset_{{}}_{unit}"


def _parameters(robot: Robot) -> tuple[Parameter, ...]:
    common, each = _names(robot)
    return common_and_each(robot, sized_parameter(robot, common, _SIZE), each)


def _change_inputs(robot: Robot, inputs: Inputs, values: Values) -> Inputs:
    common, each = _names(robot)
    return added(inputs, (values[common] + per_tendon(robot, each, values, 0.0)) * TO_SI[scale_of(robot)])


EFFECT = Effect(
    name="actuation_offset",
    summary="the input channels' zero is wrong: what arrives is input + offset + offset_<channel>",
    trace="an error that is there at zero input already, and does not depend on direction",
    parameters=_parameters,
    change_inputs=_change_inputs,
    variants=lambda robot: common_then_each(robot, *_names(robot)),
)
