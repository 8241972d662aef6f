"""What a person makes a robot do: single pulls, loops of several sizes, walks, holds, with pauses between."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.blind_bench.nature.specimen import Specimen
from catheter_sim.channels import input_channels
from catheter_sim.core.drive import Quantity
from catheter_sim.units import si_factor

TRAINING, HELDOUT = 4, 2  # trials, and one that repeats a training trial
_ROWS = (60, 2000)
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
    rows = int(np.clip(median * math.exp(_SPREAD * generator.normal()), *_ROWS))
    each = max(9, round(rows / (TRAINING + HELDOUT + 1)))
    styles = ["loops", *(str(generator.choice(["pull", "loops", "walk", "holds"])) for _ in range(5))]
    found: list[Course] = []
    for number, style in enumerate(styles[:TRAINING]):
        found.append(_course(specimen, generator, number, style, each))
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
        time_s, shares = _rows(legs, generator)
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


def _rows(legs: Sequence[_Leg], generator: np.random.Generator) -> tuple[Array, Array]:
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
