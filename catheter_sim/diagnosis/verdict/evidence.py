"""What speaks for and against every cause, in numbers from trials that no fit had seen.

All numbers are measures of `causes.scored.surety`: by how many standard deviations of chance one hypothesis
does better than another, stretch by stretch.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.causes.scored import Scored, cost_of, stretch_sums, surety
from catheter_sim.diagnosis.fitting.problem import Problem, with_fewer_rows
from catheter_sim.diagnosis.thresholds import UNLISTED_SINGLES
from catheter_sim.diagnosis.verdict.discrepancy import explained
from catheter_sim.effects import EFFECTS


@dataclass(frozen=True)
class CauseEvidence:
    """What speaks for one cause, or for a group of causes that the data cannot tell apart.

    Attributes:
        named: it is among the causes of the hypothesis.
        over_others: how surely the hypothesis does better than the best one without the cause, or any of its
            group; of a cause that the hypothesis does not have, how surely the best one in which it stands in
            the place of a cause does better than the hypothesis (mostly below zero).
        over_unknown: how surely the hypothesis does better on the held-out trials than that one without the
            cause and with a smooth error of unknown cause in its place (`verdict.discrepancy`); 0 for a cause
            that the hypothesis does not have.
        ratio: by what factor the error of the one without the cause is larger, of the one in its place
            smaller [natural logarithm].
        numbers: how many more numbers the one without the cause has, or the one in its place.
        members: of a group: the others, which stand in the cause's place, with how surely it does better than
            each.
    """

    named: bool
    over_others: float
    over_unknown: float = 0.0
    ratio: float = 0.0
    numbers: int = 0
    members: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Evidence:
    """What speaks for every cause, for none, and for something outside the list.

    Attributes:
        causes: by name; one that no hypothesis has is missing.
        over_none: how surely the best hypothesis does better than the calibrated model.
        number: of the sets of causes that were tried.
        times_noise: largest held-out error of the hypothesis over the noise floor, of any unit.
        times_before: the same of the calibrated model without causes.
        unknown: how surely a smooth error of unknown cause, beside the hypothesis, does better on the
            held-out trials.
        unknown_share: of the hypothesis's held-out squares, which it takes away.
        structure: share of what is left that depends on one thing, of the strongest test that shows any
            (`rules.strongest_structure`); 0 where none does.
        values: measured, by which hypotheses are compared.
        harmful: the hypothesis makes some output, unit or trial worse (`verdict.harm`).
    """

    causes: Mapping[str, CauseEvidence]
    over_none: float
    number: int
    times_noise: float
    unknown: float
    unknown_share: float
    times_before: float = 1.0
    structure: float = 0.0
    harmful: bool = False
    values: int = 0


def evidence(
    problem: Problem,
    test: Problem,
    hypotheses: Sequence[Scored],
    settled: Sequence[str],
    alike: Mapping[str, Mapping[str, float]],
    times: tuple[float, float],
    structure: float = 0.0,
    harmful: bool = False,
) -> Evidence:
    """Return what speaks for every cause.

    Args:
        problem: the training trials.
        test: the held-out trials.
        hypotheses: every set that was tried, the one that is asked about and the one without causes among
            them.
        settled: the causes of the one that is asked about.
        alike: by causes of that one, what the data cannot tell from it (`groups.alike_groups`).
        times: the held-out error before and after over the noise.
        structure, harmful: as of `Evidence`.
    """
    few = with_fewer_rows(problem)
    named = tuple(sorted(settled))
    mine = next(item for item in hypotheses if item.causes == named)
    null = next(item for item in hypotheses if not item.causes)
    best = min(hypotheses, key=cost_of)
    standing_in = {name for others in alike.values() for name in others}
    found = {}
    for name in EFFECTS:
        if name in named:
            members = alike.get(name, {})
            others = [item for item in hypotheses if not {name, *members} & set(item.causes)]
            other = min(others, key=cost_of)
            unknown = _over_unknown(few, test, other, mine)
            found[name] = _beside(other, mine, named=True, over_unknown=unknown, members=members)
        elif name not in standing_in:
            rivals = [item for item in hypotheses if name in item.causes and _stands_in(item.causes, named)]
            if rivals:
                found[name] = _beside(min(rivals, key=cost_of), mine, named=False)
    beside = _with_unknown(few, test, mine)
    own = stretch_sums(mine.heldout_block, mine.heldout)
    return Evidence(
        causes=found,
        over_none=surety(null.squares, best.squares),
        number=len(hypotheses),
        times_noise=times[1],
        unknown=surety(own, beside),
        unknown_share=1.0 - float(beside.sum()) / max(float(own.sum()), 1e-300),
        times_before=times[0],
        structure=structure,
        harmful=harmful,
        values=len(mine.fit.left_out) + len(mine.heldout),
    )


@dataclass(frozen=True)
class UnlistedForm:
    """One cause in a form that is not listed, in the place of many corrections.

    Attributes:
        name: of the cause whose simplest form explains most with a smooth error of unknown cause beside it.
        surer: how surely the corrections do better on the held-out trials [standard deviations of chance].
    """

    name: str
    surer: float


def one_unlisted_form(
    problem: Problem, test: Problem, hypotheses: Sequence[Scored], settled: Sequence[str]
) -> UnlistedForm | None:
    """Return the single cause that does best with a smooth error beside it; None: no single was fitted.

    A smooth function of the commands stands for what the cause's listed forms lack.

    Args:
        problem: the training trials.
        test: the held-out trials.
        hypotheses: every set that was tried.
        settled: the corrections.
    """
    few = with_fewer_rows(problem)
    mine = next(item for item in hypotheses if item.causes == tuple(sorted(settled)))
    own = stretch_sums(mine.heldout_block, mine.heldout)
    singles = sorted((item for item in hypotheses if len(item.causes) == 1), key=cost_of)
    found = [(_with_unknown(few, test, item), item.causes[0]) for item in singles[:UNLISTED_SINGLES]]
    if not found:
        return None
    squares, name = min(found, key=lambda pair: float(pair[0].sum()))
    return UnlistedForm(name, surety(squares, own))


def _beside(
    other: Scored,
    mine: Scored,
    named: bool,
    over_unknown: float = 0.0,
    members: Mapping[str, float] | None = None,
) -> CauseEvidence:
    """Return what speaks for a cause of the hypothesis `mine`, or for one of `other` in its place."""
    worse, better = (other, mine) if named else (mine, other)
    ratio = 0.5 * math.log(max(cost_of(worse), 1e-300) / max(cost_of(better), 1e-300))
    more = len(other.fit.numbers) - len(mine.fit.numbers)
    return CauseEvidence(
        named, surety(worse.squares, better.squares), over_unknown, ratio, more, members or {}
    )


def as_numbers(found: Evidence) -> dict[str, dict[str, float]]:
    """Return evidence as the numbers of a document; a group's other members stand as further keys."""
    causes = {
        name: {
            "named": float(item.named),
            "over_others": item.over_others,
            "over_unknown": item.over_unknown,
            "ratio": item.ratio,
            "numbers": float(item.numbers),
            **{f"over_{member}": value for member, value in item.members.items()},
        }
        for name, item in found.causes.items()
    }
    whole = {
        "over_none": found.over_none,
        "sets_tried": float(found.number),
        "times_noise": found.times_noise,
        "times_before": found.times_before,
        "unknown": found.unknown,
        "unknown_share": found.unknown_share,
        "structure": found.structure,
        "harmful": float(found.harmful),
        "values": float(found.values),
    }
    return {**causes, "all": whole}


def from_numbers(document: Mapping[str, Mapping[str, float]]) -> Evidence:
    """Return the evidence of which `as_numbers` made a document."""
    whole = document["all"]
    causes = {
        name: CauseEvidence(
            bool(item["named"]),
            item["over_others"],
            item["over_unknown"],
            item["ratio"],
            int(item["numbers"]),
            {other: item[f"over_{other}"] for other in EFFECTS if f"over_{other}" in item},
        )
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
        whole["times_before"],
        whole["structure"],
        bool(whole["harmful"]),
        int(whole["values"]),
    )


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
