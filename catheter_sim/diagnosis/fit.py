"""Fits hypotheses to trials: least squares with bounds, and what a fit is worth on rows left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from catheter_sim.diagnosis.hypothesis import (
    Free,
    Problem,
    Term,
    blocks_of,
    fold_of,
    frees_of,
    residuals,
    start_of,
    untempered,
)
from catheter_sim.robots.posture import Array

_STEP = 0.05  # of the derivative, in units of a parameter's scale
_MAX_STEPS = 12
_CONVERGED = 2e-4  # relative decrease of the sum of squares that is not worth another step
_FOLD_CONVERGED = 1e-3  # the same without a fold: its rows are predicted, no numbers reported
# Root mean square change of the residuals per scale, below which a number is left alone.
_NO_INFLUENCE = 1e-2
_NEAR_BOUND = 1e-3  # in units of a parameter's scale: as good as at the bound
_MOST_TRIALS = 100  # of the thorough search
_STEP_PARTS = (1.0, 0.3, 0.1)  # of the step to a fit without some rows, until it lowers their error
_GRID = (12, 6)  # values per number of the scan of one number, and of two
_LONGEST_STEP = 20.0  # of one iteration, in units of a parameter's scale


@dataclass(frozen=True)
class Fit:
    """A fitted hypothesis with its evidence.

    Attributes:
        terms: the hypothesis.
        frees: what was fitted, nuisances first.
        x: fitted numbers in units of their scale, shape (p,).
        residual: model minus measurement over weight, gross ones tempered (`residuals`), shape (n,).
        jacobian: of the residual by `x`, shape (n, p).
        held: whether a number stayed at a bound, shape (p,).
        block: which block each residual belongs to, shape (n,).
        left_out: the residual where the row's fold was left out of the fit, shape (n,).
    """

    terms: tuple[Term, ...]
    frees: tuple[Free, ...]
    x: Array
    residual: Array
    jacobian: Array
    held: np.ndarray
    block: np.ndarray
    left_out: Array
    SHAPES = "frees:p x:p residual:n jacobian:np held:p block:n left_out:n"  # of what is read (`kept`)

    @property
    def causes(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(term.effect for term in self.terms)

    @property
    def values(self) -> dict[tuple[str, str], float]:
        """Fitted values by effect and parameter, in the parameters' units."""
        return {
            free.key: free.parameter.from_fit(float(x) * free.parameter.scale)
            for free, x in zip(self.frees, self.x, strict=True)
        }

    @property
    def cross_validated_rms(self) -> float:
        """Root mean square of `left_out`, in weights, by which hypotheses are chosen."""
        return float(np.sqrt(np.mean(self.left_out**2)))

    @property
    def left_out_error_rms(self) -> float:
        """The same of the errors as they are, gross ones not tempered, for a reader."""
        return float(np.sqrt(np.mean(untempered(self.left_out) ** 2)))


