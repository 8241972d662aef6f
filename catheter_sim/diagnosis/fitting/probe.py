"""How far one step from a fit toward a larger hypothesis gets: a cheap way to rank what is worth fitting."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.least_squares import damped_step
from catheter_sim.diagnosis.fitting.prior import prior_of
from catheter_sim.diagnosis.fitting.problem import Problem, Term, fitted_numbers, start_of
from catheter_sim.diagnosis.fitting.residuals import residuals
from catheter_sim.diagnosis.thresholds import DERIVATIVE_STEP


def probe(
    problem: Problem, current: Fit, terms: Sequence[Term]
) -> tuple[float, dict[tuple[str, str], float]]:
    """Return what one Gauss-Newton step from `current` to the hypothesis `terms` reaches.

    Returns:
        The sum of squared residuals, and the values there by effect and parameter. The derivative by
        what `current` already fits is taken over from it, so that a probe costs little.
    """
    numbers = fitted_numbers(problem, terms)
    known = carried_over(current, terms)
    bounds = np.array([fitted.parameter.fit_bounds for fitted in numbers]).reshape(-1, 2)
    scale = np.array([fitted.parameter.scale for fitted in numbers])
    low, high = bounds[:, 0] / scale, bounds[:, 1] / scale
    x = np.clip(start_of(numbers, known), low, high)
    old = {fitted.key: column for column, fitted in enumerate(current.numbers)}
    new = [index for index, fitted in enumerate(numbers) if fitted.key not in old]
    step = np.where(x + DERIVATIVE_STEP > high, -DERIVATIVE_STEP, DERIVATIVE_STEP)
    errors = residuals(problem, numbers, np.concatenate([x[None], x + np.diag(step)[new]]))
    jacobian = np.empty((errors.shape[1], len(numbers)))
    for index, fitted in enumerate(numbers):
        if fitted.key in old:
            jacobian[:, index] = current.jacobian[:, old[fitted.key]]
    for row, index in enumerate(new):
        jacobian[:, index] = (errors[row + 1] - errors[0]) / step[index]
    prior = prior_of(numbers)
    points = np.array(
        [
            np.clip(x + damped_step(jacobian, errors[0], x, (low, high), factor, prior), low, high)
            for factor in (1e-3, 0.3, 10.0)
        ]
    )
    costs = (residuals(problem, numbers, points) ** 2).sum(axis=1)
    best = int(np.argmin(costs))
    values = {
        fitted.key: fitted.parameter.from_fit(float(value) * fitted.parameter.scale)
        for fitted, value in zip(numbers, points[best], strict=True)
    }
    return float(costs[best]), values


def carried_over(current: Fit, terms: Sequence[Term]) -> dict[tuple[str, str], float]:
    """Return the values of `current`; a common parameter's value also for each parameter that details it.
    `offset_base_1_mm` details `offset_mm`: it has the same words in the same order, and others between.
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
