"""Dead-band between actuator and robot: after a reversal the input moves and nothing follows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from catheter_sim.effects._channels import TO_SI, actuation_unit, scale_of
from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.channels import Inputs
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.posture import Array

# Bound, and a change that matters: in mm, or in tensions that bend the robot by a radian.
_SIZE = {"N": (25.0, 0.1), "mm": (5.0, 0.1)}


def play(values: Array, width: float) -> Array:
    """Return the output of a play of the whole dead-band `width`, starting centred at zero.

    Args:
        values: input, row by row, shape (r, ...).
        width: of the dead-band, in the unit of `values`; zero returns `values`.

    The output follows y = clip(y_before, u - width/2, u + width/2) (Krasnosel'skii's play operator).
    """
    low, high = values - 0.5 * width, values + 0.5 * width
    result = np.empty_like(values)
    now = np.zeros_like(values[0])
    for row in range(len(values)):
        now = np.minimum(np.maximum(now, low[row], out=result[row]), high[row], out=result[row])
    return result


def _parameters(robot: Robot) -> tuple[Parameter, ...]:
    unit = scale_of(robot)
    bound, scale = (round(size * actuation_unit(robot), 9) for size in _SIZE[unit])
    return (Parameter(f"width_{unit}", null=0.0, lower=0.0, upper=bound, scale=scale, start=2.0 * scale),)


def _change_inputs(robot: Robot, inputs: Inputs, values: Values) -> Inputs:
    unit = scale_of(robot)
    width = values[f"width_{unit}"] * TO_SI[unit]
    tendon = play(inputs.tendon, width) if width > 0.0 else inputs.tendon
    if inputs.actuation == "tension":
        tendon = np.maximum(tendon, 0.0)  # a tendon cannot push
    return replace(inputs, tendon=tendon)


EFFECT = Effect(
    name="backlash",
    summary="dead-band of the given whole width between each actuator and its tendon",
    trace="a loop of constant width in the input, and a standstill after each reversal",
    parameters=_parameters,
    change_inputs=_change_inputs,
)
