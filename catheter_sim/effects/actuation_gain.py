"""The scale of the input channels is wrong: a sensor's calibration, a pulley's radius.

It may change along the stroke: a tendon that is wound on itself lies on a larger drum, a load cell is curved.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import channel_gains
from catheter_sim.core.effect import Effect, Form, Parameter, Stage, Values
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.core.variation import ALONG_ROWS
from catheter_sim.effects.shared import (
    TO_SI,
    actuation_unit,
    common_and_each,
    common_then_each,
    per_tendon,
    scale_of,
)

_COMMON = "scale"
_EACH = "scale_{}"
# Bound, and a change that matters, of what the scale grows by over a mm, or over the tension that bends the
# robot by a radian.
_CURVE = 0.5, 0.01


def _parameter(name: str) -> Parameter:
    return Parameter(name, null=1.0, lower=0.5, upper=2.0, scale=0.03, start=1.0)


def _scaled(robot: RobotSpec, inputs: Inputs, values: Values) -> Inputs:
    gain = values.get(_COMMON, 1.0) * per_tendon(robot, _EACH, values, 1.0)
    return replace(inputs, tendon=inputs.tendon * gain)


def _curves(robot: RobotSpec) -> tuple[str, str]:
    """Return the names of the common curve and of each channel's, in inputs' unit."""
    return f"curve_per_{scale_of(robot)}", f"curve_{{}}_per_{scale_of(robot)}"


def _curve_parameters(robot: RobotSpec) -> tuple[Parameter, ...]:
    common, each = _curves(robot)
    bound, scale = (round(share / actuation_unit(robot), 9) for share in _CURVE)
    return common_and_each(robot, Parameter(common, 0.0, -bound, bound, scale=scale, start=0.0), each)


def _curved(robot: RobotSpec, inputs: Inputs, values: Values) -> Inputs:
    common, each = _curves(robot)
    curve = (values.get(common, 0.0) + per_tendon(robot, each, values, 0.0)) / TO_SI[scale_of(robot)]
    share: Array = curve * np.abs(inputs.tendon / channel_gains(robot))
    return replace(inputs, tendon=inputs.tendon * (1.0 + share))


EFFECT = Effect(
    name="actuation_gain",
    summary="the input channels' scale is wrong, so scale * scale_<channel> * input arrives, "
    "or the scale changes with the input",
    trace="an error in proportion to the input, the same on the way out and back",
    bench="Command known steps. Measure at the tendon, with a ruler or a second force gauge, how "
    "much arrives. Compare spools, gears and the sensor's calibration with the robot's file.",
    forms=(
        Form(
            name="scale",
            equation="u' = scale * scale_<channel> * u",
            stage=Stage.COMMAND,
            parameters=lambda robot: common_and_each(robot, _parameter(_COMMON), _EACH),
            groups=lambda robot: common_then_each(robot, _COMMON, _EACH),
            command=_scaled,
            varies=tuple(along for along in ALONG_ROWS if along != "time"),  # that is drift
        ),
        Form(
            name="curved",
            equation="u' = (1 + (curve + curve_<channel>) * |u|) * u, as of a tendon wound on itself",
            stage=Stage.COMMAND,
            parameters=_curve_parameters,
            groups=lambda robot: common_then_each(robot, *_curves(robot)),
            command=_curved,
            further=True,
            varies=(),
        ),
    ),
    advice={
        frozenset({"coupling", "actuation_offset", "measurement_frame", "twist"}): "Drive each section or "
        "joint alone with the others at zero, then against a pretension of the others. Only coupling moves "
        "them.",
    },
)
