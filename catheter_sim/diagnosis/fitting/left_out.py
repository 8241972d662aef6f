"""What a fit predicts for rows that it was not fitted to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catheter_sim.core.posture import Array
from catheter_sim.diagnosis.fitting.least_squares import damped_step, descend
from catheter_sim.diagnosis.fitting.prior import prior_of
from catheter_sim.diagnosis.fitting.problem import FittedNumber, Problem
from catheter_sim.diagnosis.fitting.residuals import residuals
from catheter_sim.diagnosis.fitting.stretches import fold_of
from catheter_sim.diagnosis.thresholds import FOLD_CONVERGED, FOLD_STEP_PARTS


def left_out_residuals(
    problem: Problem,
    numbers: Sequence[FittedNumber],
    x: Array,
    error: Array,
    jacobian: Array,
    block: np.ndarray,
    box: tuple[Array, Array],
) -> Array:
    """Return the residual of each fold under the parameters fitted without it, shape (n,).

    Those parameters are one Gauss-Newton step away from the fit to all rows. Where the model is so nonlinear
    that the whole step would raise the error on the rows kept, they are a part of the step away; where any
    part would raise it, the rows kept are fitted anew. The residual itself is computed with the full model.
    """
    fold = fold_of(block)
    chosen = np.unique(fold)
    prior = prior_of(numbers)
    keeps = [fold != index for index in chosen]
    steps = np.array([damped_step(jacobian[keep], error[keep], x, box, 1e-9, prior) for keep in keeps])
    errors = np.repeat(error[None], len(chosen), axis=0)
    least = np.array([float(error[keep] @ error[keep]) + prior.cost(x) for keep in keeps])
    waiting = np.arange(len(chosen))
    for part in FOLD_STEP_PARTS:
        points = np.clip(x + part * steps[waiting], *box)
        found = residuals(problem, numbers, points)
        costs = [
            float((found[k][keeps[i]] ** 2).sum()) + prior.cost(points[k]) for k, i in enumerate(waiting)
        ]
        better = np.array(costs) <= least[waiting]
        errors[waiting[better]] = found[better]
        waiting = waiting[~better]
        if not len(waiting):
            break
    for i in waiting:
        known = error, jacobian
        without = descend(problem, numbers, x, box, prior, keeps[i], known, 1.0, FOLD_CONVERGED)
        errors[i] = residuals(problem, numbers, without[None])[0]
    left_out = error.copy()
    for position, index in enumerate(chosen):
        left_out[fold == index] = errors[position][fold == index]
    return left_out
