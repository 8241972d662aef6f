"""What speaks for and against every cause, in numbers from trials that no fit had seen.

All numbers are measures of `causes.scored.surety`: by how many standard deviations of chance one hypothesis
does better than another, stretch by stretch.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.core.posture import Array
from catheter_sim.diagnosis.causes.scored import Scored, stretch_sums, surety
from catheter_sim.diagnosis.fitting.problem import Problem, with_fewer_rows
from catheter_sim.diagnosis.verdict.discrepancy import explained
from catheter_sim.effects import EFFECTS


@dataclass(frozen=True)
class CauseEvidence:
    """What speaks for one cause.

    Attributes:
        named: it is among the settled ones.
        over_others: how surely the settled hypothesis does better than the best one without the cause; of a
            cause that is not settled, how surely the best one in which it stands in the place of a settled
            one does better than the settled one (mostly below zero).
        over_unknown: how surely the settled hypothesis does better on the held-out trials than the best one
            without the cause and with a smooth error of unknown cause in its place (`verdict.discrepancy`);
            0 for a cause that is not settled.
    """

    named: bool
    over_others: float
    over_unknown: float = 0.0


@dataclass(frozen=True)
class Evidence:
    """What speaks for every cause, for none, and for something outside the list.

    Attributes:
        causes: by name; one that no hypothesis has is missing.
        over_none: how surely the best hypothesis does better than the calibrated model.
        number: of the sets of causes that were tried.
        times_noise: largest held-out error of the settled hypothesis over the noise floor, of any unit.
        unknown: how surely a smooth error of unknown cause, beside the settled hypothesis, does better on the
            held-out trials.
        unknown_share: of the settled hypothesis's held-out squares, which it takes away.
    """

    causes: Mapping[str, CauseEvidence]
    over_none: float
    number: int
    times_noise: float
    unknown: float
    unknown_share: float


def evidence(
    problem: Problem,
    test: Problem,
    hypotheses: Sequence[Scored],
    settled: Sequence[str],
    times_noise: float,
) -> Evidence:
    """Return what speaks for every cause.

    Args:
        problem: the training trials.
        test: the held-out trials.
        hypotheses: every set that was tried, the settled one and the one without causes among them.
        settled: the causes of the settled hypothesis.
        times_noise: its largest held-out error over the noise.
    """
    few = with_fewer_rows(problem)
    named = tuple(sorted(settled))
    mine = next(item for item in hypotheses if item.causes == named)
    null = next(item for item in hypotheses if not item.causes)
    best = min(hypotheses, key=_cost)
    found = {}
    for name in EFFECTS:
        if name in named:
            others = [item for item in hypotheses if name not in item.causes]
            other = min(others, key=_cost)
            found[name] = CauseEvidence(
                True, surety(other.squares, mine.squares), _over_unknown(few, test, other, mine)
            )
        else:
            rivals = [item for item in hypotheses if name in item.causes and _stands_in(item.causes, named)]
            if rivals:
                rival = min(rivals, key=_cost)
                found[name] = CauseEvidence(False, surety(mine.squares, rival.squares))
    beside = _with_unknown(few, test, mine)
    own = stretch_sums(mine.heldout_block, mine.heldout)
    return Evidence(
        causes=found,
        over_none=surety(null.squares, best.squares),
        number=len(hypotheses),
        times_noise=times_noise,
        unknown=surety(own, beside),
        unknown_share=1.0 - float(beside.sum()) / max(float(own.sum()), 1e-300),
    )


def as_numbers(found: Evidence) -> dict[str, dict[str, float]]:
    """Return evidence as the numbers of a document."""
    causes = {
        name: {"named": float(item.named), "over_others": item.over_others, "over_unknown": item.over_unknown}
        for name, item in found.causes.items()
    }
    whole = {
        "over_none": found.over_none,
        "sets_tried": float(found.number),
        "times_noise": found.times_noise,
        "unknown": found.unknown,
        "unknown_share": found.unknown_share,
    }
    return {**causes, "all": whole}


def from_numbers(document: Mapping[str, Mapping[str, float]]) -> Evidence:
    """Return the evidence of which `as_numbers` made a document."""
    whole = document["all"]
    causes = {
        name: CauseEvidence(bool(item["named"]), item["over_others"], item["over_unknown"])
        for name, item in document.items()
        if name != "all"
    }
    return Evidence(
        causes,
        whole["over_none"],
        int(whole["sets_tried"]),
        whole["times_noise"],
        whole["unknown"],
        whole["unknown_share"],
    )


def _cost(item: Scored) -> float:
    return float(item.squares.sum())


def _stands_in(causes: Sequence[str], named: Sequence[str]) -> bool:
    """Return whether a set is the settled one with at most one cause exchanged, and none more."""
    return len(causes) <= max(len(named), 1) and len(set(causes) - set(named)) == 1


def _over_unknown(few: Problem, test: Problem, other: Scored, mine: Scored) -> float:
    return surety(_with_unknown(few, test, other), stretch_sums(mine.heldout_block, mine.heldout))


def _with_unknown(few: Problem, test: Problem, item: Scored) -> Array:
    """Return a hypothesis's held-out squares by stretch, a smooth error of unknown cause beside it."""
    smooth = explained(few, item.fit.residual, item.fit.block, replace(test, every=1))
    if not np.isfinite(smooth).all():
        return stretch_sums(item.heldout_block, item.heldout)
    return stretch_sums(item.heldout_block, item.heldout - smooth)
