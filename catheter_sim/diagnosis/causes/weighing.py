"""Which of the chosen causes stay named: each must pay on the held-out trials, and surely do something.

Causes are taken out one at a time, since without one of them another may be needed. A cause surely does
something if the printed interval of one of its numbers does not hold the value that does nothing. The
simulation widens these intervals (`intervals.model_margin`), so that the causes are weighed again after the
replay.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.causes.plausible import implausible
from catheter_sim.diagnosis.causes.shares import named_causes
from catheter_sim.diagnosis.causes.support import needed, not_significant, weakest_cause, without_support
from catheter_sim.diagnosis.fitting.fit import Fit, fit
from catheter_sim.diagnosis.fitting.intervals import cause_intervals
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.fitting.workers import SERIAL, Workers
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.report.result import Cause, UnitResult
from catheter_sim.diagnosis.verdict.heldout_figures import held_out


@dataclass(frozen=True)
class Scales:
    """What causes are weighed on.

    Attributes:
        problem: the training trials.
        test: the held-out trials.
        before: the calibrated model without causes.
        noise: of each unit.
        unit: in which shares of the gain are counted.
        thorough: as for `fit`.
        pool: where to fit.
    """

    problem: Problem
    test: Problem
    before: Fit
    noise: Mapping[str, float]
    unit: str
    thorough: bool
    pool: Workers = SERIAL

    def held_out(self, after: Fit) -> dict[str, UnitResult]:
        """Return the held-out figures of a hypothesis, by unit."""
        return held_out(self.problem, self.test, self.before, after, self.noise)

    def causes(self, after: Fit, by_unit: Mapping[str, UnitResult]) -> tuple[Cause, ...]:
        """Return its causes with their shares of the gain."""
        return named_causes(self.problem, self.test, after, by_unit[self.unit], self.unit, self.pool)


@dataclass(frozen=True)
class Weighed:
    """A hypothesis whose causes were weighed.

    Attributes:
        after: the hypothesis with those that are left, fitted to all training rows.
        by_unit: its held-out figures.
        causes: with their shares of the gain.
        weak: causes taken out since they do not pay on the held-out trials.
        unsure: those taken out since their intervals hold the values that do nothing.
        needed: causes of which the same is true, but without which the error is far larger.
        suspects: the first that did not pay (`support.without_support`); None: all did.
    """

    after: Fit
    by_unit: Mapping[str, UnitResult]
    causes: tuple[Cause, ...]
    weak: tuple[str, ...] = ()
    unsure: tuple[str, ...] = ()
    needed: tuple[str, ...] = ()
    suspects: tuple[str, ...] | None = None


def with_shares(scales: Scales, after: Fit) -> Weighed:
    """Return a hypothesis with its held-out figures and its causes' shares, nothing taken out yet."""
    by_unit = scales.held_out(after)
    return Weighed(after, by_unit, scales.causes(after, by_unit))


def weigh(scales: Scales, weighed: Weighed, shift: Array | None = None) -> Weighed:
    """Return a hypothesis without the causes that do not pay or may do nothing.

    Args:
        scales: what to weigh on.
        weighed: the hypothesis, and what was taken out of it already.
        shift: by how much the simulation would change its numbers (`intervals.shift_by_model`); it belongs to
            this hypothesis alone. None: unknown.
    """
    after, by_unit, causes = weighed.after, weighed.by_unit, weighed.causes
    weak, unsure, sure, suspects = weighed.weak, weighed.unsure, weighed.needed, weighed.suspects
    while after.terms:
        unsupported = without_support(causes, suspects)
        ends = cause_intervals(after, shift if after is weighed.after else None)
        doubted = () if unsupported else [name for name in not_significant(after, ends) if name not in sure]
        least = weakest_cause(causes, unsupported or doubted)
        if not least:
            break
        terms = tuple(term for term in after.terms if term.effect not in least)
        without = fit(scales.problem, terms, after.values, cross_validate=False, thorough=scales.thorough)
        by_unit_without = scales.held_out(without)
        if unsupported:
            suspects = suspects or unsupported
            weak += least
        elif needed(by_unit, by_unit_without):
            sure += least
            continue
        else:
            unsure += least
        after, by_unit = without, by_unit_without
        causes = scales.causes(after, by_unit)
    return Weighed(after, by_unit, causes, weak, unsure, sure, suspects)


def without_soaking(scales: Scales, weighed: Weighed) -> tuple[Weighed, tuple[Cause, ...]]:
    """Return a hypothesis without causes whose numbers are not plausible, and those causes, one at a time.

    Without one that soaks up what is missing another's numbers may be plausible: the one with the least share
    of the gain goes first.
    """
    soaked: tuple[Cause, ...] = ()
    while True:
        not_likely = implausible(weighed.after)
        names = weakest_cause(weighed.causes, tuple(not_likely))
        if not names:
            return weighed, soaked
        soaked += tuple(replace(item, plausible=False) for item in weighed.causes if item.name in names)
        terms = tuple(term for term in weighed.after.terms if term.effect not in names)
        after = fit(
            scales.problem, terms, weighed.after.values, cross_validate=False, thorough=scales.thorough
        )
        left = with_shares(scales, after)
        weighed = weigh(scales, replace(left, weak=weighed.weak, unsure=weighed.unsure))


def weighing_notes(weighed: Weighed, shift: Array | None) -> list[Note]:
    """Return what to say of causes that were taken out, and of those that stay whatever their intervals."""
    notes = [
        Note(
            "no_gain_on_heldout",
            f"{name.replace('_', ' ')} lowers the error inside the training data, but not on the held-out "
            "data. It is not named.",
        )
        for name in weighed.weak
    ]
    notes += [
        Note(
            "may_be_nothing",
            f"{name.replace('_', ' ')} lowers the error, but the intervals of its numbers hold the values "
            "without effect. It is not named.",
        )
        for name in weighed.unsure
    ]
    open_ones = not_significant(weighed.after, cause_intervals(weighed.after, shift))
    notes += [
        Note(
            "named_though_open",
            f"Each number of {name.replace('_', ' ')} may be zero by itself, since others can replace it. It "
            "is kept because the held-out error is far larger without all of them.",
        )
        for name in weighed.needed
        if name in open_ones
    ]
    return notes
