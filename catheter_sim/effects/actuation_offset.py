"""The zero of the input channels is wrong, pretension included."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from catheter_sim.effects._channels import TO_SI, common_and_each, common_then_each, per_tendon, scale_of
from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.channels import Inputs
from catheter_sim.robots.specification import ContinuumRobot

_SIZE = {"N": (20.0, 0.05), "mm": (5.0, 0.1)}  # bound, and a change that matters


def _names(robot: ContinuumRobot) -> tuple[str, str]:
    unit = scale_of(robot)
    return f"offset_{unit}", f"offset_{{}}_{unit}"


def _parameter(robot: ContinuumRobot, name: str) -> Parameter:
    bound, scale = _SIZE[scale_of(robot)]
    return Parameter(name, null=0.0, lower=-bound, upper=bound, scale=scale, start=0.0)


def _change_inputs(robot: ContinuumRobot, inputs: Inputs, values: Values) -> Inputs:
    common, each = _names(robot)
    offset = (values[common] + per_tendon(robot, each, values, 0.0)) * TO_SI[scale_of(robot)]
    tendon = inputs.tendon + offset
    if inputs.actuation == "tension":
        tendon = np.maximum(tendon, 0.0)  # a tendon cannot push
    return replace(inputs, tendon=tendon)


EFFECT = Effect(
    name="actuation_offset",
    summary="the input channels' zero is wrong: what arrives is input + offset + offset_<channel>",
    trace="an error that is there at zero input already, and does not depend on direction",
    parameters=lambda robot: common_and_each(robot, *_names(robot), lambda name: _parameter(robot, name)),
    change_inputs=_change_inputs,
    variants=lambda robot: common_then_each(robot, *_names(robot)),
)
