"""Noise of readings, estimated from the readings themselves, and whether a gain is more than chance."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from scipy.special import stdtrit

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.fit import (
    Fit,
    blocks_of,
    column_of,
    predicted,
    predicted_along,
    residuals,
    untempered,
)
from catheter_sim.diagnosis.problem import Problem
from catheter_sim.diagnosis.readings import rounding_of
from catheter_sim.diagnosis.thresholds import STEP_BY_STEP
from catheter_sim.diagnosis.trials import TIP, Trial, all_inputs, is_repeat, measured_of, unit_of

REPEATED_TIMES = 1.3
"""[times as often as rounded noise repeats a reading] If readings of a held command repeat more often, each
level counts once for the noise. Why: assumed. A hundred rows show the share of repeats to a tenth."""
REPEATED_SHARE = 0.02
"""[share of held rows] Repeats must exceed that by this much more. Why: assumed. So few move a median by less
than the noise itself is known."""
MOST_REPEATED_SHARE = 0.9
"""[share of held rows] If more than this repeat, each level counts once, whatever rounds its readings. Why:
assumed. Nothing is seen of the noise while a command is held."""
CLIPPED_BENDS = 3.0
"""[times the noise] If the noise is less than a step, it is taken from the squares of second differences,
each cut off here. Why: their median is then one of a few numbers, often zero. Normal noise goes no further,
but jumps do."""
DENSE_SHARE = 5e-3
"""[share of an input's range] A log is dense if the robot moves by less over several rows. Its noise is read
from rows that far apart. Why: assumed. No cause makes an error bend within half a percent of the motion."""
DENSE_TIMES = 1.25
"""[times the noise from row to row] The noise of rows further apart counts if it is larger by this. Why:
assumed. White noise is the same at any distance, and that of a filtered sensor grows."""
SMALLEST_NOISE_SHARE = 1e-6
"""[share of the spread of a unit's measurements] No noise is smaller. Why: computed data without any noise
would be infinitely far from every model but one."""
MOST_TIMES = 1e6
"""[times the noise] Larger errors are reported as this. Why: as for `SMALLEST_NOISE_SHARE`."""
LEAST_SQUARE_SHARE = 1e-12
"""[share of a trial's largest sum of squared errors] A smaller sum counts as this. Why: a model without any
error has a gain too, and its logarithm must be finite."""
SIGN_DRAWS = 4096
"""[draws] If the stretches' signs can be turned in more ways, this many are drawn in place of all. Why: a
chance of 2.3 % is then known to a quarter of a percent."""
WHITE_CORRELATION = 0.3
"""[correlation of neighbouring rows] Residuals with less show no structure from row to row. Why: assumed. A
hundred rows of noise surely stay below it."""

# ----------------------------------------------------------------------------------------------------
# What a fitted hypothesis is worth on trials, such as held-out ones: errors by unit, and how sure a gain
# is.


def errors_of(problem: Problem, fit: Fit) -> Array:
    """Return model minus measurement of a fitted hypothesis on `problem`'s trials, in file units, (n,)."""
    return untempered(residuals(problem, fit.numbers, fit.x[None])[0]) * problem.weight[column_of(problem)]


def outputs_of(problem: Problem, trial: Trial, result: Fit) -> Array:
    """Return a fitted hypothesis's outputs along a trial, shape (r, o)."""
    return predicted(problem, result.numbers, result.x, trial.inputs)


def residual_series(problem: Problem, result: Fit) -> dict[str, list[Array]]:
    """Return model minus measurement by output column, one array per trial."""
    series: dict[str, list[Array]] = {name: [] for name in problem.columns}
    inputs = [trial.inputs for trial in problem.trials]
    computed = predicted_along(problem, result.numbers, result.x, inputs)
    for trial, outputs in zip(problem.trials, computed, strict=True):
        error = outputs - measured_of(trial, problem.columns)
        for index, name in enumerate(problem.columns):
            series[name].append(error[:, index])
    return series


def rmse_by_unit(problem: Problem, errors: Array) -> dict[str, float]:
    """Return the root mean square error over all outputs of each unit."""
    units = np.array([unit_of(name) for name in problem.columns])[column_of(problem)]
    return {
        str(unit): float(np.sqrt(np.mean(errors[units == unit] ** 2)))
        for unit in dict.fromkeys(units.tolist())
    }


def gain_percent(before: float, after: float) -> float:
    """Return by how much an error has fallen, in percent of what it was."""
    return 100.0 * (1.0 - after / before) if before > 0.0 else 0.0


def stretch_squares(problem: Problem, before: Array, after: Array, unit: str) -> list[Array]:
    """Return each trial's sums of squared errors by stretch, before and after, shape (c, 2) each.

    A stretch is a whole cycle, or a part of one where there are few (`stretches.blocks_of`). `before` and
    `after` are as from `errors_of`; outputs of this `unit` count.
    """
    result: list[Array] = []
    start = 0
    for trial in problem.trials:
        alone = replace(problem, trials=(trial,))
        columns = column_of(alone)
        mine = np.array([unit_of(name) == unit for name in alone.columns])[columns]
        part = slice(start, start + len(columns))
        start += len(columns)
        if mine.any():
            labels = np.unique(blocks_of(alone)[mine], return_inverse=True)[1]
            sums = [np.bincount(labels, weights=errors[part][mine] ** 2) for errors in (before, after)]
            result.append(np.stack(sums, axis=1).astype(float))
    return result


def gain_interval(held: Sequence[Array], others: Sequence[Array] = ()) -> tuple[float, float]:
    """Return the interval in which the gain on as many other trials would lie, 95 % [%].

    Squared errors of trials differ by factors, so that the interval is worked out on the logarithm of the
    squares after over those before. Half of it is Student's t, times the logarithm's spread from trial to
    trial, over the root of the number of held-out trials, times sqrt(2), since the held-out gain is one such
    draw itself. Trials differ by more than their cycles do, and few are held out, so that the spread is taken
    from all trials. With fewer than three trials, held-out stretches stand in for them; with a single stretch
    nothing is known. Both are as from `stretch_squares`; `others` are of the training trials.
    """
    pool, count = np.array([trial.sum(axis=0) for trial in (*held, *others)]), len(held)
    if len(pool) < 3:
        pool = np.concatenate(held)
        count = len(pool)
    number = len(pool)
    own = np.concatenate(held).sum(axis=0)
    if number < 2 or own[0] <= 0.0:
        return float("nan"), float("nan")
    pool = np.maximum(pool, LEAST_SQUARE_SHARE * pool.max())  # a model without any error has a gain too
    spread = float(np.log(pool[:, 1] / pool[:, 0]).std(ddof=1)) * np.sqrt(2.0 / count)
    reach = float(np.exp(stdtrit(number - 1, 0.975) * spread))
    ratio = float(own[1] / own[0])
    low, high = (100.0 * (1.0 - np.sqrt(end)) for end in (ratio * reach, ratio / reach))
    return float(low), float(high)


def chance_of_gain(change: Array) -> float:
    """Return how probable it is that squared errors fall by as much where there is no gain.

    The signs of the stretches' falls are turned in every way, or in `SIGN_DRAWS` ways at random. The chance
    is the share of the ways with as large a fall. So a few stretches that gain much do not hide what the
    others do. `change`: squared error before minus after, by stretch, shape (c,).
    """
    count = len(change)
    if 2**count <= SIGN_DRAWS:
        signs = np.array(list(itertools.product((-1.0, 1.0), repeat=count)))
    else:
        signs = np.random.default_rng(0).choice((-1.0, 1.0), size=(SIGN_DRAWS, count))
    total = float(change.sum())
    return float(np.mean(signs @ change >= total - 1e-9 * abs(total)))


def tip_errors(columns: Mapping[str, Sequence[tuple[Array, Array]]]) -> dict[str, float]:
    """Return the tip's distance errors: RMSE and mean, as they are and with the mean offset taken out.

    `columns`: by `TIP` column, (model, measured) of each trial, shape (r,) each, NaN where missing.
    """
    parts = [
        np.stack([columns[name][index][0] - columns[name][index][1] for name in TIP], axis=1)
        for index in range(len(columns[TIP[0]]))
    ]
    error = np.concatenate(parts)
    error = error[np.isfinite(error).all(axis=1)]
    aligned = error - error.mean(axis=0)
    return {
        "tip_distance_rmse_{}_mm": float(np.sqrt((error**2).sum(axis=1).mean())),
        "tip_distance_rmse_aligned_{}_mm": float(np.sqrt((aligned**2).sum(axis=1).mean())),
        "tip_distance_mean_aligned_{}_mm": float(np.sqrt((aligned**2).sum(axis=1)).mean()),
    }


# ----------------------------------------------------------------------------------------------------
# How noisy measurements are: from repeats, from what is white in residuals, from what rounding leaves.

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
    known ones stand side by side. It is no less than what rounding leaves. `series`: residuals row by row, by
    output column, one array per trial, NaN where missing. With `trials`, readings that are held for several
    rows count once, and a dense log is read from rows further apart. `steps`: of the readings, by column
    (`steps_of`).
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

    NaN: missing. `rounding`: what the readings' resolution leaves; `apart`: rows from one value to the next,
    of each series, None: 1.
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
    `changes`: from row to row under one command, in steps.
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

    Residuals row by row, NaN where missing.
    """
    product, square = 0.0, 0.0
    for values in series:
        centred = values - np.nanmean(values)
        pair = centred[:-1] * centred[1:]
        keep = np.isfinite(pair)
        product += float(pair[keep].sum())
        square += float((0.5 * (centred[:-1] ** 2 + centred[1:] ** 2))[keep].sum())
    return square == 0.0 or product / square < limit
