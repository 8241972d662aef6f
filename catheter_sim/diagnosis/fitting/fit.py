"""The fit of a hypothesis to trials, with its evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.core.posture import Array
from catheter_sim.diagnosis.fitting.grid import best_of_grid
from catheter_sim.diagnosis.fitting.gross_errors import untempered
from catheter_sim.diagnosis.fitting.least_squares import (
    descend,
    descend_valley,
    held_at_bound,
    influential,
    linearised,
)
from catheter_sim.diagnosis.fitting.left_out import left_out_residuals
from catheter_sim.diagnosis.fitting.prior import Prior, prior_of
from catheter_sim.diagnosis.fitting.problem import FittedNumber, Problem, Term, fitted_numbers, start_of
from catheter_sim.diagnosis.fitting.residuals import residuals
from catheter_sim.diagnosis.fitting.stretches import blocks_of


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
    """

    terms: tuple[Term, ...]
    numbers: tuple[FittedNumber, ...]
    x: Array
    residual: Array
    jacobian: Array
    held: np.ndarray
    block: np.ndarray
    left_out: Array
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
        return float(np.sqrt(np.mean(self.left_out**2)))

    @property
    def left_out_error_rms(self) -> float:
        """The same for a reader: of the errors themselves, gross ones not made smaller."""
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
    numbers = fitted_numbers(problem, terms)
    block = blocks_of(problem)
    bounds = np.array([fitted.parameter.fit_bounds for fitted in numbers]).reshape(-1, 2)
    scale = np.array([fitted.parameter.scale for fitted in numbers])
    low, high = bounds[:, 0] / scale, bounds[:, 1] / scale
    x = np.clip(start_of(numbers, known), low, high)
    if len(numbers) == 0:
        error = residuals(problem, numbers, x[None])[0]
        empty = np.zeros((len(error), 0))
        return Fit(tuple(terms), numbers, x, error, empty, np.zeros(0, bool), block, error)
    prior = prior_of(numbers)
    if scan:
        x = best_of_grid(problem, numbers, x, (low, high), prior)
    search = descend_valley if thorough else descend
    x = search(problem, numbers, x, (low, high), prior)
    error, jacobian = linearised(problem, numbers, x, high)
    null = start_of(numbers, {fitted.key: fitted.parameter.null for fitted in numbers})
    rested = np.where(influential(jacobian), x, null)
    if (rested != x).any() and _cost(problem, numbers, rested, prior) <= error @ error + prior.cost(x):
        x = rested  # a number without influence has the value that does nothing
        error, jacobian = linearised(problem, numbers, x, high)
    held = held_at_bound(x, low, high, prior.gradient(x) + jacobian.T @ error)
    left_out = error
    if cross_validate:
        left_out = left_out_residuals(problem, numbers, x, error, jacobian, block, (low, high))
    return Fit(tuple(terms), numbers, x, error, jacobian, held, block, left_out)


def _cost(problem: Problem, numbers: Sequence[FittedNumber], x: Array, prior: Prior) -> float:
    error = residuals(problem, numbers, x[None])[0]
    return float(error @ error) + prior.cost(x)
