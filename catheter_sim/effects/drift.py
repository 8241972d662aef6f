"""The response creeps within a trial: the inputs' zero wanders, or what is held bends on.

A zero that wanders: each channel's zero moves at a constant rate from the trial's own start (a slipping
clamp, a warming sensor). Creep: under a held input the robot comes on by a share of it with a time
constant, as a spring in series with a Kelvin-Voigt element; below zero it gives back (a tendon that
creeps). A tension stays at zero or above: a tendon cannot push.
"""

from __future__ import annotations

import numpy as np

from catheter_sim.effects._channels import (
    TO_SI,
    added,
    common_and_each,
    common_then_each,
    per_tendon,
    scale_of,
    sized_parameter,
)
from catheter_sim.effects._clock import elapsed_s, lagged
from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.channels import Inputs
from catheter_sim.robots.kinds import Robot

_CREEP = ("creep", "creep_time_s")
# Bound, and a change that matters: in mm, or in tensions that bend the robot by a radian, a minute.
_SIZE = {"N": (50.0, 0.1), "mm": (20.0, 0.1)}


def _names(robot: Robot) -> tuple[str, str]:
    unit = scale_of(robot)
    return f"zero_{unit}_per_min", f"zero_{{}}_{unit}_per_min"


def _parameters(robot: Robot) -> tuple[Parameter, ...]:
    amount, time_s = _CREEP
    common, each = _names(robot)
    return (
        *common_and_each(robot, sized_parameter(robot, common, _SIZE), each),
        Parameter(amount, null=0.0, lower=-0.9, upper=1.0, scale=0.02, start=0.05),
        # Faster than 10 s it would be a lag (`rate`), beyond a quarter of an hour no trial shows its end.
        Parameter(time_s, null=60.0, lower=10.0, upper=900.0, scale=5.0, start=60.0),
    )


def _variants(robot: Robot) -> tuple[tuple[str, ...], ...]:
    # One rate for several channels would be a pair's both sides, or joints of several kinds, at once.
    zeros = common_then_each(robot, *_names(robot))[-1]
    return (zeros, _CREEP) if len(zeros) == 1 else (_CREEP, zeros)


def _change_inputs(robot: Robot, inputs: Inputs, values: Values) -> Inputs:
    common, each = _names(robot)
    rate = (values[common] + per_tendon(robot, each, values, 0.0)) * TO_SI[scale_of(robot)]
    amount, constant_s = (values[name] for name in _CREEP)
    if amount == 0.0 and not rate.any():
        return inputs
    time_s = elapsed_s(inputs.time_s, EFFECT.name)
    wandered = rate * (time_s[:, np.newaxis] / 60.0)
    if amount != 0.0:
        wandered = wandered + amount * lagged(time_s, inputs.tendon + wandered, constant_s)
    return added(inputs, wandered)


EFFECT = Effect(
    name="drift",
    summary="the zero of the inputs wanders by zero + zero_<channel> a minute of the trial, or what arrives "
    "under a held input grows by the share `creep` with the time constant `creep_time_s`",
    trace="an error that grows with the time in the trial, also where the same input returns or is held",
    parameters=_parameters,
    change_inputs=_change_inputs,
    variants=_variants,
    # It begins anew with each trial; inside one its slow lines fit whatever else a model lacks.
    least_trials=2,
)
