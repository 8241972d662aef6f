"""The scale of the input channels is wrong: a sensor's calibration, a pulley's radius."""

from __future__ import annotations

from dataclasses import replace

from catheter_sim.effects._channels import common_and_each, common_then_each, per_tendon
from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.channels import Inputs
from catheter_sim.robots.kinds import Robot

_COMMON = "scale"
_EACH = "scale_{}"


def _parameter(name: str) -> Parameter:
    return Parameter(name, null=1.0, lower=0.5, upper=2.0, scale=0.03, start=1.0)


def _change_inputs(robot: Robot, inputs: Inputs, values: Values) -> Inputs:
    gain = values[_COMMON] * per_tendon(robot, _EACH, values, 1.0)
    return replace(inputs, tendon=inputs.tendon * gain)


EFFECT = Effect(
    name="actuation_gain",
    summary="the input channels' scale is wrong: what arrives is scale * scale_<channel> * input",
    trace="an error in proportion to the input, the same on the way out and back",
    parameters=lambda robot: common_and_each(robot, _parameter(_COMMON), _EACH),
    change_inputs=_change_inputs,
    variants=lambda robot: common_then_each(robot, _COMMON, _EACH),
)
