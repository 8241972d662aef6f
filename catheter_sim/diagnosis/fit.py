"""Least squares: a hypothesis fitted to trials, with the errors of stretches that it was not fitted to."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, numbers_of
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.nuisance import Nuisance
from catheter_sim.diagnosis.problem import (
    FittedNumber,
    Prior,
    Problem,
    Term,
    box_of,
    fitted_numbers,
    prior_of,
    start_of,
)
from catheter_sim.diagnosis.thresholds import DERIVATIVE_STEP, FOLDS, MOST_FIT_STEPS, NO_EQUILIBRIUM_ERROR
from catheter_sim.diagnosis.trials import measured_of, stretch_of
from catheter_sim.theory.twins import along

GROSS_ERROR = 1e3
"""[weights] A residual beyond it counts by its size and no longer by its square (Huber 1964). Why: such a
gross error draws a fit in one direction, but does not outweigh all the rest of the data."""
FIRST_DAMPING = 1e-4
"""[share of the curvature] A fit starts with this damping. Why: assumed. The first step is nearly a whole
one."""
LARGER_DAMPINGS = (10.0, 100.0, 1e3, 1e5)
"""[times the damping] These are tried side by side where a step fails. Why: assumed. The last leaves only a
short step along the steepest way."""
FAIR_GAIN = 0.25
"""[share of the gain promised] After a step with less, the derivative is computed again. Why: it is the usual
bound below which a trust region shrinks."""
FIT_CONVERGED = 2e-4
"""[relative fall of the sum of squares] A smaller fall is not worth another step. Why: it is far below what
decides between hypotheses (`PAYS_SHARE`)."""
FOLD_CONVERGED = 1e-3
"""[relative fall of the sum of squares] The same for a fit without a fold. Why: such a fit only predicts the
rows of the fold, and none of its numbers is reported."""
FOLD_FIRST_ORDER = 0.1
"""[share of the error of the rows left out] If these rows change by less, they may be predicted to first
order. Why: what bends on so short a way changes their error by a hundredth or so, a third of what pays."""
PIECE_ROWS = 2
"""[rows compared] Length of a piece that is left out between others. Why: assumed. The noise of most trackers
is nearly white, and it takes six pieces to rule out chance."""
MOST_FOLD_STEPS = 12
"""[steps] A fit without a fold makes at most this many. Why: it starts at the fit to all rows."""
NO_INFLUENCE = 1e-2
"""[weights, root mean square, per scale] A number that changes the residuals by less is left alone. Why: it
is a hundredth of the noise."""
NEAR_BOUND = 1e-3
"""[scales of the parameter] A number this near to its bound is at it. Why: no such change matters."""
MOST_VALLEY_TRIALS = 100
"""[trials] The thorough search for the bottom of a valley makes at most this many. Why: assumed. It bounds
the time."""
FOLD_STEP_PARTS = (1.0, 0.3, 0.1)
"""[share of the step] These are tried in this order, until the error on the kept rows falls. Why: a whole
step may leave the range in which the model is nearly linear."""
NO_DAMPING = 1e-9
"""[share of the normal matrix's diagonal] Damping of the step that leaves a fold out. Why: it is next to
none. It keeps the matrix regular where numbers do the same."""
ROWS_TO_SCAN_BY = 100
"""[rows] A scan uses about this many, of whole trials. Why: a scan separates minima that lie a twelfth of a
range apart, and a hundred rows show them."""
GRID_VALUES = (12, 6)
"""[values per number] The scan of one number, and of two, has this many. Why: a delay of nine seconds has a
lesser minimum nearby. Twelve values of its range step over that."""
SCANNED_SIZES = (-12.0, -4.0, -1.0, 1.0, 4.0, 12.0)
"""[scales of the parameter] If more than two numbers are scanned, each is tried at these sizes, one at a
time. Why: the zero of a slack tendon's drive does nothing on one side, so both signs are tried. These are the
sizes of most causes that matter."""
LONGEST_STEP = 20.0
"""[scales of the parameter] One iteration goes at most this far. Why: assumed. Beyond it the derivative says
nothing."""

# ----------------------------------------------------------------------------------------------------
# What a hypothesis predicts: its robot, and that robot's outputs as they would be measured.


def robot_with(problem: Problem, numbers: Sequence[FittedNumber], x: Array) -> RobotSpec:
    """Return the specified robot with calibrated nuisances built in and the effects attached."""
    robot = problem.robot
    effects: dict[str, dict[str, float]] = {name: dict(values) for name, values in robot.effects.items()}
    factors = {}
    for fitted, value in zip(numbers, x, strict=True):
        value_in_unit = fitted.parameter.from_fit(float(value) * fitted.parameter.scale)
        if fitted.effect:
            effects.setdefault(fitted.effect, {})[fitted.parameter.name] = value_in_unit
        else:
            factors[fitted.parameter.name] = value_in_unit
    for nuisance in problem.nuisances:
        if nuisance.name in factors:
            robot = nuisance.change_robot(robot, factors[nuisance.name])
    return replace(robot, effects=effects)


def predicted(
    problem: Problem, numbers: Sequence[FittedNumber], x: Array, inputs: Inputs, every: int = 1
) -> Array:
    """Return the outputs of a hypothesis along inputs, at each `every`-th row, shape (r, o), in file units.

    `x` has the shape (p,), in units of the parameters' scales.
    """
    outputs = problem.twin([robot_with(problem, numbers, x)], inputs, every)
    return as_measured(problem, numbers, x, outputs[0])


def predicted_along(
    problem: Problem, numbers: Sequence[FittedNumber], x: Array, trials: Sequence[Inputs]
) -> list[Array]:
    """Return the outputs of a hypothesis along each of several trials' inputs, as `predicted` does."""
    robot = robot_with(problem, numbers, x)
    return [as_measured(problem, numbers, x, item[0]) for item in along(problem.twin, [robot], trials)]


def as_measured(problem: Problem, numbers: Sequence[FittedNumber], x: Array, outputs: Array) -> Array:
    """Return a robot's outputs (r, o) as they are measured: with the nuisances that act on outputs alone."""
    return all_as_measured(problem, numbers, x[None], outputs[None])[0]


def all_as_measured(problem: Problem, numbers: Sequence[FittedNumber], xs: Array, outputs: Array) -> Array:
    for index, nuisance in _acting_on_outputs(problem, numbers).items():
        assert nuisance.change_outputs is not None
        values = xs[:, index] * nuisance.parameter.scale
        outputs = nuisance.change_outputs(problem.columns, outputs, values)
    return outputs


def distinct_robots(
    problem: Problem, numbers: Sequence[FittedNumber], xs: Array
) -> tuple[list[RobotSpec], np.ndarray | slice]:
    """Return the robots of many parameter vectors, and which of them each vector has, shape (B,).

    Vectors that differ only in numbers that act on the outputs share a robot.
    """
    outside = _acting_on_outputs(problem, numbers)
    if not outside:
        return [robot_with(problem, numbers, x) for x in xs], slice(None)
    inside = np.array(xs)
    inside[:, list(outside)] = 0.0
    distinct, which = np.unique(inside, axis=0, return_inverse=True)
    return [robot_with(problem, numbers, x) for x in distinct], which.reshape(-1)


def _acting_on_outputs(problem: Problem, numbers: Sequence[FittedNumber]) -> dict[int, Nuisance]:
    """Return the nuisances that act on the outputs by their place among `numbers`."""
    by_name = {item.name: item for item in problem.nuisances if item.change_outputs is not None}
    return {
        index: by_name[fitted.parameter.name]
        for index, fitted in enumerate(numbers)
        if not fitted.effect and fitted.parameter.name in by_name
    }


# ----------------------------------------------------------------------------------------------------
# Huber's loss: beyond a size an error counts by its size, no longer by its square.


def tempered(error: Array) -> Array:
    """Return errors in weights so that their squares are Huber's loss, linear beyond `GROSS_ERROR`."""
    size = np.abs(error)
    root = np.sqrt(np.maximum(2.0 * size - GROSS_ERROR, 0.0) * GROSS_ERROR)
    return np.where(size > GROSS_ERROR, np.copysign(root, error), error)


def untempered(residual: Array) -> Array:
    """Return the errors that `tempered` made the residuals of, same shape."""
    size = np.abs(residual)
    return np.where(
        size > GROSS_ERROR, np.copysign((residual**2 / GROSS_ERROR + GROSS_ERROR) / 2.0, residual), residual
    )


# ----------------------------------------------------------------------------------------------------
# Model minus measurement over each column's weight, of many parameter vectors at once.


def residuals(problem: Problem, numbers: Sequence[FittedNumber], xs: Array) -> Array:
    """Return model minus measurement over weight for many parameter vectors, shape (B, n).

    A residual larger than `GROSS_ERROR` is made smaller, so that its square is Huber's loss (`tempered`). A
    robot without equilibrium errs by more than any robot that stands still. `xs` has the shape (B, p), in
    units of the parameters' scales.
    """
    parts = []
    robots, which = distinct_robots(problem, numbers, xs)
    keys = [numbers_of(trial.inputs) for trial in problem.trials]
    inputs = {key: trial.inputs for key, trial in zip(keys, problem.trials, strict=True)}
    computed = along(problem.twin, robots, list(inputs.values()), problem.every)  # each repeated trial once
    models = {
        key: all_as_measured(problem, numbers, xs, outputs[which])
        for key, outputs in zip(inputs, computed, strict=True)
    }
    for key, trial in zip(keys, problem.trials, strict=True):
        measured = measured_of(trial, problem.columns)[:: problem.every]
        error = (models[key] - measured) / problem.weight
        parts.append(error[:, np.isfinite(measured)])
    stacked = np.concatenate(parts, axis=1)
    found = np.isfinite(stacked)
    if found.all():
        return tempered(stacked)
    return np.where(found, tempered(np.where(found, stacked, 0.0)), no_equilibrium_residual(problem))


def column_of(problem: Problem) -> np.ndarray:
    """Return the index of the output column of each residual, shape (n,)."""
    parts = []
    for trial in problem.trials:
        finite = np.isfinite(measured_of(trial, problem.columns)[:: problem.every])
        parts.append(np.broadcast_to(np.arange(finite.shape[1]), finite.shape)[finite])
    return np.concatenate(parts)


def no_equilibrium_residual(problem: Problem) -> float:
    """Return the residual of a row without equilibrium: larger than of a robot that stands still."""
    size = max(
        float(np.nanmax(np.abs(measured_of(trial, problem.columns)) / problem.weight, initial=0.0))
        for trial in problem.trials
    )
    return float(tempered(np.array(max(NO_EQUILIBRIUM_ERROR, 2.0 * size))))


# ----------------------------------------------------------------------------------------------------
# Stretches of rows that err together: blocks for intervals, folds for the cross-validation.


def blocks_of(problem: Problem, fewest: int = 2 * FOLDS) -> np.ndarray:
    """Return the block of each residual: its row's stretch (`diagnosis.trials.stretch_of`), shape (n,).

    Of an interleaved problem it is a piece of one, numbered so that neighbours are in different folds.
    """
    labels = stretch_of(problem.trials, problem.moving, fewest)
    if problem.interleaved:
        labels = _interleaved(labels, PIECE_ROWS * problem.every)
    parts = []
    for trial, label in zip(problem.trials, labels, strict=True):
        finite = np.isfinite(measured_of(trial, problem.columns)[:: problem.every])
        parts.append(np.broadcast_to(label[:: problem.every, None], finite.shape)[finite])
    return np.concatenate(parts)


def _interleaved(stretches: Sequence[np.ndarray], rows: int) -> list[np.ndarray]:
    """Return the piece of each row, of about so many rows of a stretch; neighbours' numbers are far apart."""
    found, count = [], 0
    for label in stretches:
        pieces = np.zeros(len(label), dtype=int)
        for stretch in np.unique(label):
            own = np.flatnonzero(label == stretch)
            for part in np.array_split(own, max(1, len(own) // rows)):
                pieces[part], count = count, count + 1
        found.append(pieces)
    return [pieces % FOLDS * count + pieces // FOLDS for pieces in found]


def fold_of(block: np.ndarray, folds: int = FOLDS) -> np.ndarray:
    """Return the fold of each residual: stretches of neighbouring blocks, alike in rows, shape (n,)."""
    order = np.unique(block, return_inverse=True)[1]
    sizes = np.bincount(order)
    middle = np.cumsum(sizes) - 0.5 * sizes
    return np.minimum((middle * folds / sizes.sum()).astype(int), folds - 1)[order]


def trial_of(problem: Problem) -> np.ndarray:
    """Return the index of the trial of each residual, shape (n,)."""
    return np.concatenate(
        [
            np.full(int(np.isfinite(measured_of(trial, problem.columns)[:: problem.every]).sum()), index)
            for index, trial in enumerate(problem.trials)
        ]
    )


@dataclass(frozen=True)
class FitTask:
    """What a fit makes small: a problem's residuals by some numbers, beside what is known of these.

    `box` has the lower and the upper bounds, in units of the numbers' scales, shape (p,) each.
    """

    problem: Problem
    numbers: Sequence[FittedNumber]
    box: tuple[Array, Array]
    prior: Prior

    def residuals(self, xs: Array) -> Array:
        """Return the residuals of many parameter vectors (B, p), shape (B, n)."""
        return residuals(self.problem, self.numbers, xs)

    def cost(self, error: Array, x: Array) -> float:
        """Return the sum of squares of some residuals at `x` (p,), that of the prior with it."""
        return float(error @ error) + self.prior.cost(x)

    def linearised(self, x: Array, error: Array | None = None) -> Linearised:
        """Return the residual at `x` with its derivative; `error` is the residual where it is known."""
        return linearised(self.problem, self.numbers, x, self.box[1], error)


# ----------------------------------------------------------------------------------------------------
# A scan of one or two numbers over their whole ranges: the nearest minimum need not be the least.
#
# More numbers, one of each channel say, are scanned one at a time about where they start.


def best_of_grid(task: FitTask, x: Array, known: Collection[tuple[str, str]] = ()) -> Array:
    """Return the best of `x` and of a grid over the effects' numbers, between the bounds.

    It shows in which of several minima a fit should start, for which few trials do (`ROWS_TO_SCAN_BY`). `x`
    (p,) is where the fit would start. `known`, by effect and parameter, are the numbers of which `x` is more
    than a first guess: of many numbers the others alone are scanned.
    """
    mine = [index for index, fitted in enumerate(task.numbers) if fitted.effect]
    if not mine:
        return x
    if len(mine) > len(GRID_VALUES):
        if task.problem.moving:  # each costs seconds
            return x
        return _best(task, _one_at_a_time(task, mine, x, known))
    count = GRID_VALUES[len(mine) - 1]
    places = np.stack(np.meshgrid(*[(np.arange(count) + 0.5) / count] * len(mine)), axis=-1)
    points = np.repeat(x[None], count ** len(mine) + 1, axis=0)
    low, high = (bound[mine] for bound in task.box)
    points[1:, mine] = low + places.reshape(-1, len(mine)) * (high - low)
    return _best(task, points)


def _one_at_a_time(task: FitTask, mine: Sequence[int], x: Array, known: Collection[tuple[str, str]]) -> Array:
    """Return `x`, and it with one number at a time at another size and no other effect's number, (k, p)."""
    fresh = [index for index in mine if task.numbers[index].key not in known]
    still = start_of(task.numbers, {item.key: item.parameter.null for item in task.numbers})
    nothing = x.copy()
    nothing[fresh] = still[fresh]
    points = [x]
    for index in fresh:
        for size in SCANNED_SIZES:
            point = nothing.copy()
            point[index] += size
            points.append(np.clip(point, *task.box))
    return np.array(points)


def _best(task: FitTask, points: Array) -> Array:
    """Return the one of `points` (k, p) that costs least on few trials, shape (p,)."""
    if len(points) == 1:
        return points[0]
    costs = (residuals(_fewest_trials(task.problem), task.numbers, points) ** 2).sum(axis=1)
    return points[int(np.argmin(costs + np.array([task.prior.cost(point) for point in points])))]


def _fewest_trials(problem: Problem) -> Problem:
    """Return `problem` with as few of its trials, spread over all, as a scan needs."""
    rows = sum(len(trial.inputs) for trial in problem.trials) / problem.every
    count = min(len(problem.trials), math.ceil(len(problem.trials) * ROWS_TO_SCAN_BY / max(rows, 1.0)))
    places = np.linspace(0, len(problem.trials) - 1, max(count, 1)).round().astype(int)
    return replace(problem, trials=tuple(problem.trials[place] for place in places))


# ----------------------------------------------------------------------------------------------------
# Least squares between bounds: Levenberg-Marquardt for fits, a trust region along valleys.


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
    task: FitTask,
    start: Linearised,
    keep: np.ndarray | slice = slice(None),
    damping: float = FIRST_DAMPING,
    converged: float = FIT_CONVERGED,
    most: int = MOST_FIT_STEPS,
    exact: bool = True,
) -> Linearised:
    """Return where Levenberg-Marquardt leads from `start`, to a smaller sum of squares or to `start` itself.

    The derivative costs a robot for each number, so that it is carried from step to step by the least change
    that agrees with the errors there (Broyden 1965, eq. 4.5), and computed again where a step gains little
    of what was promised (`FAIR_GAIN`), and before the search ends. Numbers at a bound that the gradient
    pushes outward are held. Of the residuals, only `keep` count. What is returned is exact or less than
    `converged` away from where it was. Unless `exact`, it need be so by a carried derivative only: enough
    where the exact one at `start` holds nearly as far as the search goes.
    """
    at = start
    cost = task.cost(at.error[keep], at.x)
    for left in reversed(range(most)):
        step = damped_step(task, at, damping, keep)
        promised = cost - _promised_cost(task, at, step, keep)
        last = at.exact and 0.0 <= promised < converged * cost  # less than none where bounds bend the step
        factors = ((1.0,),) if last else ((1.0,), LARGER_DAMPINGS)
        found, factor = _lower(task, at, cost, damping, keep, factors)
        if found is None:
            if at.exact:
                return at
            at = task.linearised(at.x, at.error)
            continue
        moved = found.x - at.x
        promised = cost - _promised_cost(task, at, moved, keep)
        before, cost = cost, task.cost(found.error[keep], found.x)
        small = before - cost < converged * cost
        if small and (at.exact or not exact):
            return replace(found, exact=True)
        damping = float(np.clip(damping * (0.1 if factor == 1.0 else factor), 1e-6, 1e6))
        at = found
        if (left or exact) and (small or before - cost < FAIR_GAIN * promised):
            at = task.linearised(at.x, at.error)
    return at if at.exact or not exact else task.linearised(at.x, at.error)


def _lower(
    task: FitTask,
    at: Linearised,
    cost: float,
    damping: float,
    keep: np.ndarray | slice,
    factors_in_turn: Sequence[Sequence[float]],
) -> tuple[Linearised | None, float]:
    """Return a point of less than `cost`, its derivative carried there, and by what its damping was larger.

    The dampings of each of `factors_in_turn` are tried side by side. None: none is better.
    """
    for factors in factors_in_turn:
        steps = np.array([damped_step(task, at, damping * factor, keep) for factor in factors])
        points = np.clip(at.x + steps, *task.box)
        errors = task.residuals(points)
        costs = [task.cost(error[keep], point) for error, point in zip(errors, points, strict=True)]
        best = int(np.argmin(costs))
        if costs[best] < cost:
            moved = points[best] - at.x
            if not moved.any():
                break  # the same point: what it gains is rounding
            change = errors[best] - at.error - at.jacobian @ moved
            carried = at.jacobian + np.outer(change, moved / (moved @ moved))
            return Linearised(points[best], errors[best], carried, exact=False), factors[best]
    return None, 1.0


def _promised_cost(task: FitTask, at: Linearised, step: Array, keep: np.ndarray | slice) -> float:
    return task.cost(at.error[keep] + at.jacobian[keep] @ step, at.x + step)


def descend_valley(task: FitTask, x: Array) -> Array:
    """Return the least sum of squares near `x` by a trust region in the box (`scipy.optimize`)."""
    (low, high), prior = task.box, task.prior
    root = np.sqrt(prior.precision)
    inside = np.clip(x, low + NEAR_BOUND, high - NEAR_BOUND)

    def value(point: Array) -> Array:
        return np.concatenate([task.residuals(point[None])[0], root * (point - prior.middle)])

    def slope(point: Array) -> Array:
        return np.concatenate([task.linearised(point).jacobian, np.diag(root)])

    found = least_squares(
        value, inside, slope, bounds=task.box, ftol=1e-7, xtol=1e-6, max_nfev=MOST_VALLEY_TRIALS
    )
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
    task: FitTask, at: Linearised, damping: float, keep: np.ndarray | slice = slice(None)
) -> Array:
    """Return the damped Gauss-Newton step, shape (p,); zero for what is held or changes nothing."""
    jacobian = at.jacobian[keep]
    gradient = jacobian.T @ at.error[keep] + task.prior.gradient(at.x)
    square = jacobian.T @ jacobian
    use = ~held_at_bound(at.x, *task.box, gradient) & _matters(np.diag(square), len(jacobian))
    step = np.zeros(len(at.x))
    if use.any():
        part = square[np.ix_(use, use)] + np.diag(task.prior.precision[use])
        damped = part + damping * np.diag(np.diag(part))
        step[use] = -np.linalg.lstsq(damped, gradient[use], rcond=1e-12)[0]
    return np.clip(step, -LONGEST_STEP, LONGEST_STEP)


# ----------------------------------------------------------------------------------------------------
# What a fit predicts for rows that it was not fitted to.


def left_out_residuals(task: FitTask, at: Linearised, block: np.ndarray, well: bool = True) -> Array:
    """Return the residual of each fold under the parameters fitted without it, shape (n,).

    Those parameters are one Gauss-Newton step away from the fit to all rows. Where this step hardly changes
    the rows left out (`FOLD_FIRST_ORDER`), the derivative gives their residuals. Otherwise they are
    computed with the full model. Where the whole step would raise the error on the rows kept, that is a
    part of the step away. Where any part would raise it, the rows kept are fitted again. Unless `well`, as
    fitted to all rows.
    """
    fold = fold_of(block)
    keeps = [fold != index for index in np.unique(fold)]
    steps = np.array([damped_step(task, at, NO_DAMPING, keep) for keep in keeps])
    steps = np.clip(at.x + steps, *task.box) - at.x
    errors = at.error + steps @ at.jacobian.T
    far = []
    for index, keep in enumerate(keeps):
        change, size = (np.linalg.norm(part[~keep]) for part in (errors[index] - at.error, at.error))
        if change > FOLD_FIRST_ORDER * size:
            far.append(index)
    if far:
        errors[far] = _with_the_full_model(task, at, steps[far], [keeps[index] for index in far], well)
    left_out = at.error.copy()
    for keep, without in zip(keeps, errors, strict=True):
        left_out[~keep] = without[~keep]
    return left_out


def _with_the_full_model(
    task: FitTask, at: Linearised, steps: Array, keeps: Sequence[np.ndarray], well: bool
) -> Array:
    """Return all residuals under the parameters fitted to the rows that each of `keeps` keeps, (k, n)."""
    errors = np.repeat(at.error[None], len(keeps), axis=0)
    least = np.array([task.cost(at.error[keep], at.x) for keep in keeps])
    waiting: np.ndarray = np.arange(len(keeps))
    for part in FOLD_STEP_PARTS:
        points = np.clip(at.x + part * steps[waiting], *task.box)
        found = task.residuals(points)
        costs = [
            float((found[k][keeps[i]] ** 2).sum()) + task.prior.cost(points[k])
            for k, i in enumerate(waiting.tolist())
        ]
        better = np.array(costs) <= least[waiting]
        errors[waiting[better]] = found[better]
        waiting = waiting[~better]
        if not len(waiting):
            break
    for i in waiting.tolist() if well else ():
        without = descend(task, at, keeps[i], 1.0, FOLD_CONVERGED, MOST_FOLD_STEPS, exact=False)
        errors[i] = without.error
    return errors


# ----------------------------------------------------------------------------------------------------
# The fit of a hypothesis to trials, with its evidence.


@dataclass(frozen=True)
class Fit:
    """A fitted hypothesis with its evidence.

    Attributes:
        terms: the hypothesis.
        numbers: what was fitted, nuisances first.
        x: fitted numbers in units of their scale, shape (p,).
        residual: model minus measurement over weight, gross ones tempered (`residuals`), shape (n,).
        jacobian: of the residual by `x`, shape (n, p).
        held: whether a number stayed at a bound, shape (p,).
        block: which block each residual belongs to, shape (n,).
        left_out: the residual where the row's fold was left out of the fit, shape (n,).
        rough: whether it errs too much on the rows it was fitted to for `left_out` to be worked out well.
    """

    terms: tuple[Term, ...]
    numbers: tuple[FittedNumber, ...]
    x: Array
    residual: Array
    jacobian: Array
    held: np.ndarray
    block: np.ndarray
    left_out: Array
    rough: bool = False
    SHAPES = "numbers:p x:p residual:n jacobian:np held:p block:n left_out:n"  # of what is read (`kept`)

    @property
    def causes(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(term.effect for term in self.terms)

    @property
    def values(self) -> dict[tuple[str, str], float]:
        """Fitted values by effect and parameter, in the parameters' units."""
        return {
            fitted.key: fitted.parameter.from_fit(float(x) * fitted.parameter.scale)
            for fitted, x in zip(self.numbers, self.x, strict=True)
        }

    @property
    def cross_validated_rms(self) -> float:
        """Root mean square of `left_out`, in weights, by which hypotheses are chosen."""
        return _rms(self.left_out)

    @property
    def fitted_rms(self) -> float:
        """Root mean square of `residual`, in weights."""
        return _rms(self.residual)

    @property
    def left_out_error_rms(self) -> float:
        """The same for a reader: of the errors themselves, gross ones not made smaller."""
        return _rms(untempered(self.left_out))


def fit(
    problem: Problem,
    terms: Sequence[Term],
    known: dict[tuple[str, str], float] | None = None,
    cross_validate: bool = True,
    thorough: bool = False,
    scan: bool = False,
    most: int = MOST_FIT_STEPS,
    worth: float = math.inf,
) -> Fit:
    """Return the least-squares fit of a hypothesis.

    Args:
        problem: trials and twin.
        terms: the hypothesis.
        known: values to start from, by effect and parameter.
        cross_validate: whether to work out `left_out`; otherwise it is the residual.
        thorough: search for the bottom of a valley in which numbers trade against one another.
        scan: start from the best point of a grid over the effects' numbers, if that is better: there may
            be a lesser minimum nearer to the known values.
        most: steps of the search, unless it is thorough.
        worth: root mean square, in weights, below which a hypothesis must stay to matter. One that errs by
            more on the rows it was fitted to does so on rows left out, so that a rough `left_out` will do;
            it is never taken (`Fit.rough`).
    """
    numbers = fitted_numbers(problem, terms)
    block = blocks_of(problem)
    box = box_of(numbers)
    x = np.clip(start_of(numbers, known), *box)
    if len(numbers) == 0:
        error = residuals(problem, numbers, x[None])[0]
        empty = np.zeros((len(error), 0))
        return Fit(tuple(terms), numbers, x, error, empty, np.zeros(0, bool), block, error)
    task = FitTask(problem, numbers, box, prior_of(numbers))
    if scan:
        x = best_of_grid(task, x, known or ())
    if thorough:
        at = task.linearised(descend_valley(task, x))
    else:
        at = descend(task, task.linearised(x), most=most)
    null = start_of(numbers, {fitted.key: fitted.parameter.null for fitted in numbers})
    rested = np.where(influential(at.jacobian), at.x, null)
    if (rested != at.x).any():  # a number without influence has the value that does nothing
        there = task.residuals(rested[None])[0]
        if task.cost(there, rested) <= task.cost(at.error, at.x):
            at = task.linearised(rested, there)
    held = held_at_bound(at.x, *box, task.prior.gradient(at.x) + at.jacobian.T @ at.error)
    rough = _rms(at.error) > worth
    left_out = left_out_residuals(task, at, block, not rough) if cross_validate else at.error
    return Fit(tuple(terms), numbers, at.x, at.error, at.jacobian, held, block, left_out, rough)


def left_out_anew(problem: Problem, found: Fit) -> Fit:
    """Return a fit with `left_out` as `problem` leaves rows out; the fit's own problem did otherwise."""
    block = blocks_of(problem)
    if not len(found.numbers):
        return replace(found, block=block)
    task = FitTask(problem, found.numbers, box_of(found.numbers), prior_of(found.numbers))
    at = Linearised(found.x, found.residual, found.jacobian)
    return replace(found, block=block, left_out=left_out_residuals(task, at, block, not found.rough))


def _rms(error: Array) -> float:
    return float(np.sqrt(np.mean(error**2)))
