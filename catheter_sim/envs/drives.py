"""What an action moves: a robot's inputs as independent drives, each with a range of its own.

Ranges follow from one angle, the largest bend that is asked of a segment, through the robot's
frictionless model (`arc_model`, `rolling_model`).

Under tension every input channel is a drive, antagonists too, from slack to the largest tension.
Under displacement a drive is a segment's bend in one direction, and pulls or pays out every tendon
by what that bend shortens or lengthens its path. Independent pulls would work against each other:
inextensible antagonists would tear at the robot without end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catheter_sim.errors import InputError
from catheter_sim.robots.channels import channel_of
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.posture import Array


@dataclass(frozen=True)
class Drives:
    """A robot's drives; the level of a drive is its position in its range.

    Attributes:
        actuation: "tension" or "displacement".
        names: of the drives: an input channel, or `bend_<segment>_<axis>`.
        lowest: level at the range's lower end, 0 for a tension and -1 for a bend, shape (d,); the
            upper end is 1, and rest is 0.
        tendon: tension [N] or displacement [m] of each tendon at level 1 of each drive, shape (t, d).
        bend: frictionless bend of each segment, toward +x and +y, at level 1 of each drive alone,
            shape (s, 2, d) [rad].
        tension: of each tendon at the end of its range as a tension drive, shape (t,) [N].
    """

    actuation: str
    names: tuple[str, ...]
    lowest: Array
    tendon: Array
    bend: Array
    tension: Array


def channel_shares(robot: Robot) -> Array:
    """Return each tendon's share of each channel's tension, shape (t, c).

    A channel's tension is the sum of its tendons'.

    Raises:
        InputError: nothing drives the robot.
    """
    channels = channel_of(robot)
    if not channels:
        raise InputError(f"{robot.name}: has no tendons, so that nothing drives it")
    each = list(dict.fromkeys(channels))
    member = np.array([[channel == name for name in each] for channel in channels], dtype=float)
    return member / member.sum(axis=0)


def bends_nothing(robot: Robot, channel: str) -> InputError:
    """Return the error for an input channel that cannot drive the robot."""
    return InputError(f"{robot.name}: {channel}: bends no segment, so that it cannot drive the robot")
