"""What an environment needs to know of a robot besides its simulation: one interface, one model a kind.

A robot of another kind becomes drivable by a class with this face, entered in `quick_model`.
"""

from __future__ import annotations

import math
from functools import singledispatch
from typing import Protocol

import numpy as np

from catheter_sim.envs.arc_model import arc_model
from catheter_sim.envs.catheter_model import catheter_model
from catheter_sim.envs.drives import Drives
from catheter_sim.envs.rolling_model import rolling_model
from catheter_sim.errors import InputError, unknown
from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.channels import actuations
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.posture import Array
from catheter_sim.robots.rolling import RollingRobot
from catheter_sim.robots.specification import ContinuumRobot
from catheter_sim.statics.catheter.drive import input_range_m

LARGEST_BEND_RAD = math.pi / 2.0  # assumed: what a drive asks of a segment where nobody says otherwise


class QuickModel(Protocol):
    """A robot without friction and load, from the levels of its drives to its tip.

    It says where to look for a posture and which way to move: right in direction, a little large in
    size. Who steers by it looks again after each change.

    Bends say how the robot stands, as few numbers of one shape (*b): the bend of each segment toward +x
    and +y, shape (s, 2) [rad]; of a catheter the value of each joint, shape (m,) [rad, m].
    """

    @property
    def drives(self) -> Drives:
        """What moves the robot."""

    @property
    def segment_length(self) -> Array:
        """Of the straight robot, a tube all pushed out, shape (s,) [m]."""

    @property
    def bend_unit(self) -> Array:
        """What an observation shows as 1 of each bend, shape (*b) [rad, m]."""

    @property
    def planar(self) -> bool:
        """Whether the robot bends in the xz plane only and does not twist."""

    @property
    def sets_bends(self) -> bool:
        """Whether every bend has a drive of its own that sets it, whatever the others do."""

    def bend_of(self, joint: str) -> tuple[int, ...] | None:
        """Return the place, among the bends, of the one to which a joint of the simulation adds.

        Args:
            joint: its name in the model; None is returned of one that adds to none.
        """

    def reach(self, level: Array, rest_bends: Array) -> tuple[Array, Array]:
        """Return where the robot goes.

        Args:
            level: of the drives, shape (n, d).
            rest_bends: without load, shape (*b): an effect may have bent a robot that the model takes
                for straight.

        Returns:
            Tips, shape (n, 3) [m], and bends, shape (n, *b).
        """

    def tip_slopes(self, level: Array, bends: Array) -> Array:
        """Return how the tip moves with the drives' levels, shape (3, d) [m].

        Args:
            level: of the drives, shape (d,).
            bends: as they are, friction and load included, shape (*b).
        """

    def direction_slopes(self, level: Array, bends: Array) -> Array:
        """Return how the unit vector along the tip's axis moves with the levels, shape (3, d).

        Arguments are those of `tip_slopes`.
        """


def quick_model(robot: Robot, actuation: str, largest_bend_rad: float | None = None) -> QuickModel:
    """Return the quick model of `robot`.

    Args:
        robot: the robot; its `effects` are not read.
        actuation: "tension" or "displacement".
        largest_bend_rad: what one drive alone may ask of a segment, without friction; default
            `LARGEST_BEND_RAD`. None of a catheter, whose joints have limits of their own.

    Raises:
        InputError: the robot knows no such actuation, tendons that bend nothing, or a largest bend of a
            catheter.
    """
    if actuation not in actuations(robot):
        raise unknown("action_type", actuation, actuations(robot))
    return _of_kind(robot, actuation, largest_bend_rad)


def input_range(robot: Robot) -> tuple[Array, Array]:
    """Return the least and largest input of each tendon that the simulation takes, each of shape (t,)."""
    if isinstance(robot, CatheterRobot):
        return input_range_m(robot)
    return np.full(len(robot.tendons), -math.inf), np.full(len(robot.tendons), math.inf)


@singledispatch
def _of_kind(robot: Robot, actuation: str, largest_bend_rad: float | None) -> QuickModel:
    raise InputError(f"{robot.name}: no environment drives a robot of this kind")


@_of_kind.register
def _(robot: ContinuumRobot, actuation: str, largest_bend_rad: float | None) -> QuickModel:
    return arc_model(robot, actuation, LARGEST_BEND_RAD if largest_bend_rad is None else largest_bend_rad)


@_of_kind.register
def _(robot: RollingRobot, actuation: str, largest_bend_rad: float | None) -> QuickModel:
    return rolling_model(robot, actuation, LARGEST_BEND_RAD if largest_bend_rad is None else largest_bend_rad)


@_of_kind.register
def _(robot: CatheterRobot, actuation: str, largest_bend_rad: float | None) -> QuickModel:
    return catheter_model(robot, largest_bend_rad)
