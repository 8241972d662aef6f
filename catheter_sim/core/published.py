"""What the package knows of a published robot besides its numbers: tasks, trials, uncertain numbers.

A published robot is a file `kinds/<kind>/robots/<name>.py`; lists and registrations are made of what stands
there as `PUBLISHED`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from catheter_sim.core.robot import RobotSpec


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
