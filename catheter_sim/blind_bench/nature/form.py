"""What a form of a cause is here: where it acts, what of it is drawn, and what a diagnosis should find."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.blind_bench.nature.courses import Course
from catheter_sim.blind_bench.nature.shapes import Shapes
from catheter_sim.blind_bench.nature.specimen import Specimen
from catheter_sim.core.robot import RobotSpec

Numbers = Mapping[str, Any]  # what a form has besides its size


@dataclass(frozen=True)
class Scale:
    """What is large in the data set, from the specimen with nothing planted.

    Attributes:
        bend_rad: largest turn of an element.
        curvature_per_m: largest bend per length.
        pull: largest sum of the channels' values that pull, SI.
        duration_s: of the longest trial.
        speed: median speed of the channels while they move, in shares of the reach per second.
        tip_m: furthest that the tip goes from where it is at rest.
    """

    bend_rad: float
    curvature_per_m: float
    pull: float
    duration_s: float
    speed: float
    tip_m: float


@dataclass(frozen=True)
class Acting:
    """A form at work on a specimen.

    Attributes:
        specimen: on which.
        scale: what is large there.
        size: how much of it; it does nothing at zero.
        numbers: what else was drawn.
    """

    specimen: Specimen
    scale: Scale
    size: float
    numbers: Numbers

    def mask(self) -> Array:
        """Return 1 for the channels on which it acts, 0 for others, shape (c,)."""
        channel = self.numbers.get("channel")
        if channel is None:
            return np.ones(len(self.specimen.reach))
        return np.asarray(np.arange(len(self.specimen.reach)) == channel, dtype=float)


Draw = Callable[[Specimen, Scale, np.random.Generator], Numbers]
Every = Callable[[Specimen, Scale], Sequence[Numbers]]
OnCommands = Callable[[Acting, Course, Array], Array]
OnShapes = Callable[[Acting, Course, Shapes], Shapes]


def nothing_more(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    """Draw nothing besides the size."""
    return {}


def nothing_else(specimen: Specimen, scale: Scale) -> Sequence[Numbers]:
    """Return the one choice that a form has which draws nothing."""
    return ({},)


@dataclass(frozen=True)
class Form:
    """One form of a cause.

    Of the hooks a form has those at which it acts, in the order in which they stand.

    Attributes:
        cause: its name on the closed list; of a cause outside the list its own.
        name: of the form.
        law: what it does, in one line, with its source.
        known: whether the diagnosis has a form of this law.
        purpose: of a foreign form "tune" or "judge"; of a known one "both".
        applies: whether it makes sense on a specimen.
        draw: what else it has.
        every: of a known form, all choices that `draw` has, of numbers that are no choice a typical one.
        start, most: first size tried, and the largest.
        signed: whether its size may be negative.
        also: other causes whose form says the same; to name one of them is right, too.
        outside: whether the cause is not on the list.
        command: what arrives instead of the commands, shape (r, c), SI.
        robot: the robot instead of the specimen.
        gravity: what acts besides the stated gravity, shape (3,) [m/s^2].
        tip_force: on the tip, constant, shape (3,) [N].
        tether: on the tip at each row, shape (r, 3) [N], by where the robot is without it.
        moments: on elements: their numbers from 1, and moments (r, b, 3) [N m].
        body_force: on one element: its number from 1, and forces (r, 3) [N].
        shape: where the robot is instead.
        seen: where it is seen instead.
        parameters: those of the diagnosis that mean the same number, with their true values, in file units.
    """

    cause: str
    name: str
    law: str
    known: bool
    purpose: str
    applies: Callable[[Specimen], bool] = lambda specimen: True
    draw: Draw = nothing_more
    every: Every = nothing_else
    start: float = 1.0
    most: float = 100.0
    signed: bool = False
    also: tuple[str, ...] = ()
    outside: bool = False
    command: OnCommands | None = None
    robot: Callable[[Acting, RobotSpec], RobotSpec] | None = None
    gravity: Callable[[Acting], Array] | None = None
    tip_force: Callable[[Acting], Array] | None = None
    tether: Callable[[Acting, Shapes], Array] | None = None
    moments: Callable[[Acting, Course, Array], tuple[tuple[int, ...], Array]] | None = None
    body_force: Callable[[Acting, Course], tuple[int, Array]] | None = None
    shape: OnShapes | None = None
    seen: OnShapes | None = None
    parameters: Callable[[Acting], Mapping[str, float]] = field(default=lambda acting: {})

    @property
    def key(self) -> str:
        """Its cause's name and its own."""
        return f"{self.cause}.{self.name}"

    @property
    def looks_only(self) -> bool:
        """Whether the simulation needs not run anew for it."""
        loads = (self.gravity, self.tip_force, self.tether, self.moments, self.body_force)
        others = (self.command, self.robot, *loads)
        return all(hook is None for hook in others)


@dataclass(frozen=True)
class Planted:
    """A form with what was drawn for it."""

    form: Form
    size: float
    numbers: Numbers

    def acting(self, specimen: Specimen, scale: Scale) -> Acting:
        """Return it at work."""
        return Acting(specimen, scale, self.size, self.numbers)


def one_channel(specimen: Specimen, scale: Scale, generator: np.random.Generator) -> Numbers:
    """Draw one of the channels that pull."""
    return {"channel": int(generator.choice(np.flatnonzero(specimen.pulls)))}


def each_channel(specimen: Specimen, scale: Scale) -> Sequence[Numbers]:
    """Return the choices of one of the channels that pull."""
    return [{"channel": int(index)} for index in np.flatnonzero(specimen.pulls)]


def several_channels(specimen: Specimen) -> bool:
    """Return whether more than one channel pulls."""
    return int(specimen.pulls.sum()) > 1


def of_cells(specimen: Specimen) -> bool:
    """Return whether it bends all along: cells, links, disks, no joints of their own channels."""
    return not specimen.jointed


def places_along(acting: Acting) -> Array:
    """Return each element's place along the robot, 0 to 1, shape (1, n, 1)."""
    count = acting.specimen.elements
    return np.asarray(((np.arange(count) + 0.5) / count)[np.newaxis, :, np.newaxis])


def channel_name(acting: Acting) -> str:
    """Return the name of the channel on which a form acts."""
    return acting.specimen.drives[acting.numbers["channel"]].channel


def in_unit(acting: Acting) -> float:
    """Return a size per tendon in the channels' file unit for a size of one: a hundredth of the reach."""
    specimen = acting.specimen
    pulled = specimen.reach[specimen.pulls]
    largest = float((pulled / specimen.per_tendon[specimen.pulls]).max())
    return float(f"{0.01 * largest / specimen.file_size:.2g}")


def per_channel(acting: Acting) -> Array:
    """Return that size on each channel on which a form acts, SI, shape (c,)."""
    specimen = acting.specimen
    return in_unit(acting) * specimen.file_size * specimen.per_tendon * acting.mask()
