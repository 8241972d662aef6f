"""Least squares between bounds: Levenberg-Marquardt for fits, a trust region along valleys."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.fitting.prior import Prior
from catheter_sim.diagnosis.fitting.problem import FittedNumber, Problem
from catheter_sim.diagnosis.fitting.residuals import residuals
from catheter_sim.diagnosis.thresholds import (
    DERIVATIVE_STEP,
    FAIR_GAIN,
    FIRST_DAMPING,
    FIT_CONVERGED,
    LARGER_DAMPINGS,
    LONGEST_STEP,
    MOST_FIT_STEPS,
    MOST_VALLEY_TRIALS,
    NEAR_BOUND,
    NO_INFLUENCE,
)


@dataclass(frozen=True)
class Linearised:
    """The residual at a point with its derivative.

    Attributes:
        x: shape (p,).
        error: the residual, shape (n,).
        jacobian: its derivative, shape (n, p).
        exact: whether the derivative was worked out there; otherwise it was carried there from elsewhere.
    """

    x: Array
    error: Array
    jacobian: Array
    exact: bool = True


def descend(
    problem: Problem,
    numbers: Sequence[FittedNumber],
    start: Linearised,
    box: tuple[Array, Array],
    prior: Prior,
    keep: np.ndarray | slice = slice(None),
    damping: float = FIRST_DAMPING,
    converged: float = FIT_CONVERGED,
    most: int = MOST_FIT_STEPS,
    exact: bool = True,
) -> Linearised:
    """Return where Levenberg-Marquardt leads from `start`, to a smaller sum of squares or to `start` itself.

    The derivative costs a robot for each number, so that it is carried from step to step by the least change
    that agrees with the errors there (Broyden 1965, eq. 4.5), and worked out anew where a step gains little
    of what was promised (`FAIR_GAIN`), and before the search ends. Numbers at a bound that the gradient
    pushes outward are held. Of the residuals, only `keep` count. What is returned is exact or less than
    `converged` away from where it was. Unless `exact`, it need be so by a carried derivative only: enough
    where the exact one at `start` holds nearly as far as the search goes.
    """
    at = start
    cost = _cost_of(at.error[keep], at.x, prior)
    for left in reversed(range(most)):
        step = damped_step(at, box, damping, prior, keep)
        promised = cost - _promised_cost(at, step, prior, keep)
        last = at.exact and 0.0 <= promised < converged * cost  # less than none where bounds bend the step
        factors = ((1.0,),) if last else ((1.0,), LARGER_DAMPINGS)
        found, factor = _lower(problem, numbers, at, cost, box, damping, prior, keep, factors)
        if found is None:
            if at.exact:
                return at
            at = linearised(problem, numbers, at.x, box[1], at.error)
            continue
        moved = found.x - at.x
        promised = cost - _promised_cost(at, moved, prior, keep)
        before, cost = cost, _cost_of(found.error[keep], found.x, prior)
        small = before - cost < converged * cost
        if small and (at.exact or not exact):
            return replace(found, exact=True)
        damping = float(np.clip(damping * (0.1 if factor == 1.0 else factor), 1e-6, 1e6))
        at = found
        if (left or exact) and (small or before - cost < FAIR_GAIN * promised):
            at = linearised(problem, numbers, at.x, box[1], at.error)
    return at if at.exact or not exact else linearised(problem, numbers, at.x, box[1], at.error)


def _lower(
    problem: Problem,
    numbers: Sequence[FittedNumber],
    at: Linearised,
    cost: float,
    box: tuple[Array, Array],
    damping: float,
    prior: Prior,
    keep: np.ndarray | slice,
    factors_in_turn: Sequence[Sequence[float]],
) -> tuple[Linearised | None, float]:
    """Return a point of less than `cost`, its derivative carried there, and by what its damping was larger.

    The dampings of each of `factors_in_turn` are tried side by side. None: none is better.
    """
    for factors in factors_in_turn:
        steps = np.array([damped_step(at, box, damping * factor, prior, keep) for factor in factors])
        points = np.clip(at.x + steps, *box)
        errors = residuals(problem, numbers, points)
        costs = [_cost_of(error[keep], point, prior) for error, point in zip(errors, points, strict=True)]
        best = int(np.argmin(costs))
        if costs[best] < cost:
            moved = points[best] - at.x
            if not moved.any():
                break  # the same point: what it gains is rounding
            change = errors[best] - at.error - at.jacobian @ moved
            carried = at.jacobian + np.outer(change, moved / (moved @ moved))
            return Linearised(points[best], errors[best], carried, exact=False), factors[best]
    return None, 1.0


def _cost_of(error: Array, x: Array, prior: Prior) -> float:
    return float(error @ error) + prior.cost(x)


def _promised_cost(at: Linearised, step: Array, prior: Prior, keep: np.ndarray | slice) -> float:
    return _cost_of(at.error[keep] + at.jacobian[keep] @ step, at.x + step, prior)


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
        return np.concatenate([linearised(problem, numbers, point, high).jacobian, np.diag(root)])

    found = least_squares(value, inside, slope, bounds=box, ftol=1e-7, xtol=1e-6, max_nfev=MOST_VALLEY_TRIALS)
    at_bound = np.where(found.x - low < 2.0 * NEAR_BOUND, low, found.x)
    return np.where(high - found.x < 2.0 * NEAR_BOUND, high, at_bound)


def linearised(
    problem: Problem, numbers: Sequence[FittedNumber], x: Array, high: Array, error: Array | None = None
) -> Linearised:
    """Return the residual at `x` (p,) with its derivative by differences, backward near `high` (p,).

    `error` is the residual where it is known already.
    """
    step = np.where(x + DERIVATIVE_STEP > high, -DERIVATIVE_STEP, DERIVATIVE_STEP)
    beside = x + np.diag(step)
    if error is None:
        error, *others = residuals(problem, numbers, np.concatenate([x[None], beside]))
        beside_error = np.array(others).reshape(len(x), len(error))
    else:
        beside_error = residuals(problem, numbers, beside)
    return Linearised(x, error, ((beside_error - error) / step[:, None]).T)


def held_at_bound(x: Array, low: Array, high: Array, gradient: Array) -> np.ndarray:
    return ((x <= low) & (gradient > 0)) | ((x >= high) & (gradient < 0))


def influential(jacobian: Array) -> np.ndarray:
    """Return which numbers change the residuals at all (`NO_INFLUENCE`), shape (p,)."""
    return _matters((jacobian**2).sum(axis=0), len(jacobian))


def _matters(squares: Array, rows: int) -> np.ndarray:
    """Return which sums of squares (p,) of so many rows are more than nothing."""
    return squares > NO_INFLUENCE**2 * max(rows, 1)


def damped_step(
    at: Linearised,
    box: tuple[Array, Array],
    damping: float,
    prior: Prior,
    keep: np.ndarray | slice = slice(None),
) -> Array:
    """Return the damped Gauss-Newton step, shape (p,); zero for what is held or changes nothing."""
    jacobian = at.jacobian[keep]
    gradient = jacobian.T @ at.error[keep] + prior.gradient(at.x)
    square = jacobian.T @ jacobian
    use = ~held_at_bound(at.x, *box, gradient) & _matters(np.diag(square), len(jacobian))
    step = np.zeros(len(at.x))
    if use.any():
        part = square[np.ix_(use, use)] + np.diag(prior.precision[use])
        damped = part + damping * np.diag(np.diag(part))
        step[use] = -np.linalg.lstsq(damped, gradient[use], rcond=1e-12)[0]
    return np.clip(step, -LONGEST_STEP, LONGEST_STEP)
