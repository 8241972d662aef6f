"""Every set of causes that was tried: what it predicts for rows that it was not fitted to, and its rank."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.fit import Fit, blocks_of, column_of, fit, residuals, untempered
from catheter_sim.diagnosis.noise import rmse_by_unit
from catheter_sim.diagnosis.problem import Problem, Term, with_fewer_rows
from catheter_sim.diagnosis.result import Candidate
from catheter_sim.diagnosis.search import Selection
from catheter_sim.diagnosis.trials import unit_of

# ----------------------------------------------------------------------------------------------------
# What every set of causes that was fitted predicts for rows that it was not fitted to.
#
# One hypothesis against another is judged on stretches, not on rows: rows of one stretch err together. The
# measure is the sum of the stretches' falls of squared errors over the root of the sum of their squares. If
# neither hypothesis were the better one, each stretch's fall would be as probable the other way round, and
# the measure has mean 0 and variance 1 whatever the errors are distributed like (a sign test with sizes).


@dataclass(frozen=True)
class Scored:
    """A fitted hypothesis with what it does on rows that it was not fitted to.

    `fit` is to the rows that causes were chosen by, with the residuals of the stretches left out of it.
    `heldout`: residuals of the held-out trials, in weights, gross ones tempered, shape (n,); `heldout_block`:
    which stretch each of them belongs to.
    """

    fit: Fit
    heldout: Array
    heldout_block: np.ndarray

    @property
    def causes(self) -> tuple[str, ...]:
        """Return the hypothesis's causes, in order of their names."""
        return tuple(sorted(self.fit.causes))

    @property
    def squares(self) -> Array:
        """Return the sum of squared errors of every stretch, the training's and the held-out ones', (b,)."""
        return np.concatenate(
            [
                stretch_sums(self.fit.block, self.fit.left_out),
                stretch_sums(self.heldout_block, self.heldout),
            ]
        )


def scored(
    problem: Problem,
    test: Problem,
    selection: Selection,
    terms: Sequence[Term],
    known: Mapping[tuple[str, str], float],
) -> tuple[Scored, ...]:
    """Return every set of causes that was fitted, with what it predicts.

    Of several variants of a set (one value, or one per channel) the one that the cross-validation prefers
    stands for it. `terms` is the hypothesis that is asked about; it stands for its set, and is fitted from
    `known` to the stretches left out where it was not tried.
    """
    best: dict[tuple[str, ...], Fit] = {}
    mine = None
    for item in (selection.null, *selection.singles, *selection.tried, *selection.path):
        names = tuple(sorted(item.causes))
        if names not in best or item.cross_validated_rms < best[names].cross_validated_rms:
            best[names] = item
        if set(item.terms) == set(terms):
            mine = item
    if terms:
        mine = mine or fit(with_fewer_rows(problem), terms, dict(known))
        best[tuple(sorted(mine.causes))] = mine
    block = blocks_of(test)
    return tuple(
        Scored(item, residuals(test, item.numbers, item.x[None])[0], block) for item in best.values()
    )


def cost_of(item: Scored) -> float:
    """Return the sum of a hypothesis's squared errors on rows that it was not fitted to."""
    return float(item.squares.sum())


def stretch_sums(block: np.ndarray, residual: Array) -> Array:
    """Return the sum of squares of each stretch, shape (b,)."""
    labels = np.unique(block, return_inverse=True)[1]
    return np.bincount(labels, weights=residual**2).astype(float)


def surety(worse: Array, better: Array) -> float:
    """Return how surely squared errors fall from one hypothesis to another, in standard deviations of chance.

    Both are sums of squared errors by stretch, shape (b,).
    """
    fall = worse - better
    size = float(np.sqrt((fall**2).sum()))
    return float(fall.sum()) / size if size > 0.0 else 0.0


# ----------------------------------------------------------------------------------------------------
# Every set of causes that was fitted, by its held-out error.


def ranking(test: Problem, hypotheses: Sequence[Scored], unit: str) -> tuple[Candidate, ...]:
    """Return every set of causes that was fitted with its held-out error, best first."""
    mine = np.array([unit_of(name) == unit for name in test.columns])
    scale = float(np.sqrt(np.mean(test.weight[mine] ** 2)))
    weight = test.weight[column_of(test)]
    found = [
        Candidate(
            item.fit.causes,
            rmse_by_unit(test, untempered(item.heldout) * weight)[unit],
            item.fit.left_out_error_rms * scale,
        )
        for item in hypotheses
    ]
    return tuple(sorted(found, key=lambda candidate: candidate.heldout_rmse))