def fit(
    problem: Problem,
    terms: Sequence[Term],
    known: dict[tuple[str, str], float] | None = None,
    cross_validate: bool = True,
    thorough: bool = False,
    scan: bool = False,
) -> Fit:
    """Return the least-squares fit of a hypothesis.

    Args:
        problem: trials and twin.
        terms: the hypothesis.
        known: values to start from, by effect and parameter.
        cross_validate: whether to work out `left_out`; otherwise it is the residual.
        thorough: search for the bottom of a valley in which numbers trade against one another.
        scan: start from the best point of a grid over the effects' numbers, if that is better and they are
            no more than two: there may be a lesser minimum nearer to the known values.
    """
    frees = frees_of(problem, terms)
    block = blocks_of(problem)
    bounds = np.array([free.parameter.fit_bounds for free in frees]).reshape(-1, 2)
    scale = np.array([free.parameter.scale for free in frees])
    low, high = bounds[:, 0] / scale, bounds[:, 1] / scale
    x = np.clip(start_of(frees, known), low, high)
    if len(frees) == 0:
        error = residuals(problem, frees, x[None])[0]
        empty = np.zeros((len(error), 0))
        return Fit(tuple(terms), frees, x, error, empty, np.zeros(0, bool), block, error)
    prior = prior_of(frees)
    if scan:
        x = _scanned(problem, frees, x, (low, high), prior)
    search = _bottom if thorough else _descended
    x = search(problem, frees, x, (low, high), prior)
    error, jacobian = linearised(problem, frees, x, high)
    null = start_of(frees, {free.key: free.parameter.null for free in frees})
    rested = np.where(influential(jacobian), x, null)
    if (rested != x).any() and _cost(problem, frees, rested, prior) <= error @ error + prior.cost(x):
        x = rested  # what changes nothing does nothing, wherever the search began
        error, jacobian = linearised(problem, frees, x, high)
    held = _held(x, low, high, prior.gradient(x) + jacobian.T @ error)
    left_out = error
    if cross_validate:
        left_out = _left_out(problem, frees, x, error, jacobian, block, (low, high))
    return Fit(tuple(terms), frees, x, error, jacobian, held, block, left_out)


def _cost(problem: Problem, frees: Sequence[Free], x: Array, prior: Prior) -> float:
    error = residuals(problem, frees, x[None])[0]
    return float(error @ error) + prior.cost(x)


def _scanned(
    problem: Problem, frees: Sequence[Free], x: Array, box: tuple[Array, Array], prior: Prior
) -> Array:
    """Return the best of `x` and of a grid over the effects' numbers, between the bounds."""
    mine = [index for index, free in enumerate(frees) if free.effect]
    if not 0 < len(mine) <= len(_GRID):
        return x
    count = _GRID[len(mine) - 1]
    places = np.stack(np.meshgrid(*[(np.arange(count) + 0.5) / count] * len(mine)), axis=-1)
    points = np.repeat(x[None], count ** len(mine) + 1, axis=0)
    low, high = (bound[mine] for bound in box)
    points[1:, mine] = low + places.reshape(-1, len(mine)) * (high - low)
    costs = (residuals(problem, frees, points) ** 2).sum(axis=1)
    return points[int(np.argmin(costs + np.array([prior.cost(point) for point in points])))]


def _descended(
    problem: Problem,
    frees: Sequence[Free],
    x: Array,
    box: tuple[Array, Array],
    prior: Prior,
    keep: np.ndarray | slice = slice(None),
    known: tuple[Array, Array] | None = None,
    damping: float = 1e-3,
    converged: float = _CONVERGED,
) -> Array:
    """Return a smaller sum of squares than at `x` by Levenberg-Marquardt, five dampings at a time.

    Numbers at a bound that the gradient pushes outward are held. Of the residuals, only `keep` count.
    `known` is the residual at `x` with its derivative, where these were worked out already; `damping` is
    what the first step is tried with.
    """
    low, high = box
    error, jacobian = (item[keep] for item in known or linearised(problem, frees, x, high))
    cost = float(error @ error) + prior.cost(x)
    for _ in range(_MAX_STEPS):
        candidates = np.array(
            [
                np.clip(x + _step(jacobian, error, x, box, factor, prior), low, high)
                for factor in damping * np.array([0.1, 1.0, 10.0, 100.0, 1e4])
            ]
        )
        costs = (residuals(problem, frees, candidates)[:, keep] ** 2).sum(axis=1)
        costs += np.array([prior.cost(point) for point in candidates])
        best = int(np.argmin(costs))
        if not costs[best] < cost:
            break
        gained = cost - float(costs[best])
        x, cost = candidates[best], float(costs[best])
        damping = float(np.clip(damping * 10.0 ** (best - 1), 1e-6, 1e6))
        if gained < converged * cost:
            break
        error, jacobian = (item[keep] for item in linearised(problem, frees, x, high))
    return x


