"""Something else that is wrong: a smooth error of unknown cause, fitted to what a hypothesis leaves.

What a model gets wrong without a name is described by functions of what was commanded: the inputs and their
squares and products, the direction and the way since it turned, the time (Kennedy and O'Hagan 2001, with a
linear basis in place of a Gaussian process). Each output has coefficients of its own, drawn towards zero
(ridge regression); how strongly, the stretches left out of the fit decide. So it costs what it needs: where
residuals are noise its coefficients stay at zero, and what it fits by accident does harm on other trials.
Brynjarsdottir and O'Hagan 2014 show why it must stand beside causes, and never in their place.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.causes.scored import stretch_sums, surety
from catheter_sim.diagnosis.data.trials import all_inputs, measured_of
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.fitting.residuals import column_of
from catheter_sim.diagnosis.fitting.stretches import fold_of
from catheter_sim.diagnosis.residuals.turning import turning_points
from catheter_sim.diagnosis.thresholds import DISCREPANCY_PRICES, DISCREPANCY_SURE, MOST_CROSSED_INPUTS


def explained(train: Problem, residual: Array, block: np.ndarray, test: Problem) -> Array:
    """Return what a smooth error of unknown cause, fitted to training residuals, predicts on other trials.

    Args:
        train: the training trials, thinned as the residuals are.
        residual: what a hypothesis leaves on them, in weights, shape (n,).
        block: which stretch each residual belongs to, shape (n,).
        test: the other trials.

    Returns:
        The predicted residuals of `test`, in weights, shape (m,).
    """
    driven = _driven(train)
    basis = _rows(train, driven)
    centre, spread = basis.mean(axis=0), basis.std(axis=0)
    use = spread > 1e-9 * max(float(spread.max(initial=0.0)), 1e-300)
    here = _with_constant((basis[:, use] - centre[use]) / spread[use])
    there = _with_constant((_rows(test, driven)[:, use] - centre[use]) / spread[use])
    column, other_column = column_of(train), column_of(test)
    found = np.zeros(len(there))
    for index in range(len(train.columns)):
        mine, others = column == index, other_column == index
        if not mine.any() or not others.any():
            continue
        weights = _ridge(here[mine], residual[mine], block[mine])
        found[others] = there[others] @ weights
    return found


def _ridge(basis: Array, values: Array, block: np.ndarray) -> Array:
    """Return the coefficients whose price does best on stretches left out; none if that may be chance."""
    fold = fold_of(block)
    left = {price: values.copy() for price in DISCREPANCY_PRICES}
    for left_out in np.unique(fold):
        away = fold == left_out
        if away.all():
            return np.zeros(basis.shape[1])
        for price, weights in _solved(basis[~away], values[~away]).items():
            left[price][away] -= basis[away] @ weights
    price = min(left, key=lambda item: float(left[item] @ left[item]))
    if surety(stretch_sums(block, values), stretch_sums(block, left[price])) < DISCREPANCY_SURE:
        return np.zeros(basis.shape[1])
    return _solved(basis, values)[price]


def _solved(basis: Array, values: Array) -> dict[float, Array]:
    """Return the ridge coefficients for every price, a share of the rows' number."""
    normal, right = basis.T @ basis, basis.T @ values
    size, turn = np.linalg.eigh(normal)
    along = turn.T @ right
    size = np.maximum(size, 0.0)
    return {price: turn @ (along / (size + price * len(values))) for price in DISCREPANCY_PRICES}


def _with_constant(basis: Array) -> Array:
    return np.hstack([np.ones((len(basis), 1)), basis])


def _driven(problem: Problem) -> np.ndarray:
    """Return the input columns that move in the training trials, each of several equal ones once."""
    rows = np.concatenate([all_inputs(trial.inputs) for trial in problem.trials])
    moving = np.flatnonzero(np.ptp(rows, axis=0) > 0.0)
    _, first = np.unique(rows[:, moving], axis=1, return_index=True)
    return np.asarray(moving[np.sort(first)])


def _rows(problem: Problem, driven: np.ndarray) -> Array:
    """Return the functions' values at every residual of a problem, shape (n, f)."""
    parts = []
    for trial in problem.trials:
        finite = np.isfinite(measured_of(trial, problem.columns)[:: problem.every])
        values = _functions(trial.inputs, driven)[:: problem.every]
        row = np.broadcast_to(np.arange(len(values))[:, None], finite.shape)[finite]
        parts.append(values[row])
    return np.concatenate(parts)


def _functions(inputs: Inputs, driven: np.ndarray) -> Array:
    """Return what an unknown error may be made of at each row, shape (r, f)."""
    rows = all_inputs(inputs)[:, driven]
    time_s = (inputs.time_s - inputs.time_s[0])[:, None]
    turned = [turning_points(values) for values in rows.T]
    direction = np.stack([item[0] for item in turned], axis=1) if turned else rows
    way = np.stack([item[1] for item in turned], axis=1) if turned else rows
    pairs = list(combinations(range(min(rows.shape[1], MOST_CROSSED_INPUTS)), 2))
    crossed = [rows[:, [a]] * rows[:, [b]] for a, b in pairs]
    powers = [rows, rows**2, rows**3]
    turns = [direction, direction * rows, way, np.abs(way) * way]
    return np.hstack([*powers, *turns, *crossed, time_s, time_s * rows])
