"""What the package knows of a published robot: tasks, trials, uncertain numbers, a quick model."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Drive, Quantity, shares
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError

# ----------------------------------------------------------------------------------------------------
# What the package knows of a published robot besides its numbers: tasks, trials, uncertain numbers.
#
# A published robot is a file `robots/<kind>/published.py`; lists and registrations are made of what
# stands there as `PUBLISHED`.


@dataclass(frozen=True)
class Environment:
    """A Gymnasium environment of a robot.

    Attributes:
        name: as in its id, `catheter_sim/<name>-v0`.
        task: "Reach", "Track" or another that `envs` knows.
        arguments: of the task, besides the robot.
    """

    name: str
    task: str
    arguments: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Trials:
    """How the bench of hidden effects uses a robot.

    Attributes:
        drive: "pull" (tensions, one channel or two at a time), "joints" (joints of their own, to and fro) or
            "heading" (displacements that bend one segment in some direction).
        reach: largest input of each channel, in the channels' order, shape (c,) [N, or m].
        pretension_N: largest standing tension of all channels.
        axes: in which positions are measured.
        angles: further outputs, in degrees.
        simulated: fields of the robot that are other in the simulation that makes the data.
        rods: data by the rod model `VC_ref_noproj` wherever it knows the robot with what is hidden.
        rows: of a rich trial, about.
        together: whether channels of two sections are pulled at the same time. With friction the twin and
            the simulation then differ: a tendon slides where another one bends the section around it.
    """

    drive: str
    reach: tuple[float, ...]
    pretension_N: float = 0.0
    axes: str = "xyz"
    angles: tuple[str, ...] = ()
    simulated: Mapping[str, Any] = field(default_factory=dict)
    rows: int = 60
    together: bool = True
    rods: bool = False


@dataclass(frozen=True)
class Uncertain:
    """A factor on numbers of a specimen that differs from one to the next, uniform in 1 -+ `half`.

    Attributes:
        name: of the factor.
        half: half of its range.
        keys: dotted file keys of the numbers that it multiplies.
    """

    name: str
    half: float
    keys: tuple[str, ...]


@dataclass(frozen=True)
class Published:
    """A published robot, or one of its parameter sets (`<robot>@<set>`).

    Attributes:
        id: what users call it.
        build: returns it.
        environments: its Gymnasium environments.
        trials: how the bench of hidden effects uses it; None: it does not.
        uncertain: what is calibrated of every specimen.
    """

    id: str
    build: Callable[[], RobotSpec]
    environments: tuple[Environment, ...] = ()
    trials: Trials | None = None
    uncertain: tuple[Uncertain, ...] = ()


Drawn = Callable[[np.random.Generator], tuple[RobotSpec, Trials]]  # a robot of drawn dimensions


class Robots(Protocol):
    """`robots/__init__.py`: which robots of this kind are there?"""

    PUBLISHED: tuple[Published, ...]
    """In the order of lists."""
    DRAWN: Mapping[str, Drawn]
    """Robots of no publication that the bench of hidden effects draws anew each time."""


def reach_and_track(name: str, **arguments: float) -> tuple[Environment, Environment]:
    """Return the two environments that every robot has which can be steered.

    Args:
        name: of the robot in their ids.
        arguments: of both tasks.
    """
    return Environment(f"{name}Reach", "Reach", arguments), Environment(f"{name}Track", "Track", arguments)


# ----------------------------------------------------------------------------------------------------
# What an environment needs to know of a robot besides its simulation: drives, a model without friction.
#
# Each kind that environments drive has a model of its own with this face (`steering.quick_model`).
#
# Drives. Ranges follow from one angle, the largest bend that is asked of a segment, through the robot's
# frictionless model, or from its joints' own limits.
#
# Under tension every input channel is a drive, antagonists too, from slack to the largest tension. Under
# displacement a drive is a segment's bend in one direction, and pulls or pays out every tendon by what that
# bend shortens or lengthens its path. Independent pulls would work against each other: inextensible
# antagonists would tear at the robot without end. A catheter's antagonists share a pulley: there every
# input channel is a drive.

LARGEST_BEND_RAD = math.pi / 2.0  # assumed: what a drive asks of a segment where nobody says otherwise


@dataclass(frozen=True)
class DriveLevels:
    """What an action moves: a robot's inputs as independent drives, each with a range of its own.

    The level of a drive is its position in its range.

    Attributes:
        actuation: "tension" or "displacement".
        names: of the drives: an input channel, or `bend_<segment>_<axis>`.
        lowest: level at the range's lower end, 0 for a tension or an advance and -1 for a bend or a
            turn, shape (d,); the upper end is 1, and rest is 0.
        tendon: tension [N] or displacement [m] of each tendon at level 1 of each drive, shape (t, d).
        bend: frictionless bends at level 1 of each drive alone, shape (*b, d). (*b) is the shape of
            the robot's bends (`QuickModel`): toward +x and +y, shape (s, 2, d) [rad], or a
            catheter's joint values, shape (m, d) [rad, m].
        tension: of each tendon at the end of its range as a tension drive, shape (t,) [N].
    """

    actuation: str
    names: tuple[str, ...]
    lowest: Array
    tendon: Array
    bend: Array
    tension: Array

    @property
    def quantity(self) -> Quantity:
        """What the tendons' inputs are."""
        return Quantity[self.actuation.upper()]


class QuickModel(Protocol):
    """A robot without friction and load, from the levels of its drives to its tip.

    It says where to look for a posture and which way to move: right in direction, a little large in
    size. Who steers by it looks again after each change.

    Bends say how the robot stands, as few numbers of one shape (*b): the bend of each segment toward +x
    and +y, shape (s, 2) [rad]. Of a catheter the value of each joint, shape (m,) [rad, m].
    """

    @property
    def drives(self) -> DriveLevels:
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


@dataclass(frozen=True)
class InputLimits:
    """What may be asked of a robot's input columns, each alone.

    Attributes:
        least, most: of each column, shape (c,) [N or m]; infinite: any.
        why: what happens there.
    """

    least: Array
    most: Array
    why: str


@dataclass(frozen=True)
class SpeedCase:
    """What the speed test plays with a robot.

    Attributes:
        inputs: of the tendons, shape (levels, t) [N] or [m].
        links: in its chain.
        rubs: whether friction is switched on where the robot is specified without any.
        follows: whether MuJoCo alone moves the model as its inputs ask.
    """

    inputs: Array
    links: int
    rubs: bool
    follows: bool


def pulled_in_turn(peaks: Sequence[tuple[float, float]], levels: int) -> Array:
    """Return tensions along a cycle in which one side pulls, then the other, shape (levels, t) [N].

    Args:
        peaks: of each tendon, its largest tension [N] and its side, 1 or -1.
        levels: rows of the cycle.
    """
    phase = np.linspace(0.0, 2.0 * np.pi, levels, endpoint=False)
    cycle = np.zeros((levels, len(peaks)))
    for index, (peak, side) in enumerate(peaks):
        cycle[:, index] = peak * np.maximum(0.0, side * np.sin(phase))
    return cycle


def tension_shares(robot: RobotSpec, drives: tuple[Drive, ...]) -> Array:
    """Return each tendon's share of each channel's tension, shape (t, c).

    Raises:
        InputError: nothing drives the robot.
    """
    if not drives:
        raise InputError(f"{robot.name}: has no tendons, so that nothing drives it")
    return shares(drives, len(robot.tendons))


def bends_nothing(robot: RobotSpec, channel: str) -> InputError:
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