def _bottom(
    problem: Problem, frees: Sequence[Free], x: Array, box: tuple[Array, Array], prior: Prior
) -> Array:
    """Return the least sum of squares near `x` by a trust region in the box (`scipy.optimize`)."""
    low, high = box
    root = np.sqrt(prior.precision)
    inside = np.clip(x, low + _NEAR_BOUND, high - _NEAR_BOUND)

    def value(point: Array) -> Array:
        return np.concatenate([residuals(problem, frees, point[None])[0], root * (point - prior.middle)])

    def slope(point: Array) -> Array:
        return np.concatenate([linearised(problem, frees, point, high)[1], np.diag(root)])

    found = least_squares(value, inside, slope, bounds=box, ftol=1e-7, xtol=1e-6, max_nfev=_MOST_TRIALS)
    at_bound = np.where(found.x - low < 2.0 * _NEAR_BOUND, low, found.x)
    return np.where(high - found.x < 2.0 * _NEAR_BOUND, high, at_bound)


def probe(
    problem: Problem, current: Fit, terms: Sequence[Term]
) -> tuple[float, dict[tuple[str, str], float]]:
    """Return what one Gauss-Newton step from `current` to the hypothesis `terms` reaches.

    Returns:
        The sum of squared residuals, and the values there by effect and parameter. The derivative by
        what `current` already fits is taken over from it, so that a probe costs little.
    """
    frees = frees_of(problem, terms)
    known = carried(current, terms)
    bounds = np.array([free.parameter.fit_bounds for free in frees]).reshape(-1, 2)
    scale = np.array([free.parameter.scale for free in frees])
    low, high = bounds[:, 0] / scale, bounds[:, 1] / scale
    x = np.clip(start_of(frees, known), low, high)
    old = {free.key: column for column, free in enumerate(current.frees)}
    new = [index for index, free in enumerate(frees) if free.key not in old]
    step = np.where(x + _STEP > high, -_STEP, _STEP)
    errors = residuals(problem, frees, np.concatenate([x[None], x + np.diag(step)[new]]))
    jacobian = np.empty((errors.shape[1], len(frees)))
    for index, free in enumerate(frees):
        if free.key in old:
            jacobian[:, index] = current.jacobian[:, old[free.key]]
    for row, index in enumerate(new):
        jacobian[:, index] = (errors[row + 1] - errors[0]) / step[index]
    prior = prior_of(frees)
    points = np.array(
        [
            np.clip(x + _step(jacobian, errors[0], x, (low, high), factor, prior), low, high)
            for factor in (1e-3, 0.3, 10.0)
        ]
    )
    costs = (residuals(problem, frees, points) ** 2).sum(axis=1)
    best = int(np.argmin(costs))
    values = {
        free.key: free.parameter.from_fit(float(value) * free.parameter.scale)
        for free, value in zip(frees, points[best], strict=True)
    }
    return float(costs[best]), values


def carried(current: Fit, terms: Sequence[Term]) -> dict[tuple[str, str], float]:
    """Return the values of `current`, those of a common parameter also for each one that details it.

    `offset_mm` is detailed by `offset_base_1_mm`: its words in their order, and others.
    """
    values = dict(current.values)
    for term in terms:
        for name in term.free:
            if (term.effect, name) in values:
                continue
            for (effect, common), value in current.values.items():
                if effect == term.effect and details(name, common) and common not in term.free:
                    values[effect, name] = value
    return values


def details(name: str, common: str) -> bool:
    """Return whether a parameter says for one channel or segment what another, `common`, says for all."""
    words = iter(name.split("_"))
    return all(word in words for word in common.split("_"))


