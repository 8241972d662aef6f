"""Trials whose readings are those of another trial, however their numbers are spelled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.data.trials import Dataset, Trial, measured_of
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.thresholds import COPY_PROBES, COPY_ROWS, COPY_STEPS

_DIGITS = range(10)  # decimals that a reading may be rounded to


@dataclass(frozen=True)
class Copy:
    """Rows of one trial that are rows of another.

    Attributes:
        first, second: indices of the trials, as they stand in the data set.
        rows: first and last row of the second one, counted from 1.
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


def files_of(trials: Sequence[Trial], copy: Copy) -> tuple[str, str]:
    """Return the names of a copy's two trials."""
    return trials[copy.first].file, trials[copy.second].file
