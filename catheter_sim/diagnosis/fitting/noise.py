"""How noisy measurements are: from repeats, from what is white in residuals, from what rounding leaves."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.data.parting import is_repeat
from catheter_sim.diagnosis.data.resolution import rounding_of
from catheter_sim.diagnosis.data.trials import Trial, all_inputs, measured_of
from catheter_sim.diagnosis.fitting.evidence import residual_series
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.thresholds import (
    CLIPPED_BENDS,
    DENSE_SHARE,
    DENSE_TIMES,
    MOST_REPEATED_SHARE,
    MOST_TIMES,
    REPEATED_SHARE,
    REPEATED_TIMES,
    SMALLEST_NOISE_SHARE,
    STEP_BY_STEP,
    WHITE_CORRELATION,
)

_MAD_TO_SIGMA = 1.4826  # of a normal distribution


def repeat_noise(trials: Sequence[Trial], columns: Sequence[str]) -> dict[str, float]:
    """Return the noise of each unit from trials that repeat one another; empty without repeats.

    Its square is half the mean square of the difference of two repeats. What slips at random differs between
    repeats by more than noise, so that this is an upper bound.
    """
    squares: dict[str, list[Array]] = {}
    for first, second in combinations(trials, 2):
        if not is_repeat(first, second):
            continue
        for name in columns:
            difference = first.outputs.columns[name] - second.outputs.columns[name]
            squares.setdefault(unit_of(name), []).append(difference[np.isfinite(difference)] ** 2)
    return {
        unit: float(np.sqrt(np.mean(np.concatenate(parts)) / 2.0))
        for unit, parts in squares.items()
        if any(len(part) for part in parts)
    }


def white_noise(
    series: Mapping[str, Sequence[Array]],
    trials: Sequence[Trial] = (),
    steps: Mapping[str, float] | None = None,
) -> dict[str, float]:
    """Return the white part of residual series, by unit.

    The second difference of a slow series is nearly zero; that of white noise of size s has the size s
    sqrt(6). Its median absolute value keeps jumps out. What moves between rows counts as noise, so that this
    is an upper bound too. Where no three rows in a row are known, as of a sensor slower than its log, the
    known ones stand side by side. It is no less than what rounding leaves.

    Args:
        series: residuals row by row, by output column: one array per trial, NaN where missing.
        trials: what was measured. Readings that are held for several rows then count once, and a dense log is
            read from rows further apart.
        steps: of the readings, by column (`resolution.steps_of`).
    """
    steps = steps or {}
    rounding = rounding_of(tuple(series), steps)
    noise = {}
    for unit, least in rounding.items():
        mine = {name: parts for name, parts in series.items() if unit_of(name) == unit}
        parts = [values for found in mine.values() for values in found]
        size = _size(parts, least)
        if size is not None:
            noise[unit] = _of_readings(mine, trials, steps, size, least) if trials else size
    return noise


def least_noise(problem: Problem) -> dict[str, float]:
    """Return what the noise of each unit is at least, never zero: what the readings' resolution leaves."""
    found = rounding_of(problem.columns, problem.resolution)
    measured = np.concatenate([measured_of(trial, problem.columns) for trial in problem.trials])
    for unit, rounding in found.items():
        mine = measured[:, [unit_of(name) == unit for name in problem.columns]]
        spread = max((np.nanstd(column) for column in mine.T if np.isfinite(column).any()), default=0.0)
        found[unit] = max(rounding, SMALLEST_NOISE_SHARE * max(float(spread), 1e-3))
    return found


def residual_noise(problem: Problem, result: Fit) -> dict[str, float]:
    """Return the white part of a hypothesis's residuals on a problem's trials, by unit."""
    least = least_noise(problem)
    found = white_noise(residual_series(problem, result), problem.trials, problem.resolution)
    return {unit: max(size, least[unit]) for unit, size in found.items()}


def times_noise(error: float, noise: float) -> float:
    """Return how many times the noise an error is, at most `MOST_TIMES`; 0 where there is no error."""
    if not error > 0.0:
        return error if math.isnan(error) else 0.0
    return min(error / noise, MOST_TIMES) if noise > error / MOST_TIMES else MOST_TIMES


def _size(parts: Sequence[Array], rounding: float, apart: Sequence[int] | None = None) -> float | None:
    """Return the size of what is white in series; None: too little is known.

    Args:
        parts: the series, NaN where missing.
        rounding: what the readings' resolution leaves.
        apart: rows from one value to the next, of each series; None: 1.
    """
    apart = apart or [1] * len(parts)
    bends = np.concatenate([_bends(values, rows) for values, rows in zip(parts, apart, strict=True)])
    if not len(bends):
        bends = np.concatenate([_bends(values[np.isfinite(values)]) for values in parts])
    if not len(bends):
        return None
    size = float(_MAD_TO_SIGMA * np.median(np.abs(bends)) / np.sqrt(6.0))
    if size < rounding * math.sqrt(12.0):
        most = CLIPPED_BENDS * math.sqrt(6.0) * max(size, rounding)
        size = float(np.sqrt(np.mean(np.clip(bends, -most, most) ** 2) / 6.0))
    return max(size, rounding)


