"""The resolution of readings: the step of the grid on which they lie.

A log that is rounded to so many decimals has one, and so has a sensor that counts (an encoder, pixels). No
model's error falls below step / sqrt(12), the root mean square of what rounding takes away.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.data.trials import Dataset, Trial, all_inputs
from catheter_sim.diagnosis.thresholds import (
    FEWEST_READINGS,
    FEWEST_STEPS,
    GRID_FILLED_SHARE,
    GRID_MISSED_SHARE,
    GRID_SHARE,
    MOST_STEPS,
    SHARED_READINGS,
)


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
    number is printed with (`MOST_STEPS`) are taken for continuous.

    Args:
        values: readings, shape (r,), NaN where missing.
        commands: what was commanded, shape (r, n).
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

    Args:
        known: readings, each once, rising.
        within: how near to the grid they are.
        commands: that led to them, shape (r, n). One reading for every command, and no point of the grid left
            out, is how a model without noise follows a ramp.
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
