"""How far one step from a fit toward a larger hypothesis gets: a cheap way to rank what is worth fitting.

The derivative by a term's numbers beside a fit (`tangent`) is worked out once and serves every hypothesis
that adds this term there. By it small matrices tell what a step reaches (`foreseen`). Of the few best the
step is computed with the full model (`reached`).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.least_squares import Linearised, damped_step
from catheter_sim.diagnosis.fitting.prior import prior_of
from catheter_sim.diagnosis.fitting.problem import (
    FittedNumber,
    Problem,
    Term,
    box_of,
    fitted_numbers,
    start_of,
)
from catheter_sim.diagnosis.fitting.residuals import residuals
from catheter_sim.diagnosis.thresholds import DERIVATIVE_STEP, PROBE_DAMPINGS, PROBE_HALVINGS, SHORTLIST


@dataclass(frozen=True)
class Tangent:
    """What a change of a fit's hypothesis does, to first order: a term more, or one less.

    Attributes:
        error: the residual with the new numbers at their start, shape (n,).
        keys: the numbers that the fit does not have, by effect and parameter; k of them.
        columns: the derivative by these, shape (n, k).
    """

    error: Array
    keys: tuple[tuple[str, str], ...]
    columns: Array
    SHAPES = "error:n keys:k columns:nk"  # of what is read (`kept`)


@dataclass(frozen=True)
class Foreseen:
    """What a step toward a hypothesis reaches, by the derivative alone.

    Attributes:
        cost: the least sum of squares.
        points: where it and the same with other dampings lead, the best first, shape (3, p).
    """

    cost: float
    points: Array


def beside(terms: tuple[Term, ...], extra: Term) -> tuple[Term, ...]:
    """Return `terms` with `extra`, in the place of another variant of its effect; () if not new."""
    if extra in terms:
        return ()
    return (*(term for term in terms if term.effect != extra.effect), extra)


def tangent(problem: Problem, current: Fit, term: Term) -> Tangent:
    """Return what `term` does beside `current`, in the place of another variant of its effect there."""
    return _toward(problem, current, beside(current.terms, term))


def without(problem: Problem, current: Fit, term: Term) -> Tangent:
    """Return what it does to take `term` from `current`. Known-uncertain numbers that it had superseded come
    back; the others stay as they are."""
    return _toward(problem, current, tuple(item for item in current.terms if item is not term))


def _toward(problem: Problem, current: Fit, terms: tuple[Term, ...]) -> Tangent:
    numbers = fitted_numbers(problem, terms)
    x, high = _start(current, terms, numbers)
    old = {fitted.key for fitted in current.numbers}
    new = [index for index, fitted in enumerate(numbers) if fitted.key not in old]
    step = np.where(x + DERIVATIVE_STEP > high, -DERIVATIVE_STEP, DERIVATIVE_STEP)
    beside_it = x + np.diag(step)[new]
    if _does_nothing(current, numbers, x):
        error, beside_error = current.residual, residuals(problem, numbers, beside_it)
    else:
        error, *others = residuals(problem, numbers, np.concatenate([x[None], beside_it]))
        beside_error = np.array(others).reshape(len(new), len(error))
    columns = ((beside_error - error) / step[new][:, None]).T
    return Tangent(error, tuple(numbers[index].key for index in new), columns)


def _does_nothing(current: Fit, numbers: Sequence[FittedNumber], x: Array) -> bool:
    """Return whether `numbers` at `x` (p,) are those of a fit, and others at the value that does nothing."""
    mine = {fitted.key: float(value) for fitted, value in zip(current.numbers, current.x, strict=True)}
    null = start_of(numbers, {fitted.key: fitted.parameter.null for fitted in numbers})
    same = [
        mine.pop(fitted.key, nothing) == value
        for fitted, nothing, value in zip(numbers, null, x, strict=True)
    ]
    return all(same) and not mine


def foreseen(problem: Problem, current: Fit, terms: Sequence[Term], changes: Sequence[Tangent]) -> Foreseen:
    """Return what a step from `current` to the hypothesis `terms` reaches, to first order.

    Args:
        problem: trials and twin.
        current: where from.
        terms: the hypothesis.
        changes: the tangents of `current` without each of the terms that `terms` lacks, then of each further
            one beside `current`.
    """
    numbers = fitted_numbers(problem, terms)
    x, _ = _start(current, terms, numbers)
    box = box_of(numbers)
    error = current.residual
    columns = {fitted.key: column for fitted, column in zip(current.numbers, current.jacobian.T, strict=True)}
    for change in changes:
        columns |= dict(zip(change.keys, change.columns.T, strict=True))
        error = error + (change.error - current.residual)
    jacobian = np.stack([columns[fitted.key] for fitted in numbers], axis=-1)
    at, prior = Linearised(x, error, jacobian), prior_of(numbers)
    points = np.array([np.clip(x + damped_step(at, box, damping, prior), *box) for damping in PROBE_DAMPINGS])
    errors = error + (points - x) @ jacobian.T
    costs = [float(item @ item) + prior.cost(point) for item, point in zip(errors, points, strict=True)]
    order = np.argsort(costs, kind="stable")
    return Foreseen(costs[order[0]], points[order])


def misled(ahead: Foreseen, current: Fit, terms: Sequence[Term]) -> bool:
    """Return whether a forecast says that it makes things worse to add a term to `current`.

    A term does nothing at some value, so that its derivative, where its numbers start, tells nothing.
    """
    return set(current.terms) <= set(terms) and ahead.cost > float(current.residual @ current.residual)


def shortlist(order: Sequence[int], count: int, unknown: Collection[int]) -> list[int]:
    """Return the first `count` and `SHORTLIST` more of the hypotheses, and the `unknown` ones of the others.

    Args:
        order: of hypotheses, best foreseen first.
        count: how many are to be picked.
        unknown: of which the forecast tells nothing.
    """
    return [index for place, index in enumerate(order) if place < count + SHORTLIST or index in unknown]


def reached(
    problem: Problem, current: Fit, terms: Sequence[Term], points: Array
) -> tuple[float, dict[tuple[str, str], float]]:
    """Return the least sum of squares at any of `points` (k, p), and the values there by effect and
    parameter.

    Where a term is added to `current` and all points are worse than it, halfway back to it counts too: a
    number that starts far from what does nothing (a width of play) may have stepped beyond what is true.
    """
    numbers = fitted_numbers(problem, terms)
    costs = (residuals(problem, numbers, points) ** 2).sum(axis=1)
    best = int(np.argmin(costs))
    cost, x = float(costs[best]), points[best]
    if not set(current.terms) <= set(terms):
        return cost, values_at(problem, terms, x)
    worse = float(current.residual @ current.residual)
    nothing = {fitted.key: fitted.parameter.null for fitted in numbers} | carried_over(current, terms)
    back = np.clip(start_of(numbers, nothing), *box_of(numbers))
    nearer = x
    for _ in range(PROBE_HALVINGS):
        if cost < worse:
            break
        nearer = 0.5 * (back + nearer)
        (error,) = residuals(problem, numbers, nearer[None])
        if error @ error < cost:
            cost, x = float(error @ error), nearer
    return cost, values_at(problem, terms, x)


def values_at(problem: Problem, terms: Sequence[Term], x: Array) -> dict[tuple[str, str], float]:
    """Return the numbers of a hypothesis at `x` (p,) in the parameters' units, by effect and parameter."""
    return {
        fitted.key: fitted.parameter.from_fit(float(value) * fitted.parameter.scale)
        for fitted, value in zip(fitted_numbers(problem, terms), x, strict=True)
    }


def _start(current: Fit, terms: Sequence[Term], numbers: Sequence[FittedNumber]) -> tuple[Array, Array]:
    """Return where a step from `current` begins, and the upper bounds, each (p,)."""
    low, high = box_of(numbers)
    return np.clip(start_of(numbers, carried_over(current, terms)), low, high), high


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
