"""Dead-band between actuator and robot: after a reversal the input moves and nothing follows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from catheter_sim.effects._channels import (
    TO_SI,
    actuation_unit,
    common_and_each,
    common_then_each,
    per_tendon,
    scale_of,
)
from catheter_sim.effects.face import Effect, Parameter, Values
from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.catheter_layout import bent_by
from catheter_sim.robots.channels import Inputs
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.posture import Array

# Bound, and a change that matters: in mm, or in tensions that bend the robot by a radian.
_SLACK = (
    "slack_{}_mm"  # of a catheter's bending joint: a dead-band that its elastic return leaves without a loop
)
_SIZE = {"N": (25.0, 0.1), "mm": (5.0, 0.1)}


def play(values: Array, width: float | Array) -> Array:
    """Return the output of a play of the whole dead-band `width`, starting centred at zero.

    Args:
        values: input, row by row, shape (r, ...).
        width: of the dead-band, or one for each column, in the unit of `values`; zero returns `values`.

    The output follows y = clip(y_before, u - width/2, u + width/2) (Krasnosel'skii's play operator).
    """
    low, high = values - 0.5 * width, values + 0.5 * width
    result = np.empty_like(values)
    now = np.zeros_like(values[0])
    for row in range(len(values)):
        now = np.minimum(np.maximum(now, low[row], out=result[row]), high[row], out=result[row])
    return result


def _names(robot: Robot) -> tuple[str, str]:
    unit = scale_of(robot)
    return f"width_{unit}", f"width_{{}}_{unit}"


def _parameter(robot: Robot, name: str) -> Parameter:
    bound, scale = (round(size * actuation_unit(robot), 9) for size in _SIZE[scale_of(robot)])
    return Parameter(name, null=0.0, lower=0.0, upper=bound, scale=scale, start=2.0 * scale)


def _parameters(robot: Robot) -> tuple[Parameter, ...]:
    common, each = _names(robot)
    if isinstance(robot, CatheterRobot):  # each joint has a drive of its own kind
        widths = common_and_each(robot, _parameter(robot, common), each)
        return (*widths, *(_parameter(robot, _SLACK.format(name)) for name in bent_by(robot)))
    return (_parameter(robot, common),)


def _variants(robot: Robot) -> tuple[tuple[str, ...], ...]:
    common, each = _names(robot)
    if not isinstance(robot, CatheterRobot):
        return ((common,),)
    slack = tuple(_SLACK.format(name) for name in bent_by(robot))
    return (*common_then_each(robot, common, each), slack)


def _change_robot(robot: Robot, values: Values) -> Robot:
    """Give a catheter's drives their play, and its bending tendons their slack; others' are on the inputs."""
    if not isinstance(robot, CatheterRobot):
        return robot
    common, each = _names(robot)
    play = (values[common] + per_tendon(robot, each, values, 0.0)) * TO_SI["mm"]
    bent = bent_by(robot)
    pairs = []
    for pair, own in zip(robot.tendons, play, strict=True):
        slack = values.get(_SLACK.format(pair.name), 0.0) * TO_SI["mm"] if pair.name in bent else 0.0
        pairs.append(replace(pair, play_m=pair.play_m + float(own), slack_m=pair.slack_m + slack))
    return replace(robot, tendons=tuple(pairs))


def _change_inputs(robot: Robot, inputs: Inputs, values: Values) -> Inputs:
    if isinstance(robot, CatheterRobot):
        return inputs
    common, each = _names(robot)
    width = (values[common] + per_tendon(robot, each, values, 0.0)) * TO_SI[scale_of(robot)]
    tendon = play(inputs.tendon, width) if width.any() else inputs.tendon
    if inputs.actuation == "tension":
        tendon = np.maximum(tendon, 0.0)  # a tendon cannot push
    return replace(inputs, tendon=tendon)


EFFECT = Effect(
    name="backlash",
    summary="dead-band between each actuator and its tendon; whole widths, of all and of each, add up",
    trace="a loop of constant width in the input, and a standstill after each reversal",
    parameters=_parameters,
    change_robot=_change_robot,
    change_inputs=_change_inputs,
    variants=_variants,
)
