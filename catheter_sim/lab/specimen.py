"""The robot of a bench as nature made it, what it is made to do, what is measured of it, and with what
noise."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.catalogue import PUBLISHED
from catheter_sim.channels import body_count, drives_of, input_channels
from catheter_sim.core.document import number, with_values
from catheter_sim.core.inputs import Drive, Quantity
from catheter_sim.core.robot import RobotSpec
from catheter_sim.lab.robots import BenchRobot, bench_robot
from catheter_sim.units import si_factor

# ----------------------------------------------------------------------------------------------------
# The robot of a draw as nature made it: its specimen's errors, and what is measured of it.

_UNITS = ("mm", "deg")
NOISE = {"mm": (0.1, 0.3), "deg": (0.15, 0.5)}  # standard deviation, uniform
_WEIGHS = 0.3  # share of the data sets in which weight acts, where the robot has any
_EARTH_MPS2 = 9.81
_ALL_AXES = 0.3  # share of the planar robots that are seen in space
_ANGLES = 0.4  # share of the data sets with joint angles, where a robot has such


@dataclass(frozen=True)
class Specimen:
    """A robot of the bench before anything is planted.

    Attributes:
        bench: the robot as specified.
        robot: the specimen, with its errors of calibration and the simulation's own settings; no effects.
        factors: those errors, by name.
        columns: the outputs that are measured.
        noise: of each column, shape (o,), in file units.
        gravity_mps2: as the data set states it, shape (3,).
    """

    bench: BenchRobot
    robot: RobotSpec
    factors: Mapping[str, float]
    columns: tuple[str, ...]
    noise: Array
    gravity_mps2: Array

    @cached_property
    def drives(self) -> tuple[Drive, ...]:
        """The input columns."""
        return drives_of(self.bench.robot)

    @cached_property
    def reach(self) -> Array:
        """Largest input of each channel, shape (c,), SI."""
        return np.array(self.bench.trials.reach)

    @cached_property
    def pulls(self) -> np.ndarray:
        """Which channels pull tendons; a tube's advance is none."""
        return np.array([drive.quantity is not Quantity.ADVANCE for drive in self.drives])

    @property
    def tensioned(self) -> bool:
        """Whether tensions drive it."""
        return self.drives[0].quantity is Quantity.TENSION

    @property
    def file_unit(self) -> str:
        """Unit of the channels in files."""
        return self.drives[0].quantity.file_unit

    @property
    def file_size(self) -> float:
        """That unit in SI."""
        return self.drives[0].quantity.file_size

    @cached_property
    def per_tendon(self) -> Array:
        """What a channel's input is divided by for each of its tendons, shape (c,)."""
        return np.array([1.0 / drive.share for drive in self.drives])

    @property
    def jointed(self) -> bool:
        """Whether each channel moves a joint of its own."""
        return self.bench.trials.drive == "joints"

    @property
    def planar(self) -> bool:
        """Whether it bends in one plane only."""
        return len(self.bench.trials.axes) == 2

    @property
    def seen_axes(self) -> str:
        """In which axes positions are measured."""
        return "".join(axis for axis in "xyz" if f"tip_{axis}_mm" in self.columns)

    @cached_property
    def length_m(self) -> float:
        """Of the straight robot."""
        return float(sum(segment.length_m for segment in self.bench.robot.segments))

    @cached_property
    def elements(self) -> int:
        """Cells, links, rings or disks."""
        return body_count(self.bench.robot)

    @cached_property
    def segment_of_element(self) -> tuple[int, ...]:
        """The segment in which each element lies; all in the first one where their numbers do not add up."""
        counts = [_count(segment) for segment in self.bench.robot.segments]
        if sum(counts) != self.elements:
            return (0,) * self.elements
        return tuple(index for index, count in enumerate(counts) for _ in range(count))

    def has(self, name: str) -> bool:
        """Return whether all its segments have a number."""
        return all(hasattr(segment, name) for segment in self.bench.robot.segments)

    @cached_property
    def weighs(self) -> bool:
        """Whether weight acts, by the data set."""
        return bool(np.any(self.gravity_mps2))


