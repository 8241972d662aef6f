"""What an action moves: a robot's inputs as independent drives, each with a range of its own.

Ranges follow from one angle, the largest bend that is asked of a segment, through the frictionless
robot of constant curvature: a tension T of a tendon at the distance r bends a segment by T r L / EI,
and a bend b shortens the tendon's path by r b.

Under tension every input channel is a drive, antagonists too, from slack to the largest tension.
Under displacement a drive is a segment's bend in one direction, and pulls or pays out every tendon
by what that bend shortens or lengthens its path. Independent pulls would work against each other:
inextensible antagonists would tear at the robot without end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catheter_sim.errors import InputError, unknown
from catheter_sim.robots.channels import channel_of, input_channels
from catheter_sim.robots.posture import Array
from catheter_sim.robots.specification import ContinuumRobot
from catheter_sim.statics.constant_curvature import arc_robots

_NO_ARM_M = 1e-9  # a tendon nearer to the neutral plane bends nothing


@dataclass(frozen=True)
class Drives:
    """A robot's drives; the level of a drive is its position in its range.

    Attributes:
        actuation: "tension" or "displacement".
        names: of the drives: an input channel, or `bend_<segment>_<axis>`.
        lowest: level at the range's lower end, 0 for a tension and -1 for a bend, shape (d,); the
            upper end is 1, and rest is 0.
        tendon: tension [N] or displacement [m] of each tendon at level 1 of each drive, shape (t, d).
        bend: frictionless bend of each segment, toward +x and +y, at level 1 of each drive, shape
            (s, 2, d) [rad].
        tension: of each tendon at the end of its range as a tension drive, shape (t,) [N].
    """

    actuation: str
    names: tuple[str, ...]
    lowest: Array
    tendon: Array
    bend: Array
    tension: Array


def make_drives(robot: ContinuumRobot, actuation: str, largest_bend_rad: float) -> Drives:
    """Return the drives of `robot`.

    Args:
        robot: the robot; its `effects` are not read.
        actuation: "tension" or "displacement".
        largest_bend_rad: what one drive alone may ask of a segment, without friction.

    Raises:
        InputError: unknown actuation, or tendons that bend nothing.
    """
    if actuation not in ("tension", "displacement"):
        raise unknown("action_type", actuation, ("tension", "displacement"))
    arcs = arc_robots([robot])
    arm = np.where(arcs.free, arcs.arm[0], 0.0)  # (t, s, 2)
    arm[np.abs(arm) < _NO_ARM_M] = 0.0
    compliance = (arcs.length / arcs.bending)[0, :, np.newaxis]  # (s, 1) [rad per N m]
    channels = channel_of(robot)
    each = list(dict.fromkeys(channels))
    member = np.array([[channel == name for name in each] for channel in channels], dtype=float)
    member /= member.sum(axis=0)  # a channel's tension is the sum of its tendons'
    per_newton = np.einsum("tsa,td->sad", arm * compliance, member)  # bend by 1 N in a channel
    largest = np.sqrt((per_newton**2).sum(axis=1)).max(axis=0, initial=0.0)
    for name, value in zip(input_channels(robot, "tension"), largest, strict=True):
        if value == 0.0:
            raise InputError(f"{robot.name}: {name}: bends no segment, so that it cannot drive the robot")
    if not each:
        raise InputError(f"{robot.name}: has no tendons, so that nothing drives it")
    limit = largest_bend_rad / largest  # (d,) [N]
    tension = member * limit
    if actuation == "tension":
        return Drives(
            actuation=actuation,
            names=tuple(input_channels(robot, "tension")),
            lowest=np.zeros(len(each)),
            tendon=tension,
            bend=per_newton * limit,
            tension=tension.sum(axis=1),
        )
    names, bends = _segment_bends(robot, arcs.length[0], arm, largest_bend_rad)
    return Drives(
        actuation=actuation,
        names=names,
        lowest=-np.ones(len(names)),
        tendon=np.einsum("tsa,sad->td", arm, bends),
        bend=bends,
        tension=tension.sum(axis=1),
    )


def _segment_bends(
    robot: ContinuumRobot, length: Array, arm: Array, largest_bend_rad: float
) -> tuple[tuple[str, ...], Array]:
    """Return the bends that the tendons can ask for one by one: names, and shape (s, 2, d) [rad].

    Segments between two tendons' ends bend together, in proportion to their lengths.
    """
    names: list[str] = []
    bends: list[Array] = []
    ends = {tendon.ends_at for tendon in robot.tendons}
    first = 0
    for last, segment in enumerate(robot.segments):
        if segment.name not in ends:
            continue
        together = np.arange(first, last + 1)
        fixed_here = [tendon.ends_at == segment.name for tendon in robot.tendons]
        for axis, letter in enumerate("xy"):
            if arm[fixed_here][:, together, axis].any():
                bend = np.zeros((len(robot.segments), 2))
                bend[together, axis] = largest_bend_rad * length[together] / length[together].max()
                names.append(f"bend_{segment.name}_{letter}")
                bends.append(bend)
        first = last + 1
    return tuple(names), np.stack(bends, axis=-1)
