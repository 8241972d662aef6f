"""The robot of a draw as nature made it: its specimen's errors, and what is measured of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.blind_bench.robots import BenchRobot, bench_robot
from catheter_sim.catalogue import PUBLISHED
from catheter_sim.channels import body_count, drives_of
from catheter_sim.core.drive import Drive, Quantity
from catheter_sim.core.numbers import number, with_values
from catheter_sim.core.robot import RobotSpec

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
