"""Readings as a sensor gives them: their resolution, repeats of other trials, and rows where it is frozen."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.thresholds import STEP_BY_STEP
from catheter_sim.diagnosis.trials import Dataset, Trial, all_inputs, measured_of, unit_of

FROZEN_SHARE = 0.15
"""[share of a trial's rows] A sensor that repeats one value over more of them is frozen. Why: assumed. While
a robot is driven, its noise alone changes a measured value from row to row."""
FROZEN_ROWS = 8
"""[rows] The same for short trials, where fewer repeats are no frozen sensor. Why: assumed. Coarse sensors
repeat values over a few rows."""
FROZEN_DRIVEN_SHARE = 0.3
"""[share of an input's range] The input must pass through this much of it meanwhile. Why: a sensor may well
repeat its value while the robot is held still."""
STALE_SHARE = 0.3
"""[share of the rows] From here on, rows that repeat all outputs of the row before are old readings, if the
robot is driven. Why: assumed. By noise alone no row repeats in all its digits."""
STALE_VALUES_SHARE = 0.5
"""[values per change] With fewer, a sensor counts coarsely, and repeats what it measures. Why: assumed. A
reading of a fine sensor never comes again."""
FEWEST_READINGS = 8
"""[distinct readings] Fewer show no grid. Why: assumed. A few numbers are at equal distances by chance."""
FEWEST_STEPS = 20
"""[steps] A column that moves by less shows no grid by itself. Why: assumed. A handful of levels, each set by
hand, are at equal distances too."""
MOST_STEPS = 1e5
"""[steps in the largest reading] With more, readings are continuous. Why: numbers are printed with six
digits, whatever measured them. What rounds them there is far below any noise."""
GRID_SHARE = 0.9
"""[share of the distinct readings] This many must lie on a decimal grid. Why: a tenth of continuous readings
lies on any grid. Cells that somebody filled in lie off it."""
GRID_MISSED_SHARE = 0.1
"""[share of a step] Readings may lie off the grid of a counting sensor by this much, in all. Why: eight
readings are as near by chance once in a million times."""
GRID_FILLED_SHARE = 0.95
"""[share of the grid's points] From here on, a grid may be a ramp of commands, followed without noise. Why:
readings of a sensor leave points out, unless many commands share each of them."""
SHARED_READINGS = 2.0
"""[commands per reading] With a sensor that counts, at least this many commands share each reading. Why: as
for `GRID_FILLED_SHARE`. A model without noise has its own reading for each command."""
COPY_ROWS = 12
"""[rows] This many in a row that agree to the last digit are a copy. Why: assumed. Noise of a few steps of
the last digit repeats in one row of ten at most, so twelve of them are no chance."""
COPY_STEPS = 2.0
"""[steps of the last digit] A column with less noise tells nothing about copies. Why: a coarse sensor gives
the same readings whenever a robot repeats a motion."""
COPY_PROBES = 16
"""[rows] This many of a trial are looked for in another one. Why: a copied part of an eighth of a trial holds
two of them."""

# ----------------------------------------------------------------------------------------------------
# The resolution of readings: the step of the grid on which they lie.
#
# A log that is rounded to so many decimals has one, and so has a sensor that counts (an encoder, pixels).
# No model's error falls below step / sqrt(12), the root mean square of what rounding takes away.


def resolution_of(dataset: Dataset) -> Mapping[str, float]:
    """Return the step of every output column that shows one, in the column's unit."""
    if dataset.resolution is not None:
        return dataset.resolution
    return steps_of(dataset.trials, dataset.output_channels)


def steps_of(trials: Sequence[Trial], columns: Sequence[str]) -> dict[str, float]:
    """Return the step of every column that shows one, in the column's unit.

    A column that hardly moves shows none by itself. It has that of another column of its unit where all its
    readings lie on that one's grid.
    """
    commands = np.concatenate([all_inputs(trial.inputs) for trial in trials])
    readings = {name: np.concatenate([trial.outputs.columns[name] for trial in trials]) for name in columns}
    shown = {name: step_of(values, commands) for name, values in readings.items()}
    found = {}
    for name, values in readings.items():
        known = np.unique(values[np.isfinite(values)])
        like = [shown[other] for other in columns if unit_of(other) == unit_of(name) and shown[other]]
        on_grid = [step for step in like if len(known) > 1 and _on_grid(known / step).all()]
        step = shown[name] or max(on_grid, default=0.0)
        if step:
            found[name] = step
    return found


def resolution_by_unit(steps: Mapping[str, float]) -> dict[str, float]:
    """Return the largest step of each unit's columns."""
    return {unit_of(name): max(steps[k] for k in steps if unit_of(k) == unit_of(name)) for name in steps}


def rounding_of(columns: Sequence[str], steps: Mapping[str, float]) -> dict[str, float]:
    """Return what rounding leaves of each unit: the root mean square over its columns."""
    squares: dict[str, list[float]] = {}
    for name in columns:
        squares.setdefault(unit_of(name), []).append(steps.get(name, 0.0) ** 2 / 12.0)
    return {unit: math.sqrt(sum(parts) / len(parts)) for unit, parts in squares.items()}


def step_of(values: Array, commands: Array) -> float:
    """Return the step of the grid on which readings lie; 0.0 where they show none.

    Few readings show none, nor do those of a column that hardly moves. Readings with as many digits as a
    number is printed with (`MOST_STEPS`) are taken for continuous. Readings (r,) are NaN where missing;
    `commands` has the shape (r, n).
    """
    there = np.isfinite(values)
    known = np.unique(values[there])
    if len(known) < FEWEST_READINGS:
        return 0.0
    printed = _decimal_step(known)
    within = 0.5 * printed if printed else 1e-9 * float(np.abs(known).max())
    for step in (_counted_step(known, within, commands[there]), printed):
        if step and np.ptp(known) >= FEWEST_STEPS * step and np.abs(known).max() < MOST_STEPS * step:
            return step
    return 0.0


def _on_grid(numbers: Array) -> np.ndarray:
    """Return which numbers are whole, as far as floats can be."""
    return np.abs(numbers - np.rint(numbers)) < 1e-5


def _decimal_step(known: Array) -> float:
    """Return the step of distinct readings that are whole multiples of a decimal one; 0.0: they are not."""
    for places in range(-2, 9):
        unit = 10.0**-places
        near = _on_grid(known / unit)
        if near.mean() >= GRID_SHARE:
            whole = np.rint(known[near] / unit)
            return unit * int(np.gcd.reduce(np.diff(whole).astype(np.int64)))
    return 0.0


def _counted_step(known: Array, within: float, commands: Array) -> float:
    """Return the step of distinct readings at equal distances, whatever it is; 0.0: they are at none.

    The `known` readings, each once, rise; `within` is how near to the grid they are. One reading for each of
    the `commands` (r, n), and no point of the grid left out, is how a model without noise follows a ramp.
    """
    gaps = np.diff(known)
    gaps = gaps[gaps > 4.0 * within]
    if not len(gaps):
        return 0.0
    least = float(gaps.min())
    for parts in (1, 2, 3):
        step = float(gaps[gaps < 1.5 * least].mean()) / parts
        if 2.0 * within > GRID_MISSED_SHARE * step:
            return 0.0
        counts = np.concatenate([[0.0], np.cumsum(np.rint(np.diff(known) / step))])
        step, start = np.polyfit(counts, known, 1)
        if np.abs(start + step * counts - known).max() <= 1.5 * within:
            if len(known) < GRID_FILLED_SHARE * (counts[-1] + 1.0):
                return float(step)
            shared = len(np.unique(commands, axis=0)) >= SHARED_READINGS * len(known)
            return float(step) if shared else 0.0
    return 0.0


# ----------------------------------------------------------------------------------------------------
# Trials whose readings are those of another trial, however their numbers are spelled.

_DIGITS = range(10)  # decimals that a reading may be rounded to


@dataclass(frozen=True)
class Copy:
    """Rows of one trial that are rows of another.

    `first` and `second` are indices of the trials, as they stand in the data set; `rows`, first and last row
    of the second one, counted from 1.
    """

    first: int
    second: int
    rows: tuple[int, int]


def copies_in(dataset: Dataset) -> tuple[Copy, ...]:
    """Return the trials that share rows: the readings agree to the last digit that both have.

    Noise never comes twice. Columns whose noise is less than a few steps of their last digit tell nothing:
    there a repeat gives the same readings. Computed trials may begin alike: all rows of the shorter one must
    be shared.
    """
    found = []
    for (i, first), (j, second) in combinations(enumerate(dataset.trials), 2):
        run = _shared_rows(
            measured_of(first, dataset.output_channels), measured_of(second, dataset.output_channels)
        )
        if run is not None:
            found.append(Copy(i, j, (run[0] + 1, run[0] + run[1])))
    return tuple(found)


def without_copies(dataset: Dataset) -> tuple[Dataset, tuple[Note, ...], tuple[Copy, ...]]:
    """Return the data set with trials that were given twice counted once, notes on them, and other copies.

    Nothing is lost where both trials train, both are held out, or no role is given: the later one is left
    out. Other copies put training rows among the held-out ones.
    """
    copies = copies_in(dataset)
    out: dict[int, str] = {}
    left = []
    for copy in copies:
        first, second = dataset.trials[copy.first], dataset.trials[copy.second]
        if first.role != second.role:
            left.append(copy)
        elif copy.first not in out:
            shorter = copy.second if len(second.inputs) <= len(first.inputs) else copy.first
            other = first if shorter == copy.second else second
            out[shorter] = (
                f"{dataset.trials[shorter].file}: its readings are those of {other.file} to the last digit. "
                "It is a copy, not a repeated measurement, and counts once."
            )
    if not out or len(out) == len(dataset.trials):
        return dataset, (), tuple(left)
    kept = tuple(trial for index, trial in enumerate(dataset.trials) if index not in out)
    notes = tuple(Note("trial_twice", said) for said in out.values())
    return replace(dataset, trials=kept), notes, tuple(left)


def _shared_rows(first: Array, second: Array) -> tuple[int, int] | None:
    """Return where in the second trial the rows of the shorter one begin, and their count; None: nowhere."""
    shorter = min(len(first), len(second))
    if shorter < COPY_ROWS:
        return None
    steps = np.array([max(_last_step(a), _last_step(b)) for a, b in zip(first.T, second.T, strict=True)])
    noise = np.minimum(_noise(first), _noise(second))
    telling = noise > COPY_STEPS * steps
    if not telling.any():
        return None
    best = (0, 0)
    for lag in _lags(first, second, telling, steps):
        low, high = max(0, -lag), min(len(second), len(first) - lag)
        apart = np.abs(first[low + lag : high + lag] - second[low:high])[:, telling]
        same = (~(apart > 0.51 * steps[telling])).all(axis=1) & np.isfinite(apart).any(axis=1)
        start, length = _longest_run(np.asarray(same))
        best = max(best, (length, low + start))
    length, start = best
    return (start, length) if length >= max(COPY_ROWS, shorter - 1) else None


def _lags(first: Array, second: Array, telling: np.ndarray, steps: Array) -> set[int]:
    """Return by how many rows a run in the second trial may stand later in the first."""
    found = set()
    probes = np.unique(np.linspace(0, len(second) - 1, COPY_PROBES).round().astype(int))
    for row in probes.tolist():
        apart = np.abs(first - second[row])[:, telling]
        same = (~(apart > 0.51 * steps[telling])).all(axis=1) & np.isfinite(apart).all(axis=1)
        found |= {int(place) - row for place in np.flatnonzero(same)}
    return found


def _longest_run(same: np.ndarray) -> tuple[int, int]:
    """Return where the longest run of true values begins, and its length."""
    best, start = (0, 0), None
    for index, value in enumerate([*same.tolist(), False]):
        if value and start is None:
            start = index
        elif not value and start is not None:
            best = max(best, (index - start, -start))
            start = None
    return -best[1], best[0]


def _last_step(values: Array) -> float:
    """Return the step of the last decimal that a column's readings have."""
    known = values[np.isfinite(values)]
    for digits in _DIGITS:
        if (np.abs(known - np.round(known, digits)) <= 1e-9 * np.maximum(np.abs(known), 1.0)).all():
            return float(10.0**-digits)
    return float(10.0 ** -_DIGITS[-1])


def _noise(values: Array) -> Array:
    """Return the size of what changes from row to row beyond a slow motion, by column, shape (o,)."""
    bend = np.diff(values, 2, axis=0)
    known = np.isfinite(bend)
    middle = [
        np.median(np.abs(item[mask])) if mask.any() else 0.0
        for item, mask in zip(bend.T, known.T, strict=True)
    ]
    return np.asarray(middle) / np.sqrt(6.0)


# ----------------------------------------------------------------------------------------------------
# Readings that a sensor repeats are taken out: where it is frozen, and where a file repeats the last one.


def without_old_readings(dataset: Dataset) -> tuple[Dataset, tuple[Note, ...]]:
    """Return the data set without rows that repeat the readings of the row before, and what was left out.

    A log that is faster than its sensor gives the last reading again. Where many rows of a trial repeat all
    outputs while the inputs move, all such rows become missing values. A sensor that counts coarsely repeats
    values, too, but these come again elsewhere, or change by single steps.
    """
    notes: list[Note] = []
    trials = []
    steps = resolution_of(dataset)
    for trial in dataset.trials:
        old = _old_rows(trial, steps)
        if old.any():
            columns = {name: np.where(old, np.nan, values) for name, values in trial.outputs.columns.items()}
            trial = replace(trial, outputs=replace(trial.outputs, columns=columns))
            said = (
                f"{trial.file}: {int(old.sum())} of {len(old)} rows repeat all readings of the row before "
                "while the robot is driven, as a slower sensor does. These old readings are taken as missing."
            )
            notes.append(Note("old_readings", said))
        trials.append(trial)
    return (replace(dataset, trials=tuple(trials)) if notes else dataset), tuple(notes)


def _old_rows(trial: Trial, steps: Mapping[str, float]) -> np.ndarray:
    """Return which rows hold the readings of the row before, shape (r,); none where a few do.

    `steps`: of the readings, by column.
    """
    values = np.stack(list(trial.outputs.columns.values()), axis=1)
    drive = all_inputs(trial.inputs)
    same = np.zeros(len(values), dtype=bool)
    same[1:] = (values[1:] == values[:-1]).all(axis=1)
    driven = np.zeros(len(values), dtype=bool)
    driven[1:] = (drive[1:] != drive[:-1]).any(axis=1)
    none = np.zeros(len(values), dtype=bool)
    if not driven.any() or (same & driven).sum() < STALE_SHARE * driven.sum():
        return none
    changes = [np.abs(np.diff(column[np.isfinite(column)])) for column in values.T]
    least = [steps.get(name, 0.0) for name in trial.outputs.columns]
    if all((change <= STEP_BY_STEP * step).all() for change, step in zip(changes, least, strict=True)):
        return none
    # Of the column with the finest readings.
    distinct = max(len(np.unique(column[np.isfinite(column)])) for column in values.T)
    return same if distinct >= STALE_VALUES_SHARE * (~same).sum() else none


def without_frozen_readings(dataset: Dataset) -> tuple[Dataset, tuple[Note, ...]]:
    """Return the data set without the stretches in which a sensor repeats itself, and what was left out.

    A stretch counts where one column holds exactly one value over many rows while the inputs move; the
    repeats become missing values.
    """
    notes: list[Note] = []
    trials = []
    for trial in dataset.trials:
        columns = {}
        for name, values in trial.outputs.columns.items():
            kept = np.array(values)
            for start, end in _frozen_stretches(values, trial.inputs):
                kept[start + 1 : end] = np.nan
                said = (
                    f"{trial.file}: {name} repeats {values[start]:g} from row {start + 1} to {end} while the "
                    "robot is driven. Is it a frozen sensor? These rows are taken as missing."
                )
                notes.append(Note("frozen_sensor", said))
            columns[name] = kept
        trials.append(replace(trial, outputs=replace(trial.outputs, columns=columns)))
    return (replace(dataset, trials=tuple(trials)) if notes else dataset), tuple(notes)


def _frozen_stretches(values: Array, inputs: Inputs) -> Iterator[tuple[int, int]]:
    """Yield stretches of one value, (first row, one past the last), in which the inputs move."""
    drive = all_inputs(inputs)
    span = np.maximum(np.ptp(drive, axis=0), 1e-300)
    longest = max(FROZEN_ROWS, round(FROZEN_SHARE * len(values)))
    start = 0
    for row in range(1, len(values) + 1):
        if row < len(values) and values[row] == values[start]:
            continue
        if row - start >= longest and (np.ptp(drive[start:row], axis=0) / span).max() > FROZEN_DRIVEN_SHARE:
            yield start, row
        start = row
