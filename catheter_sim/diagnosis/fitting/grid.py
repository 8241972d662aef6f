"""A scan of one or two numbers over their whole ranges: the nearest minimum need not be the least.

More numbers, one of each channel say, are scanned one at a time about where they start.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.fitting.prior import Prior
from catheter_sim.diagnosis.fitting.problem import FittedNumber, Problem, start_of
from catheter_sim.diagnosis.fitting.residuals import residuals
from catheter_sim.diagnosis.thresholds import GRID_VALUES, ROWS_TO_SCAN_BY, SCANNED_SIZES


def best_of_grid(
    problem: Problem,
    numbers: Sequence[FittedNumber],
    x: Array,
    box: tuple[Array, Array],
    prior: Prior,
    known: Collection[tuple[str, str]] = (),
) -> Array:
    """Return the best of `x` and of a grid over the effects' numbers, between the bounds.

    It shows in which of several minima a fit should start, for which few trials do (`ROWS_TO_SCAN_BY`).

    Args:
        problem: trials and twin.
        numbers: what is fitted.
        x: where the fit would start, shape (p,).
        box: lower and upper bounds, shape (p,) each.
        prior: of the numbers.
        known: by effect and parameter, the numbers of which `x` is more than a first guess: of many numbers
            the others alone are scanned.
    """
    mine = [index for index, fitted in enumerate(numbers) if fitted.effect]
    if not mine:
        return x
    if len(mine) > len(GRID_VALUES):
        if problem.moving:  # each costs seconds
            return x
        return _best(problem, numbers, _one_at_a_time(numbers, mine, x, box, known), prior)
    count = GRID_VALUES[len(mine) - 1]
    places = np.stack(np.meshgrid(*[(np.arange(count) + 0.5) / count] * len(mine)), axis=-1)
    points = np.repeat(x[None], count ** len(mine) + 1, axis=0)
    low, high = (bound[mine] for bound in box)
    points[1:, mine] = low + places.reshape(-1, len(mine)) * (high - low)
    return _best(problem, numbers, points, prior)


def _one_at_a_time(
    numbers: Sequence[FittedNumber],
    mine: Sequence[int],
    x: Array,
    box: tuple[Array, Array],
    known: Collection[tuple[str, str]],
) -> Array:
    """Return `x`, and it with one number at a time at another size and no other effect's number, (k, p)."""
    fresh = [index for index in mine if numbers[index].key not in known]
    still = start_of(numbers, {item.key: item.parameter.null for item in numbers})
    nothing = x.copy()
    nothing[fresh] = still[fresh]
    points = [x]
    for index in fresh:
        for size in SCANNED_SIZES:
            point = nothing.copy()
            point[index] += size
            points.append(np.clip(point, *box))
    return np.array(points)


def _best(problem: Problem, numbers: Sequence[FittedNumber], points: Array, prior: Prior) -> Array:
    """Return the one of `points` (k, p) that costs least on few trials, shape (p,)."""
    if len(points) == 1:
        return points[0]
    costs = (residuals(_fewest_trials(problem), numbers, points) ** 2).sum(axis=1)
    return points[int(np.argmin(costs + np.array([prior.cost(point) for point in points])))]


def _fewest_trials(problem: Problem) -> Problem:
    """Return `problem` with as few of its trials, spread over all, as a scan needs."""
    rows = sum(len(trial.inputs) for trial in problem.trials) / problem.every
    count = min(len(problem.trials), math.ceil(len(problem.trials) * ROWS_TO_SCAN_BY / max(rows, 1.0)))
    places = np.linspace(0, len(problem.trials) - 1, max(count, 1)).round().astype(int)
    return replace(problem, trials=tuple(problem.trials[place] for place in places))
