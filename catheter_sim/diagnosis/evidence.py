"""What a hypothesis is worth on held-out trials: errors by unit, and how sure the gain is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from catheter_sim.diagnosis.fit import Fit
from catheter_sim.diagnosis.hypothesis import Problem, blocks_of, column_of, residuals
from catheter_sim.diagnosis.trials import unit_of
from catheter_sim.robots.posture import Array

BOOTSTRAPS = 2000
TIP = ("tip_x_mm", "tip_y_mm", "tip_z_mm")


def errors_of(problem: Problem, fit: Fit) -> Array:
    """Return model minus measurement of a fitted hypothesis on `problem`'s trials, in file units, (n,)."""
    return residuals(problem, fit.frees, fit.x[None])[0] * problem.weight[column_of(problem)]


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


def gain_interval(
    problem: Problem, before: Array, after: Array, unit: str, seed: int = 0
) -> tuple[float, float]:
    """Return the 95 % interval of the gain [%], from drawing whole cycles with replacement.

    Args:
        problem: the held-out trials.
        before, after: errors as from `errors_of`.
        unit: outputs of this unit count.
        seed: of the draws.
    """
    mine = np.array([unit_of(name) == unit for name in problem.columns])[column_of(problem)]
    labels = np.unique(blocks_of(problem)[mine], return_inverse=True)[1]
    squares = [np.bincount(labels, weights=errors[mine] ** 2) for errors in (before, after)]
    count = len(squares[0])
    if count < 2:
        return float("nan"), float("nan")
    draws = np.random.default_rng(seed).integers(0, count, size=(BOOTSTRAPS, count))
    sums = [np.maximum(part[draws].sum(axis=1), 1e-300) for part in squares]
    gains = 100.0 * (1.0 - np.sqrt(sums[1] / sums[0]))
    low, high = np.percentile(gains, [2.5, 97.5])
    return float(low), float(high)


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