def drawn_specimen(generator: np.random.Generator, name: str) -> Specimen:
    """Return a specimen of a robot of the bench: errors of calibration, columns, noise, gravity."""
    return specimen_of(generator, bench_robot(name, generator))


def specimen_of(generator: np.random.Generator, bench: BenchRobot) -> Specimen:
    """Return a specimen of a robot: errors of calibration, columns, noise, gravity."""
    robot: RobotSpec = replace(bench.robot, effects={}, **bench.trials.simulated)
    factors = {}
    for item in _uncertain(bench.reference):
        factors[item.name] = float(generator.uniform(1.0 - item.half, 1.0 + item.half))
        robot = scaled(robot, item.keys, factors[item.name])
    columns = _columns(bench, generator)
    sizes = {unit: float(generator.uniform(*NOISE[unit])) for unit in _UNITS}
    gravity = _gravity(bench, generator)
    noise = np.array([sizes["deg" if column.endswith("_deg") else "mm"] for column in columns])
    return Specimen(bench, robot, factors, columns, noise, gravity)


def scaled(robot: RobotSpec, keys: tuple[str, ...], factor: float) -> RobotSpec:
    """Return `robot` with the numbers at dotted keys multiplied."""
    return with_values(robot, {key: number(robot, key) * factor for key in keys})


def uncertain_of(specimen: Specimen) -> tuple[Any, ...]:
    """Return the numbers that a calibration may take, with their ranges (`core.published.Uncertain`)."""
    return _uncertain(specimen.bench.reference)


def _uncertain(reference: str) -> tuple[Any, ...]:
    return PUBLISHED[reference].uncertain if reference in PUBLISHED else ()


def _count(segment: Any) -> int:
    for name in ("disks", "joints", "notches"):
        if hasattr(segment, name):
            return int(getattr(segment, name))
    return 0


def _columns(bench: BenchRobot, generator: np.random.Generator) -> tuple[str, ...]:
    """The tip, often one or three points along the robot besides, sometimes joint angles."""
    places = ["tip"]
    drawn = generator.random()
    if drawn < 0.3:
        places += [f"body_{k}" for k in bench.bodies]
    elif drawn < 0.75:
        places.append(f"body_{bench.bodies[1]}")
    axes = "xyz" if generator.random() < _ALL_AXES else bench.trials.axes
    found = [f"{place}_{axis}_mm" for place in places for axis in axes]
    if bench.trials.angles and generator.random() < _ANGLES:
        found += bench.trials.angles
    return tuple(found)


def _gravity(bench: BenchRobot, generator: np.random.Generator) -> Array:
    """Weight along an axis in which the robot can bend, or along the robot, hanging."""
    none = np.zeros(3)
    mass = sum(segment.mass_kg for segment in bench.robot.segments)
    chosen = generator.random() < _WEIGHS
    axis = str(generator.choice([*(bench.trials.axes.replace("z", "")), "z"]))
    sign = 1.0 if axis == "z" else float(generator.choice([-1.0, 1.0]))
    if not chosen or mass == 0.0:
        return none
    return np.array([sign * _EARTH_MPS2 if axis == letter else 0.0 for letter in "xyz"])


# ----------------------------------------------------------------------------------------------------
# What a person makes a robot do: single pulls, loops of several sizes, walks, holds, with pauses between.

TRAINING, HELDOUT = 4, 2  # trials, and one that repeats a training trial
_COURSE_ROWS = (60, 2000)
_FEW_ROWS = 220.0  # median of those robots that take longest
_MANY_ROWS = 380.0
_SPREAD = 0.5  # of the logarithm of the number of rows
_CHANNELS_OF_LARGE = 6  # a robot with so many takes longest
_STEPS_S = (0.2, 0.5, 1.0, 2.0)  # between rows of a leg
_PAUSE_S = (10.0, 120.0)
_UNEVEN = 0.2  # share of a step by which clocks wander, in some trials


@dataclass(frozen=True)
class Course:
    """The commands of one trial.

    Attributes:
        number: of the trial in the data set, from 0.
        role: "train", "heldout" or "".
        time_s: shape (r,), from zero.
        commands: channels' values, shape (r, c), SI; the first row is zero.
        repeats: the trial that this one repeats, or None.
    """

    number: int
    role: str
    time_s: Array
    commands: Array
    repeats: int | None = None

    def __len__(self) -> int:
        return len(self.time_s)


