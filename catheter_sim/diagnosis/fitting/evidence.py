"""What a fitted hypothesis is worth on trials, such as held-out ones: errors by unit, and how sure a gain
is."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import stdtrit

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.data.columns import TIP, unit_of
from catheter_sim.diagnosis.data.trials import Trial, measured_of
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.gross_errors import untempered
from catheter_sim.diagnosis.fitting.prediction import predicted, predicted_along
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.fitting.residuals import column_of, residuals
from catheter_sim.diagnosis.fitting.stretches import blocks_of
from catheter_sim.diagnosis.thresholds import LEAST_SQUARE_SHARE, SIGN_DRAWS


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

    A stretch is a whole cycle, or a part of one where there are few (`stretches.blocks_of`).

    Args:
        problem: the trials.
        before, after: errors as from `errors_of`.
        unit: outputs of this unit count.
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
    nothing is known.

    Args:
        held: of the held-out trials, as from `stretch_squares`.
        others: of the training trials.
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
    others do.

    Args:
        change: squared error before minus after, by stretch, shape (c,).
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

    Args:
        columns: by `TIP` column, (model, measured) of each trial, shape (r,) each, NaN where missing.
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