def linearised(problem: Problem, frees: Sequence[Free], x: Array, high: Array) -> tuple[Array, Array]:
    """Return the residual (n,) and its derivative by differences (n, p), backward near `high` (p,)."""
    step = np.where(x + _STEP > high, -_STEP, _STEP)
    errors = residuals(problem, frees, np.concatenate([x[None], x + np.diag(step)]))
    return errors[0], ((errors[1:] - errors[0]) / step[:, None]).T


def _held(x: Array, low: Array, high: Array, gradient: Array) -> np.ndarray:
    return ((x <= low) & (gradient > 0)) | ((x >= high) & (gradient < 0))


@dataclass(frozen=True)
class Prior:
    """Squares added for nuisances that leave their middle, in units of the residuals' weights.

    A nuisance is uniform in its range, so of the standard deviation half_range / sqrt(3). Beside
    hundreds of measurements this decides only what they leave open: between a nuisance and a cause
    that do the same, the cause moves.
    """

    middle: Array
    precision: Array

    def cost(self, x: Array) -> float:
        return float(self.precision @ (x - self.middle) ** 2)

    def gradient(self, x: Array) -> Array:
        return self.precision * (x - self.middle)


def prior_of(frees: Sequence[Free]) -> Prior:
    scale = np.array([free.parameter.scale for free in frees])
    spread = np.array([free.spread for free in frees])
    known = np.isfinite(spread)
    middle = [free.parameter.to_fit(free.parameter.null) for free in frees]
    return Prior(np.where(known, middle, 0.0) / scale, np.where(known, (scale / spread) ** 2, 0.0))


def influential(jacobian: Array) -> np.ndarray:
    """Return which numbers change the residuals at all (`_NO_INFLUENCE`), shape (p,)."""
    return (jacobian**2).sum(axis=0) > _NO_INFLUENCE**2 * max(len(jacobian), 1)


def _step(
    jacobian: Array, error: Array, x: Array, box: tuple[Array, Array], damping: float, prior: Prior
) -> Array:
    """Return the damped Gauss-Newton step from `x`; zero for what is held or changes nothing."""
    gradient = jacobian.T @ error + prior.gradient(x)
    use = ~_held(x, *box, gradient) & influential(jacobian)
    step = np.zeros(len(x))
    if use.any():
        part = jacobian[:, use].T @ jacobian[:, use] + np.diag(prior.precision[use])
        damped = part + damping * np.diag(np.diag(part))
        step[use] = -np.linalg.lstsq(damped, gradient[use], rcond=1e-12)[0]
    return np.clip(step, -_LONGEST_STEP, _LONGEST_STEP)


def _left_out(
    problem: Problem,
    frees: Sequence[Free],
    x: Array,
    error: Array,
    jacobian: Array,
    block: np.ndarray,
    box: tuple[Array, Array],
) -> Array:
    """Return the residual of each fold under the parameters fitted without it, shape (n,).

    Those parameters are one Gauss-Newton step from the fit to everything, or a part of it where the model
    bends so much that the whole step would raise the error on the rows kept; where any part would, the rows
    kept are fitted by as many steps as they need. The residual itself is computed with the full model.
    """
    fold = fold_of(block)
    chosen = np.unique(fold)
    prior = prior_of(frees)
    keeps = [fold != index for index in chosen]
    steps = np.array([_step(jacobian[keep], error[keep], x, box, 1e-9, prior) for keep in keeps])
    errors = np.repeat(error[None], len(chosen), axis=0)
    least = np.array([float(error[keep] @ error[keep]) + prior.cost(x) for keep in keeps])
    waiting = np.arange(len(chosen))
    for part in _STEP_PARTS:
        points = np.clip(x + part * steps[waiting], *box)
        found = residuals(problem, frees, points)
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
        without = _descended(problem, frees, x, box, prior, keeps[i], known, 1.0, _FOLD_CONVERGED)
        errors[i] = residuals(problem, frees, without[None])[0]
    left_out = error.copy()
    for position, index in enumerate(chosen):
        left_out[fold == index] = errors[position][fold == index]
    return left_out
