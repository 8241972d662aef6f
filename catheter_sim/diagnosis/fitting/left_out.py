"""What a fit predicts for rows that it was not fitted to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.fitting.least_squares import Linearised, damped_step, descend
from catheter_sim.diagnosis.fitting.prior import Prior, prior_of
from catheter_sim.diagnosis.fitting.problem import FittedNumber, Problem
from catheter_sim.diagnosis.fitting.residuals import residuals
from catheter_sim.diagnosis.fitting.stretches import fold_of
from catheter_sim.diagnosis.thresholds import (
    FOLD_CONVERGED,
    FOLD_FIRST_ORDER,
    FOLD_STEP_PARTS,
    MOST_FOLD_STEPS,
    NO_DAMPING,
)


def left_out_residuals(
    problem: Problem,
    numbers: Sequence[FittedNumber],
    at: Linearised,
    block: np.ndarray,
    box: tuple[Array, Array],
    well: bool = True,
) -> Array:
    """Return the residual of each fold under the parameters fitted without it, shape (n,).

    Those parameters are one Gauss-Newton step away from the fit to all rows. Where this step hardly changes
    the rows left out (`FOLD_FIRST_ORDER`), the derivative gives their residuals; otherwise they are computed
    with the full model: where the whole step would raise the error on the rows kept, a part of the step away,
    and where any part would raise it, with the rows kept fitted anew; unless `well`, as fitted to all rows.
    """
    fold = fold_of(block)
    prior = prior_of(numbers)
    keeps = [fold != index for index in np.unique(fold)]
    steps = np.array([damped_step(at, box, NO_DAMPING, prior, keep) for keep in keeps])
    steps = np.clip(at.x + steps, *box) - at.x
    errors = at.error + steps @ at.jacobian.T
    far = []
    for index, keep in enumerate(keeps):
        change, size = (np.linalg.norm(part[~keep]) for part in (errors[index] - at.error, at.error))
        if change > FOLD_FIRST_ORDER * size:
            far.append(index)
    if far:
        kept = [keeps[index] for index in far]
        errors[far] = _with_the_full_model(problem, numbers, at, steps[far], kept, box, prior, well)
    left_out = at.error.copy()
    for keep, without in zip(keeps, errors, strict=True):
        left_out[~keep] = without[~keep]
    return left_out


def _with_the_full_model(
    problem: Problem,
    numbers: Sequence[FittedNumber],
    at: Linearised,
    steps: Array,
    keeps: Sequence[np.ndarray],
    box: tuple[Array, Array],
    prior: Prior,
    well: bool,
) -> Array:
    """Return all residuals under the parameters fitted to the rows that each of `keeps` keeps, (k, n)."""
    errors = np.repeat(at.error[None], len(keeps), axis=0)
    least = np.array([float(at.error[keep] @ at.error[keep]) + prior.cost(at.x) for keep in keeps])
    waiting: np.ndarray = np.arange(len(keeps))
    for part in FOLD_STEP_PARTS:
        points = np.clip(at.x + part * steps[waiting], *box)
        found = residuals(problem, numbers, points)
        costs = [
            float((found[k][keeps[i]] ** 2).sum()) + prior.cost(points[k])
            for k, i in enumerate(waiting.tolist())
        ]
        better = np.array(costs) <= least[waiting]
        errors[waiting[better]] = found[better]
        waiting = waiting[~better]
        if not len(waiting):
            break
    for i in waiting.tolist() if well else ():
        without = descend(
            problem, numbers, at, box, prior, keeps[i], 1.0, FOLD_CONVERGED, MOST_FOLD_STEPS, exact=False
        )
        errors[i] = without.error
    return errors
