"""The scale of the input channels is wrong: a sensor's calibration, a pulley's radius."""

from __future__ import annotations

from dataclasses import replace

from catheter_sim.core.effect import Effect, Form, Parameter, Stage, Values
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects._channels import common_and_each, common_then_each, per_tendon

_COMMON = "scale"
_EACH = "scale_{}"


def _parameter(name: str) -> Parameter:
    return Parameter(name, null=1.0, lower=0.5, upper=2.0, scale=0.03, start=1.0)


def _scaled(robot: RobotSpec, inputs: Inputs, values: Values) -> Inputs:
    gain = values.get(_COMMON, 1.0) * per_tendon(robot, _EACH, values, 1.0)
    return replace(inputs, tendon=inputs.tendon * gain)


EFFECT = Effect(
    name="actuation_gain",
    summary="the input channels' scale is wrong: what arrives is scale * scale_<channel> * input",
    trace="an error in proportion to the input, the same on the way out and back",
    bench="Command known steps, and measure at the tendon, with a ruler or a second force gauge, what"
    " arrives; compare spools, gears and the sensor's calibration with the robot's file.",
    forms=(
        Form(
            name="scale",
            equation="u' = scale scale_<channel> u",
            stage=Stage.COMMAND,
            parameters=lambda robot: common_and_each(robot, _parameter(_COMMON), _EACH),
            groups=lambda robot: common_then_each(robot, _COMMON, _EACH),
            command=_scaled,
        ),
    ),
    advice={
        frozenset({"coupling", "actuation_offset", "measurement_frame", "twist"}): "Drive each section or "
        "joint alone while the others stand at zero, and then against a pretension of the others: only "
        "coupling moves them.",
    },
)
