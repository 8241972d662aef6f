"""How noisy measurements are: from repeats, and from what is white in residuals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from math import comb

import numpy as np

from catheter_sim.core.posture import Array
from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.data.parting import is_repeat
from catheter_sim.diagnosis.data.trials import Trial
from catheter_sim.diagnosis.thresholds import WHITE_CORRELATION

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
        unit: float(np.sqrt(np.mean(np.concatenate(parts)) / 2.0)) for unit, parts in squares.items() if parts
    }


def white_noise(series: Mapping[str, Sequence[Array]]) -> dict[str, float]:
    """Return the white part of residual series, by unit.

    Args:
        series: residuals row by row, by output column: one array per trial, NaN where missing.

    The second difference of a slow series is nearly zero; that of white noise of size s has the size s
    sqrt(6). Its median absolute value keeps jumps out. What moves between rows counts as noise, so that this
    is an upper bound too. Where no three rows in a row are known, as of a sensor slower than its log, the
    known ones stand side by side.
    """
    found: dict[str, list[Array]] = {}
    sparse: dict[str, list[Array]] = {}
    for name, parts in series.items():
        for values in parts:
            found.setdefault(unit_of(name), []).append(_bends(values))
            sparse.setdefault(unit_of(name), []).append(_bends(values[np.isfinite(values)]))
    noise = {}
    for unit, parts in found.items():
        values = np.concatenate(parts)
        if not len(values):
            values = np.concatenate(sparse[unit])
        if len(values):
            noise[unit] = float(_MAD_TO_SIGMA * np.median(np.abs(values)) / np.sqrt(6.0))
    return noise


def _bends(values: Array) -> Array:
    """Return the second differences of a series that are known."""
    bend = values[:-2] - 2.0 * values[1:-1] + values[2:]
    return np.asarray(bend[np.isfinite(bend)])


def noise_from_row_to_row(measured: Sequence[Array]) -> Array:
    """Return the size of what is white in measurements themselves, by column, shape (o,), in file units.

    Of a motion that is slow beside the rows' rate the fourth difference is nearly zero; that of white noise
    of size s has the size s sqrt(70). What moves faster counts as noise.
    """
    bends = np.concatenate([np.diff(values, 4, axis=0) for values in measured])
    size = (
        _MAD_TO_SIGMA * np.nanmedian(np.abs(bends), axis=0) / np.sqrt(sum(comb(4, k) ** 2 for k in range(5)))
    )
    spread = np.nanstd(np.concatenate(measured), axis=0)
    return np.asarray(np.maximum(size, 1e-6 * max(float(spread.max()), 1e-9)))


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