def _bends(values: Array, apart: int = 1) -> Array:
    """Return the second differences of a series that are known, of values so many rows apart."""
    bend = values[: -2 * apart] - 2.0 * values[apart:-apart] + values[2 * apart :]
    return np.asarray(bend[np.isfinite(bend)])


def _of_readings(
    series: Mapping[str, Sequence[Array]],
    trials: Sequence[Trial],
    steps: Mapping[str, float],
    size: float,
    rounding: float,
) -> float:
    """Return the noise of one unit, given that from row to row, with held readings and dense logs in mind."""
    parts, once, changes = [], [], []
    for name, found in series.items():
        for values, trial in zip(found, trials, strict=True):
            known = np.isfinite(trial.outputs.columns[name])
            last, change = _held_rows(trial, name, known, steps.get(name, 0.0))
            parts.append(values)
            once.append(values[known][last])
            changes.append(change)
    if _says_nothing(np.concatenate(changes)):
        size = _size(once, rounding) or size
    apart = [_rows_apart(trial) for _ in series for trial in trials]
    further = _size(parts, rounding, apart) if max(apart) > 1 else None
    return further if further is not None and further > DENSE_TIMES * size else size


def _held_rows(trial: Trial, name: str, known: np.ndarray, step: float) -> tuple[np.ndarray, Array]:
    """Return which known readings are the last of a held command, and how readings change within one.

    Changes are in steps, infinite where the readings have none. A column that never moves has none at all.
    """
    drive, values = all_inputs(trial.inputs)[known], trial.outputs.columns[name][known]
    held = (drive[1:] == drive[:-1]).all(axis=1)
    last = np.append(~held, [True] * (len(values) > 0))
    change = np.abs(np.diff(values))
    same = change <= 1e-9 * float(np.abs(values).max(initial=0.0))
    change = np.where(same, 0.0, change / step if step else np.inf)
    return last, change[held] if not same.all() else change[:0]


def _says_nothing(changes: Array) -> bool:
    """Return whether readings of held commands repeat more often than rounded noise does.

    Then each level counts once, by its last row: its readings are one, written several times. Differences of
    size s, in steps, are within the step that rounding takes away with the probability 1 / (s sqrt(2 pi)).

    Args:
        changes: of readings of one command from row to row, in steps.
    """
    if not len(changes):
        return False
    repeated = float(np.mean(changes == 0.0))
    if repeated > MOST_REPEATED_SHARE:
        return True
    typical = float(np.median(changes[changes > 0.0]))
    if typical <= STEP_BY_STEP:
        return False  # the last digit flickers: that is noise
    expected = 1.0 / (_MAD_TO_SIGMA * typical * math.sqrt(2.0 * math.pi))
    return repeated > REPEATED_TIMES * expected + REPEATED_SHARE


def _rows_apart(trial: Trial) -> int:
    """Return over how many rows the robot is driven by `DENSE_SHARE`, at least; 1: the log is not dense."""
    drive = all_inputs(trial.inputs)
    span = np.ptp(drive, axis=0)
    moves = np.abs(np.diff(drive, axis=0))[:, span > 0.0] / span[span > 0.0]
    most = float(moves.max(initial=0.0))
    return max(1, int(DENSE_SHARE / most)) if most > 0.0 else 1


def noise_from_row_to_row(measured: Sequence[Array], steps: Sequence[float] = ()) -> Array:
    """Return the size of what is white in measurements themselves, by column, shape (o,), in file units.

    Of a motion that is slow beside the rows' rate the fourth difference is nearly zero; that of white noise
    of size s has the size s sqrt(70). What moves faster counts as noise. `steps`: of each column's readings,
    0 where they show none.
    """
    bends = np.concatenate([np.diff(values, 4, axis=0) for values in measured])
    size = (
        _MAD_TO_SIGMA
        * np.nanmedian(np.abs(bends), axis=0)
        / np.sqrt(sum(math.comb(4, k) ** 2 for k in range(5)))
    )
    spread = np.nanstd(np.concatenate(measured), axis=0)
    rounding = np.array(steps or np.zeros_like(size)) / math.sqrt(12.0)
    return np.maximum(np.maximum(size, rounding), 1e-6 * max(float(spread.max()), 1e-9))


def noise_floor(white: Mapping[str, float], repeats: Mapping[str, float]) -> dict[str, float]:
    """Return the smaller estimate of each unit."""
    return {unit: min(value, repeats.get(unit, value)) for unit, value in white.items()}


def is_white(series: Sequence[Array], limit: float = WHITE_CORRELATION) -> bool:
    """Return whether neighbours in residual series are correlated by less than `limit` (lag one).

    Args:
        series: residuals row by row, NaN where missing.
        limit: correlation above which residuals are structured.
    """
    product, square = 0.0, 0.0
    for values in series:
        centred = values - np.nanmean(values)
        pair = centred[:-1] * centred[1:]
        keep = np.isfinite(pair)
        product += float(pair[keep].sum())
        square += float((0.5 * (centred[:-1] ** 2 + centred[1:] ** 2))[keep].sum())
    return square == 0.0 or product / square < limit
