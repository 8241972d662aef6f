"""The fit of a hypothesis to trials, with its evidence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
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
from catheter_sim.diagnosis.fitting.stretches import blocks_of
from catheter_sim.diagnosis.thresholds import MOST_FIT_STEPS


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
    prior = prior_of(numbers)
    if scan:
        x = best_of_grid(problem, numbers, x, box, prior, known or ())
    if thorough:
        at = linearised(problem, numbers, descend_valley(problem, numbers, x, box, prior), box[1])
    else:
        at = descend(problem, numbers, linearised(problem, numbers, x, box[1]), box, prior, most=most)
    null = start_of(numbers, {fitted.key: fitted.parameter.null for fitted in numbers})
    rested = np.where(influential(at.jacobian), at.x, null)
    if (rested != at.x).any():  # a number without influence has the value that does nothing
        there = residuals(problem, numbers, rested[None])[0]
        if there @ there + prior.cost(rested) <= at.error @ at.error + prior.cost(at.x):
            at = linearised(problem, numbers, rested, box[1], there)
    held = held_at_bound(at.x, *box, prior.gradient(at.x) + at.jacobian.T @ at.error)
    rough = _rms(at.error) > worth
    left_out = left_out_residuals(problem, numbers, at, block, box, not rough) if cross_validate else at.error
    return Fit(tuple(terms), numbers, at.x, at.error, at.jacobian, held, block, left_out, rough)


def _rms(error: Array) -> float:
    return float(np.sqrt(np.mean(error**2)))