@dataclass(frozen=True)
class _Leg:
    """A way to a corner: where to, in shares of the reach, in so many rows, and how long a row takes."""

    share: Array
    rows: int
    step_s: float


def drawn_courses(specimen: Specimen, generator: np.random.Generator) -> tuple[Course, ...]:
    """Return the trials of a data set: training, one of them again, held-out."""
    large = len(specimen.reach) >= _CHANNELS_OF_LARGE
    median = _FEW_ROWS if large else _MANY_ROWS
    rows = int(np.clip(median * math.exp(_SPREAD * generator.normal()), *_COURSE_ROWS))
    each = max(9, round(rows / (TRAINING + HELDOUT + 1)))
    styles = ["loops", *(str(generator.choice(["pull", "loops", "walk", "holds"])) for _ in range(5))]
    found: list[Course] = []
    for index, style in enumerate(styles[:TRAINING]):
        found.append(_course(specimen, generator, index, style, each))
    used = np.any([course.commands.any(axis=0) for course in found], axis=0)
    found.append(replace(found[0], number=TRAINING, repeats=0))
    for style in styles[TRAINING : TRAINING + HELDOUT]:
        found.append(_course(specimen, generator, len(found), style, each, used))
    open_roles = generator.random() < 0.25
    roles = ("train",) * (TRAINING + 1) + ("heldout",) * HELDOUT
    return tuple(
        replace(course, role="" if open_roles else role) for course, role in zip(found, roles, strict=True)
    )


def _course(
    specimen: Specimen,
    generator: np.random.Generator,
    number: int,
    style: str,
    rows: int,
    used: np.ndarray | None = None,
) -> Course:
    for _ in range(100):
        legs = _legs(specimen, generator, style, rows)
        time_s, shares = _course_rows(legs, generator)
        values = shares * specimen.reach
        standing = specimen.bench.trials.pretension_N
        if standing > 0.0:
            values = np.maximum(values, generator.uniform(0.0, standing))
            values[0] = 0.0
        unit = np.array([si_factor(name) for name in input_channels(specimen.bench.robot)])
        values = np.round(values / unit, 5) * unit
        if used is None or not values[:, ~used].any():
            return Course(number, "", np.round(time_s, 4), values)
    raise ValueError("no trial was drawn that moves only channels that training moves")


def _legs(specimen: Specimen, generator: np.random.Generator, style: str, rows: int) -> list[_Leg]:
    """Return the ways of one trial, about `rows` rows; each figure starts and ends at rest."""
    legs: list[_Leg] = []
    while sum(leg.rows for leg in legs) < 0.8 * rows:
        left = rows - sum(leg.rows for leg in legs)
        toward = _direction(specimen, generator)
        size = generator.uniform(0.45, 1.0)
        if style == "pull":
            corners = [size, 0.0]
        elif style == "loops":
            inner = generator.uniform(0.15, 0.6)
            corners = [size, inner * size, generator.uniform(0.7, 1.0) * size, 0.0]
            if generator.random() < 0.4:
                corners[2:2] = [size * (inner + 0.5 * (1.0 - inner)), inner * size]
        elif style == "holds":
            corners = sorted(generator.uniform(0.1, 1.0, 3).tolist())
            corners += [generator.uniform(0.1, 0.6), 0.0]
        else:
            corners = [*generator.uniform(0.0, 1.0, int(generator.integers(3, 7))).tolist(), 0.0]
        least = 2 if style == "holds" else 3
        count = max(least, min(12, round(left / len(corners) * generator.uniform(0.6, 1.0))))
        for corner in corners:
            quick = float(generator.choice(_STEPS_S))
            legs.append(_Leg(corner * toward, max(2, round(count * generator.uniform(0.6, 1.3))), quick))
            if style == "holds":
                legs.append(_Leg(corner * toward, 2, float(generator.uniform(5.0, 30.0))))
        if generator.random() < 0.35:
            legs.append(_Leg(0.0 * toward, 1, float(generator.uniform(*_PAUSE_S))))
    return legs


