"""Least squares between bounds: Levenberg-Marquardt for fits, a trust region along valleys."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares

from catheter_sim.core.posture import Array
from catheter_sim.diagnosis.fitting.prior import Prior
from catheter_sim.diagnosis.fitting.problem import FittedNumber, Problem
from catheter_sim.diagnosis.fitting.residuals import residuals
from catheter_sim.diagnosis.thresholds import (
    DERIVATIVE_STEP,
    FIT_CONVERGED,
    LONGEST_STEP,
    MOST_FIT_STEPS,
    MOST_VALLEY_TRIALS,
    NEAR_BOUND,
    NO_INFLUENCE,
)


def descend(
    problem: Problem,
    numbers: Sequence[FittedNumber],
    x: Array,
    box: tuple[Array, Array],
    prior: Prior,
    keep: np.ndarray | slice = slice(None),
    known: tuple[Array, Array] | None = None,
    damping: float = 1e-3,
    converged: float = FIT_CONVERGED,
) -> Array:
    """Return a smaller sum of squares than at `x` by Levenberg-Marquardt, five dampings at a time.

    Numbers at a bound that the gradient pushes outward are held. Of the residuals, only `keep` count.
    `known` is the residual at `x` with its derivative, where these were worked out already; `damping` is
    what the first step is tried with.
    """
    low, high = box
    error, jacobian = (item[keep] for item in known or linearised(problem, numbers, x, high))
    cost = float(error @ error) + prior.cost(x)
    for _ in range(MOST_FIT_STEPS):
        candidates = np.array(
            [
                np.clip(x + damped_step(jacobian, error, x, box, factor, prior), low, high)
                for factor in damping * np.array([0.1, 1.0, 10.0, 100.0, 1e4])
            ]
        )
        costs = (residuals(problem, numbers, candidates)[:, keep] ** 2).sum(axis=1)
        costs += np.array([prior.cost(point) for point in candidates])
        best = int(np.argmin(costs))
        if not costs[best] < cost:
            break
        gained = cost - float(costs[best])
        x, cost = candidates[best], float(costs[best])
        damping = float(np.clip(damping * 10.0 ** (best - 1), 1e-6, 1e6))
        if gained < converged * cost:
            break
        error, jacobian = (item[keep] for item in linearised(problem, numbers, x, high))
    return x


def descend_valley(
    problem: Problem, numbers: Sequence[FittedNumber], x: Array, box: tuple[Array, Array], prior: Prior
) -> Array:
    """Return the least sum of squares near `x` by a trust region in the box (`scipy.optimize`)."""
    low, high = box
    root = np.sqrt(prior.precision)
    inside = np.clip(x, low + NEAR_BOUND, high - NEAR_BOUND)

    def value(point: Array) -> Array:
        return np.concatenate([residuals(problem, numbers, point[None])[0], root * (point - prior.middle)])

    def slope(point: Array) -> Array:
        return np.concatenate([linearised(problem, numbers, point, high)[1], np.diag(root)])

    found = least_squares(value, inside, slope, bounds=box, ftol=1e-7, xtol=1e-6, max_nfev=MOST_VALLEY_TRIALS)
    at_bound = np.where(found.x - low < 2.0 * NEAR_BOUND, low, found.x)
    return np.where(high - found.x < 2.0 * NEAR_BOUND, high, at_bound)


def linearised(
    problem: Problem, numbers: Sequence[FittedNumber], x: Array, high: Array
) -> tuple[Array, Array]:
    """Return the residual (n,) and its derivative by differences (n, p), backward near `high` (p,)."""
    step = np.where(x + DERIVATIVE_STEP > high, -DERIVATIVE_STEP, DERIVATIVE_STEP)
    errors = residuals(problem, numbers, np.concatenate([x[None], x + np.diag(step)]))
    return errors[0], ((errors[1:] - errors[0]) / step[:, None]).T


def held_at_bound(x: Array, low: Array, high: Array, gradient: Array) -> np.ndarray:
    return ((x <= low) & (gradient > 0)) | ((x >= high) & (gradient < 0))


def influential(jacobian: Array) -> np.ndarray:
    """Return which numbers change the residuals at all (`NO_INFLUENCE`), shape (p,)."""
    return (jacobian**2).sum(axis=0) > NO_INFLUENCE**2 * max(len(jacobian), 1)


def damped_step(
    jacobian: Array, error: Array, x: Array, box: tuple[Array, Array], damping: float, prior: Prior
) -> Array:
    """Return the damped Gauss-Newton step from `x`; zero for what is held or changes nothing."""
    gradient = jacobian.T @ error + prior.gradient(x)
    use = ~held_at_bound(x, *box, gradient) & influential(jacobian)
    step = np.zeros(len(x))
    if use.any():
        part = jacobian[:, use].T @ jacobian[:, use] + np.diag(prior.precision[use])
        damped = part + damping * np.diag(np.diag(part))
        step[use] = -np.linalg.lstsq(damped, gradient[use], rcond=1e-12)[0]
    return np.clip(step, -LONGEST_STEP, LONGEST_STEP)
