"""What an environment needs to know of a robot besides its simulation: one interface, one model a kind.

A robot of another kind becomes drivable by a class with this face, entered in `quick_model`.
"""

from __future__ import annotations

from functools import singledispatch
from typing import Protocol

import numpy as np

from catheter_sim.envs.arc_model import arc_model
from catheter_sim.envs.drives import Drives
from catheter_sim.envs.rolling_model import rolling_model
from catheter_sim.errors import InputError, unknown
from catheter_sim.robots.channels import actuations
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.posture import Array
from catheter_sim.robots.rolling import RollingRobot
from catheter_sim.robots.specification import ContinuumRobot


class QuickModel(Protocol):
    """A robot without friction and load, from the levels of its drives to its tip.

    It says where to look for a posture and which way to move: right in direction, a little large in
    size. Who steers by it looks again after each change.
    """

    @property
    def drives(self) -> Drives:
        """What moves the robot."""

    @property
    def segment_length(self) -> Array:
        """Of the straight robot, shape (s,) [m]."""

    @property
    def segment_of_link(self) -> np.ndarray:
        """Number of the segment, from 0, that each link and its hinges x<k>, y<k> belong to, shape (n,)."""

    @property
    def planar(self) -> bool:
        """Whether the robot bends in the xz plane only and does not twist."""

    def reach(self, level: Array, rest_bends: Array) -> tuple[Array, Array]:
        """Return where the robot goes.

        Args:
            level: of the drives, shape (n, d).
            rest_bends: bend of each segment without load, shape (s, 2) [rad]: an effect may have
                bent a robot that the model takes for straight.

        Returns:
            Tips, shape (n, 3) [m], and bends of the segments, shape (n, s, 2) [rad].
        """

    def tip_slopes(self, level: Array, bends: Array) -> Array:
        """Return how the tip moves with the drives' levels, shape (3, d) [m].

        Args:
            level: of the drives, shape (d,).
            bends: of the segments as they are, friction and load included, shape (s, 2) [rad].
        """


def quick_model(robot: Robot, actuation: str, largest_bend_rad: float) -> QuickModel:
    """Return the quick model of `robot`.

    Args:
        robot: the robot; its `effects` are not read.
        actuation: "tension" or "displacement".
        largest_bend_rad: what one drive alone may ask of a segment, without friction.

    Raises:
        InputError: the robot knows no such actuation, or tendons that bend nothing.
    """
    if actuation not in actuations(robot):
        raise unknown("action_type", actuation, actuations(robot))
    return _of_kind(robot, actuation, largest_bend_rad)


@singledispatch
def _of_kind(robot: Robot, actuation: str, largest_bend_rad: float) -> QuickModel:
    raise InputError(f"{robot.name}: no environment drives a robot of this kind")


_of_kind.register(ContinuumRobot, arc_model)
_of_kind.register(RollingRobot, rolling_model)