def _course_rows(legs: Sequence[_Leg], generator: np.random.Generator) -> tuple[Array, Array]:
    """Return times and shares of the rows, from zero."""
    channels = len(legs[0].share)
    shares, steps = [np.zeros((1, channels))], [np.zeros(1)]
    now = np.zeros(channels)
    for leg in legs:
        part = np.linspace(0.0, 1.0, leg.rows + 1)[1:, np.newaxis]
        shares.append(now + (leg.share - now) * part)
        steps.append(np.full(leg.rows, leg.step_s))
        now = leg.share
    step = np.concatenate(steps)
    if generator.random() < 0.3:
        step *= generator.uniform(1.0 - _UNEVEN, 1.0 + _UNEVEN, len(step))
    return np.cumsum(step), np.concatenate(shares)


def _direction(specimen: Specimen, generator: np.random.Generator) -> Array:
    """Return how far each channel goes at full size, shape (c,), in shares of its reach."""
    trials, count = specimen.bench.trials, len(specimen.reach)
    if trials.drive == "heading":
        heading = generator.uniform(0.0, 2.0 * math.pi)
        angles = np.array([math.atan2(*drive.side[::-1]) for drive in specimen.drives])
        return np.asarray(np.cos(angles - heading))
    if trials.drive == "joints":
        found = np.zeros(count)
        moved = generator.choice(count, int(generator.integers(1, count + 1)), replace=False)
        for index in moved.tolist():
            advance = specimen.drives[index].quantity is Quantity.ADVANCE
            sign = 1.0 if advance else float(generator.choice([-1.0, 1.0]))
            found[index] = sign * generator.uniform(0.3, 1.0)
        return found
    found = np.zeros(count)
    first = int(generator.integers(count))
    found[first] = 1.0
    others = [k for k, drive in enumerate(specimen.drives) if drive.moves != specimen.drives[first].moves]
    if others and trials.together and generator.random() < 0.5:
        found[int(generator.choice(others))] = generator.uniform(0.3, 0.8)
    return found


# ----------------------------------------------------------------------------------------------------
# Noise as trackers make it: white, coloured, with outliers, quantised.

# How many of a hundred data sets have it.
KINDS: Mapping[str, int] = {"white": 60, "coloured": 15, "outliers": 13, "quantised": 12}
MOST_MISSING = 0.01  # share of the cells
_OUTLIERS = 0.01  # share of the rows
_OUTLIER_SIZE = (5.0, 12.0)  # times the noise
_CORRELATION = (0.3, 0.7)  # from row to row
_NOISE_STEP = (0.8, 1.6)  # of a quantised reading, times the noise


def measured(clean: Array, size: Array, kind: str, generator: np.random.Generator) -> Array:
    """Return outputs (r, o) with noise of a kind; some cells are missing (NaN).

    `size`: standard deviation of each column, shape (o,); `kind`: one of `KINDS`.
    """
    noisy = clean + size * standard(clean.shape, kind, generator)
    if kind == "quantised":
        step = generator.uniform(*_NOISE_STEP) * size
        noisy = np.round(noisy / step) * step
    missing = generator.random(clean.shape) < generator.uniform(0.0, MOST_MISSING)
    return np.where(missing, np.nan, noisy)


def standard(shape: tuple[int, ...], kind: str, generator: np.random.Generator) -> Array:
    """Return noise of standard deviation one (outliers come on top), before it is quantised.

    Coloured: e_k = rho e_(k-1) + sqrt(1 - rho^2) w_k, stationary from the first row.
    """
    white = generator.normal(size=shape)
    if kind == "coloured":
        return coloured(white, generator.uniform(*_CORRELATION))
    if kind == "outliers":
        rows = generator.random(shape[0]) < _OUTLIERS
        white[rows] *= generator.uniform(*_OUTLIER_SIZE, (int(rows.sum()), *(1,) * (len(shape) - 1)))
    return white


def coloured(white: Array, rho: float) -> Array:
    """Return white noise (r, ...) coloured to a correlation `rho` from row to row, of the same size."""
    found = np.array(white)
    for row in range(1, len(found)):
        found[row] = rho * found[row - 1] + np.sqrt(1.0 - rho**2) * white[row]
    return found
