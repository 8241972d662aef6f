"""How a robot changed over several recordings."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from catheter_sim.diagnosis.changes.compare import (
    Changes,
    Earlier,
    OneRobot,
    best_comparison,
    change_of,
    check_pair,
    compared,
    not_compared,
)
from catheter_sim.diagnosis.changes.differences import (
    Baseline,
    Differences,
    NumberCourse,
    baseline,
    course_of,
    differences,
    share_paired,
)
from catheter_sim.diagnosis.fit import fit
from catheter_sim.diagnosis.intervals import cause_intervals
from catheter_sim.diagnosis.notes import Attempts
from catheter_sim.diagnosis.prepare import DiagnosisRun, running, split_problem
from catheter_sim.diagnosis.problem import Term
from catheter_sim.diagnosis.report import with_notes
from catheter_sim.diagnosis.result import DATA_SUSPECT, FittedParameter
from catheter_sim.diagnosis.thresholds import COMPARING_BUDGET_S, MOSTLY_PAIRED, NEAR_NOISE
from catheter_sim.diagnosis.trials import Dataset
from catheter_sim.diagnosis.workers import SERIAL, Workers
from catheter_sim.errors import InputError


@dataclass(frozen=True)
class NumberOverTime:
    """A number of a cause that changed, over all recordings.

    `changes`: since the first recording, of each recording, the first one's 0. A number that is infinite in
    the first one is told as it is.
    """

    cause: str
    parameter: str
    changes: tuple[FittedParameter, ...]
    course: NumberCourse


@dataclass(frozen=True)
class Series:
    """Several recordings of one robot, in the order given.

    The `comparisons` are of each later one with the first; `numbers`, of every cause that changed in any of
    them.
    """

    comparisons: tuple[Changes, ...]
    numbers: tuple[NumberOverTime, ...]

    @property
    def last(self) -> Changes:
        """Return the comparison of the last recording with the first."""
        return self.comparisons[-1]

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the recordings."""
        return (self.last.since, *(item.name for item in self.comparisons))


def compare_series(
    before: Sequence[Earlier],
    after: Dataset,
    place: Workers = SERIAL,
    progress: bool = False,
    simulation: bool = True,
    budget_s: float = COMPARING_BUDGET_S,
    search_anyway: bool = False,
) -> Series:
    """Return what changed over several recordings of a robot.

    `before` are the earlier recordings in their order; the others are compared with the first one. The other
    arguments are those of `diagnose_dataset`.

    Raises:
        InputError: there is none before, robots or outputs differ, or the first one looks wrong by itself.
    """
    if not before:
        raise InputError("no earlier recording to compare with")
    first, *others = before
    later = [*(item.dataset for item in others), after]
    for dataset in (*(item.dataset for item in others if not item.is_of_report), after):
        check_pair(first, dataset)
    lacking = tuple(not_compared(first.dataset, dataset, search_anyway) for dataset in later)
    if all(lacking):
        return Series(tuple(item for item in lacking if item is not None), ())
    with running(place, progress, budget_s, search_anyway) as run:
        begun, attempt = time.monotonic(), Attempts()
        bases: dict[bool, Baseline] = {}
        found: list[tuple[Baseline, Differences]] = []
        comparisons = []
        for number, dataset in enumerate(later):
            mine = _with_a_share(run, len(later) - number)
            paired = share_paired(dataset, first.dataset) >= MOSTLY_PAIRED
            if paired not in bases:
                bases[paired] = baseline(mine, first.dataset, is_paired=paired)
            found.append((bases[paired], differences(dataset, bases[paired])))
            comparisons.append(compared(mine, *found[-1], simulation))
        suspect = comparisons[0].verdict == DATA_SUSPECT
        if len(later) == 1 and not first.is_of_report and (suspect or found[0][0].misfit > NEAR_NOISE):
            more = replace(run, deadline=min(run.deadline, _soon_after(begun)))
            same = None if paired else OneRobot(found[0][0], after, found[0][1])
            plain = comparisons[0]
            comparisons[0] = attempt(
                "What other ways to compare say",
                lambda: best_comparison(more, first.dataset, after, plain, same, simulation),
                lambda: plain,
            )
        numbers: tuple[NumberOverTime, ...] = ()
        if len(later) > 1:
            numbers = attempt("How numbers went", lambda: tuple(_numbers(found, comparisons)), lambda: ())
    last = comparisons[-1]
    comparisons[-1] = replace(last, diagnosis=with_notes(last.diagnosis, attempt))
    return Series(tuple(comparisons), numbers)


def _soon_after(begun: float) -> float:
    """Return when a minute will have gone by, or as long as since `begun` [s, `time.monotonic`]."""
    now = time.monotonic()
    return now + max(60.0, now - begun)


def _with_a_share(run: DiagnosisRun, remaining: int) -> DiagnosisRun:
    """Return a run that ends with its part of the time that is left."""
    now = time.monotonic()
    return replace(run, deadline=now + (run.deadline - now) / remaining)


def _numbers(
    found: Sequence[tuple[Baseline, Differences]], comparisons: Sequence[Changes]
) -> Iterator[NumberOverTime]:
    """Yield every number of the causes that changed in any recording, fitted in all of them."""
    terms = changed_terms(comparisons)
    fitted = [_fitted(base, later, terms) for base, later in found]
    for term in terms:
        for name in term.free:
            values = [item[term.effect, name] for item in fitted]
            changes = [
                change_of(value, base.relative_error) for value, (base, _) in zip(values, found, strict=True)
            ]
            yield NumberOverTime(term.effect, name, (_at_first(values[0]), *changes), _course(changes))


def changed_terms(comparisons: Sequence[Changes]) -> tuple[Term, ...]:
    """Return the causes that changed in any recording, each with the numbers that explained most."""
    best: dict[str, tuple[float, Term]] = {}
    for item in comparisons:
        for cause in item.changes:
            known = best.get(cause.name)
            if known is None or cause.gain_percent > known[0]:
                best[cause.name] = cause.gain_percent, Term(cause.name, tuple(cause.parameters))
    return tuple(term for _, term in best.values())


def _fitted(
    base: Baseline, later: Differences, terms: Sequence[Term]
) -> dict[tuple[str, str], FittedParameter]:
    """Return the numbers of some causes in one recording, with their intervals."""
    result = fit(split_problem(later.prepared).train, terms, cross_validate=False, scan=True)
    ends, values = cause_intervals(result), result.values
    return {
        item.key: FittedParameter(values[item.key], ends[item.key], item.parameter.null)
        for item in result.numbers
    }


def _at_first(value: FittedParameter) -> FittedParameter:
    """Return a number's change in the first recording: none; of one that is infinite there, itself."""
    null = value.null or 0.0
    change = 0.0 if math.isfinite(null) else null
    return FittedParameter(change, (change, change), change)


def _course(changes: Sequence[FittedParameter]) -> NumberCourse:
    """Return how a number went; of one that is infinite in the first recording, its inverse."""
    low, high = np.array([item.ci95 for item in changes]).T
    values = np.array([item.value for item in changes])
    if any(not math.isfinite(item.null or 0.0) for item in changes):
        with np.errstate(divide="ignore"):
            values, low, high = 1.0 / values, 1.0 / high, 1.0 / low
    return course_of(values, np.abs(high - low) / (2.0 * float(norm.ppf(0.975))))
