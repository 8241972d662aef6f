"""A scan of one or two numbers over their whole ranges: the nearest minimum need not be the least."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from catheter_sim.core.posture import Array
from catheter_sim.diagnosis.fitting.prior import Prior
from catheter_sim.diagnosis.fitting.problem import FittedNumber, Problem
from catheter_sim.diagnosis.fitting.residuals import residuals
from catheter_sim.diagnosis.thresholds import GRID_VALUES, ROWS_TO_SCAN_BY


def best_of_grid(
    problem: Problem, numbers: Sequence[FittedNumber], x: Array, box: tuple[Array, Array], prior: Prior
) -> Array:
    """Return the best of `x` and of a grid over the effects' numbers, between the bounds.

    It shows in which of several minima a fit should start, for which few trials do (`ROWS_TO_SCAN_BY`).
    """
    mine = [index for index, fitted in enumerate(numbers) if fitted.effect]
    if not 0 < len(mine) <= len(GRID_VALUES):
        return x
    count = GRID_VALUES[len(mine) - 1]
    places = np.stack(np.meshgrid(*[(np.arange(count) + 0.5) / count] * len(mine)), axis=-1)
    points = np.repeat(x[None], count ** len(mine) + 1, axis=0)
    low, high = (bound[mine] for bound in box)
    points[1:, mine] = low + places.reshape(-1, len(mine)) * (high - low)
    costs = (residuals(_fewest_trials(problem), numbers, points) ** 2).sum(axis=1)
    return points[int(np.argmin(costs + np.array([prior.cost(point) for point in points])))]


def _fewest_trials(problem: Problem) -> Problem:
    """Return `problem` with as few of its trials, spread over all, as a scan needs."""
    rows = sum(len(trial.inputs) for trial in problem.trials) / problem.every
    count = min(len(problem.trials), math.ceil(len(problem.trials) * ROWS_TO_SCAN_BY / max(rows, 1.0)))
    places = np.linspace(0, len(problem.trials) - 1, max(count, 1)).round().astype(int)
    return replace(problem, trials=tuple(problem.trials[place] for place in places))
