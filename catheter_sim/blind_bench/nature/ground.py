"""A data set before anything is planted, on few rows: what is large there, and how much a form changes.

Sizes are those that are left when a calibration has taken its part: the change of the outputs is
projected on the changes by the robot's uncertain numbers, each within its range.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.optimize import lsq_linear

from catheter_sim.arrays import Array
from catheter_sim.blind_bench.nature.courses import TRAINING, Course
from catheter_sim.blind_bench.nature.engine import CannotMake, columns_of, looked_at, simulated
from catheter_sim.blind_bench.nature.form import Form, Numbers, Planted, Scale
from catheter_sim.blind_bench.nature.shapes import Shapes, bends_of
from catheter_sim.blind_bench.nature.specimen import Specimen, scaled, uncertain_of

SMALLEST, LARGEST = 5.0, 30.0  # times the noise
_ROWS = 18  # of a trial that sizes are found on
_STEP = 0.5  # of half the range of an uncertain number
_TRIALS = 8
_ROOM = 1e-6  # beyond a range, so that no specimen lies on its end
_NOTHING = Scale(1.0, 1.0, 1.0, 1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Ground:
    """A specimen and its trials.

    Attributes:
        specimen: the robot.
        courses: its trials.
        calibrates: whether a calibration takes its part; not where another recording has shown the specimen.
        known_scale: what is large for its forms; None: what is large here.
    """

    specimen: Specimen
    courses: tuple[Course, ...]
    calibrates: bool = True
    known_scale: Scale | None = None

    @property
    def uncertain(self) -> tuple[Any, ...]:
        """The numbers that a calibration may take, with their ranges (`core.published.Uncertain`)."""
        return uncertain_of(self.specimen) if self.calibrates else ()

    @cached_property
    def picked(self) -> tuple[tuple[Course, tuple[int, ...]], ...]:
        """Training trials, the repeat left out, each with the rows that sizes are found on."""
        return tuple((course, _rows(course)) for course in self.courses[:TRAINING])

    @cached_property
    def few(self) -> tuple[Shapes, ...]:
        """Where the robot is at these rows."""
        return tuple(simulated(self.specimen, _NOTHING, (), course, rows) for course, rows in self.picked)

    @cached_property
    def plain(self) -> tuple[Shapes, ...]:
        """Where the robot is at all rows of all trials."""
        found: list[Shapes] = []
        for course in self.courses:
            known = course.repeats is not None
            found.append(
                found[course.repeats or 0] if known else simulated(self.specimen, _NOTHING, (), course)
            )
        return tuple(found)

    @cached_property
    def scale(self) -> Scale:
        """What is large in this data set."""
        if self.known_scale is not None:
            return self.known_scale
        bends = np.concatenate([np.linalg.norm(bends_of(shapes), axis=-1) for shapes in self.few])
        commands = np.concatenate([course.commands for course in self.courses[:TRAINING]])
        speeds = [
            np.abs(np.diff(course.commands / self.specimen.reach, axis=0)).max(axis=1)
            / np.diff(course.time_s)
            for course in self.courses[:TRAINING]
        ]
        moving = np.concatenate(speeds)
        tips = np.concatenate([shapes.p[:, -1] for shapes in self.few])
        rest = np.array([0.0, 0.0, self.specimen.length_m])
        largest = max(float(bends.max()), 1e-6)
        return Scale(
            bend_rad=largest,
            curvature_per_m=largest * self.specimen.elements / self.specimen.length_m,
            pull=max(float(np.abs(commands[:, self.specimen.pulls]).sum(axis=1).max()), 1e-12),
            duration_s=max(float(course.time_s[-1]) for course in self.courses),
            speed=float(np.median(moving[moving > 0.0])),
            tip_m=max(float(np.linalg.norm(tips - rest, axis=1).max()), 1e-6),
        )

    @cached_property
    def few_outputs(self) -> tuple[Array, ...]:
        """Outputs at these rows, with nothing planted."""
        return tuple(columns_of(self.specimen, shapes) for shapes in self.few)

    @cached_property
    def calibrations(self) -> Array:
        """Change of the outputs over their noise by half the range of each uncertain number, (n, k)."""
        found = []
        for item in self.uncertain:
            step = _STEP * item.half
            if self.specimen.factors[item.name] > 1.0:
                step = -step
            factor = 1.0 + step / self.specimen.factors[item.name]
            other = replace(self.specimen, robot=scaled(self.specimen.robot, item.keys, factor))
            shapes = [simulated(other, self.scale, (), course, rows) for course, rows in self.picked]
            change = self._over_noise([columns_of(other, item_shapes) for item_shapes in shapes])
            found.append(change / step * item.half)
        count = sum(len(rows) for _, rows in self.picked) * len(self.specimen.columns)
        return np.array(found).T if found else np.zeros((count, 0))

    def change(self, planted: Planted) -> Array:
        """Return the change of the outputs over their noise that a planted form makes, shape (n,).

        Raises:
            CannotMake: the robot finds no posture with it.
        """
        found = []
        for number, (course, rows) in enumerate(self.picked):
            if planted.form.looks_only:
                seen = looked_at(self.specimen, self.scale, [planted], course, self.plain[number])
                before = columns_of(self.specimen, self.plain[number].at(rows))
                found.append(columns_of(self.specimen, seen.at(rows)) - before)
            else:
                shapes = simulated(self.specimen, self.scale, [planted], course, rows, self.few[number])
                found.append(columns_of(self.specimen, shapes) - self.few_outputs[number])
        change = np.concatenate([part / self.specimen.noise for part in found]).ravel()
        if not np.isfinite(change).all():
            raise CannotMake(f"{planted.form.key}: no posture")
        return change

    def left(self, change: Array, others: Sequence[Array] = ()) -> Array:
        """Return what is left of a change when calibration, and any multiples of others, are taken off.

        Each uncertain number goes no further than its range, as seen from this specimen.
        """
        known = self.calibrations
        free = np.stack(others, axis=1) if len(others) else np.zeros((len(change), 0))
        directions = np.concatenate([known, free], axis=1)
        if not directions.shape[1]:
            return change
        factors = [self.specimen.factors[item.name] for item in self.uncertain]
        ranges = [item.half for item in self.uncertain]
        ends = [
            [(1.0 + side * half - factor) / half for factor, half in zip(factors, ranges, strict=True)]
            + [side * np.inf] * free.shape[1]
            for side in (-1.0, 1.0)
        ]
        found = lsq_linear(directions, change, (np.array(ends[0]) - _ROOM, np.array(ends[1]) + _ROOM))
        return np.asarray(change - directions @ found.x)

    def sized(self, form: Form, numbers: Numbers, target: float, sign: float) -> tuple[Planted, Array] | None:
        """Return a form of a size that leaves about `target` times the noise, and its change.

        None where no possible size leaves `SMALLEST` to `LARGEST` times the noise.
        """
        size, most = form.start, form.most
        best: tuple[float, Planted, Array] | None = None
        for _ in range(_TRIALS):
            planted = Planted(form, sign * size, numbers)
            try:
                change = self.change(planted)
            except CannotMake:  # no posture, or no such robot
                most = 0.7 * size
                size = 0.5 * size
                continue
            reached = rms(self.left(change))
            off = abs(np.log(max(reached, 1e-9) / target))
            if SMALLEST <= reached <= LARGEST and (best is None or off < best[0]):
                best = (float(off), planted, change)
            if off < 0.25 or (size >= most and reached < target):
                break
            size = min(size * float(np.clip(target / max(reached, 1e-9), 0.15, 6.0)), most)
        return None if best is None else best[1:]

    def _over_noise(self, outputs: Sequence[Array]) -> Array:
        pairs = zip(outputs, self.few_outputs, strict=True)
        return np.concatenate([(one - other) / self.specimen.noise for one, other in pairs]).ravel()


def rms(values: Array) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def _rows(course: Course) -> tuple[int, ...]:
    """Return rows of a trial, the first and the last ones and turning points among them."""
    ways = np.sign(np.diff(course.commands, axis=0))
    turns = np.flatnonzero((ways[1:] != ways[:-1]).any(axis=1)) + 1
    wanted = _spread(turns, max(2, _ROWS - 6))
    rows = {0, len(course) - 1, *wanted, *_spread(np.arange(len(course)), _ROWS - len(wanted))}
    return tuple(sorted(int(row) for row in rows))


def _spread(rows: np.ndarray, count: int) -> list[int]:
    if len(rows) <= count:
        return [int(row) for row in rows]
    return [int(rows[round(k)]) for k in np.linspace(0, len(rows) - 1, count)]
