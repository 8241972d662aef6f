"""What an action moves: a robot's inputs as independent drives, each with a range of its own.

Ranges follow from one angle, the largest bend that is asked of a segment, through the robot's
frictionless model (`arc_model`, `rolling_model`); a catheter's from its joints' own limits
(`catheter_model`).

Under tension every input channel is a drive, antagonists too, from slack to the largest tension.
Under displacement a drive is a segment's bend in one direction, and pulls or pays out every tendon
by what that bend shortens or lengthens its path. Independent pulls would work against each other:
inextensible antagonists would tear at the robot without end. A catheter's antagonists share a pulley:
there every input channel is a drive.
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
        lowest: level at the range's lower end, 0 for a tension or an advance and -1 for a bend or a
            turn, shape (d,); the upper end is 1, and rest is 0.
        tendon: tension [N] or displacement [m] of each tendon at level 1 of each drive, shape (t, d).
        bend: frictionless bends at level 1 of each drive alone, shape (*b, d); (*b) is the shape of
            the robot's bends (`quick_model.QuickModel`): toward +x and +y, shape (s, 2, d) [rad], or a
            catheter's joint values, shape (m, d) [rad, m].
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


def bend_of_link(segment_of_link: np.ndarray, hinge: str) -> tuple[int, int] | None:
    """Return the place in bends of shape (s, 2) of hinge `x<k>` or `y<k>`; None of another joint.

    Args:
        segment_of_link: number of the segment, from 0, that each link belongs to, shape (n,).
        hinge: its name.
    """
    if hinge[0] not in "xy" or not hinge[1:].isdigit():
        return None
    return int(segment_of_link[int(hinge[1:]) - 1]), "xy".index(hinge[0])
