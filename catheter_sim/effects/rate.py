"""The response depends on speed: a first-order lag, or a pure delay, between command and robot.

A viscous drive, a slow servo, or a tracker that is late against the commands. Each trial starts at rest
at its own first row. Friction and play run on what arrives at the rows; a turning point that a delay
moves between two rows is seen at the rows beside it.
"""

from __future__ import annotations

from dataclasses import replace

from catheter_sim.effects._clock import elapsed_s, lagged
from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.channels import Inputs
from catheter_sim.robots.kinds import Robot

_LAG, _DELAY = "lag_s", "delay_s"
_LONGEST_S = 10.0  # what is slower creeps: see `drift`


def _parameters(robot: Robot) -> tuple[Parameter, ...]:
    # Off zero the response has a slope by either also where a trial begins with a step.
    return tuple(
        Parameter(name, null=0.0, lower=0.0, upper=_LONGEST_S, scale=0.1, start=0.2)
        for name in (_LAG, _DELAY)
    )


def _change_inputs(robot: Robot, inputs: Inputs, values: Values) -> Inputs:
    if values[_LAG] == 0.0 and values[_DELAY] == 0.0:
        return inputs
    time_s = elapsed_s(inputs.time_s, EFFECT.name)
    return replace(inputs, tendon=lagged(time_s, inputs.tendon, values[_LAG], values[_DELAY]))


EFFECT = Effect(
    name="rate",
    summary="what arrives follows the inputs with a first-order lag, or late by a delay, all channels alike",
    trace="a loop whose width grows with the speed, and which closes where the input is held",
    parameters=_parameters,
    change_inputs=_change_inputs,
    variants=lambda robot: ((_LAG,), (_DELAY,)),
)
