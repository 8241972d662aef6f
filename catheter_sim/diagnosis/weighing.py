"""Which of the chosen causes stay named: each must pay on the held-out trials, and be surely something.

Causes are taken out one at a time, since without one another may be needed. What decides whether a number is
surely something is the interval that the report prints. The simulation widens it (`intervals.model_margin`),
so that the causes are weighed a second time once the simulation has been asked.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from catheter_sim.diagnosis.findings import held_out, named_causes
from catheter_sim.diagnosis.fit import Fit, fit
from catheter_sim.diagnosis.hypothesis import Problem
from catheter_sim.diagnosis.intervals import cause_intervals
from catheter_sim.diagnosis.result import Cause, UnitResult
from catheter_sim.diagnosis.verdict import could_be_nothing, least_of, needed, unsupported
from catheter_sim.diagnosis.workers import HERE, Workers
from catheter_sim.robots.posture import Array


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
    pool: Workers = HERE

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
        suspects: the first that did not pay (`verdict.unsupported`); None: all did.
    """

    after: Fit
    by_unit: Mapping[str, UnitResult]
    causes: tuple[Cause, ...]
    weak: tuple[str, ...] = ()
    unsure: tuple[str, ...] = ()
    needed: tuple[str, ...] = ()
    suspects: tuple[str, ...] | None = None


def put_on(scales: Scales, after: Fit) -> Weighed:
    """Return a hypothesis with its figures, nothing taken out yet."""
    by_unit = scales.held_out(after)
    return Weighed(after, by_unit, scales.causes(after, by_unit))


def weigh(scales: Scales, weighed: Weighed, shift: Array | None = None) -> Weighed:
    """Return what is left of a hypothesis when causes that do not pay, or may be nothing, are taken out.

    Args:
        scales: what to weigh on.
        weighed: the hypothesis, and what was taken out of it already.
        shift: by how much the simulation would change its numbers (`intervals.shift_by_model`); it belongs to
            this hypothesis alone. None: unknown.
    """
    after, by_unit, causes = weighed.after, weighed.by_unit, weighed.causes
    weak, unsure, sure, suspects = weighed.weak, weighed.unsure, weighed.needed, weighed.suspects
    while after.terms:
        spared = unsupported(causes, suspects)
        ends = cause_intervals(after, shift if after is weighed.after else None)
        doubted = () if spared else [name for name in could_be_nothing(after, ends) if name not in sure]
        least = least_of(causes, spared or doubted)
        if not least:
            break
        terms = tuple(term for term in after.terms if term.effect not in least)
        without = fit(scales.problem, terms, after.values, cross_validate=False, thorough=scales.thorough)
        by_unit_without = scales.held_out(without)
        if spared:
            suspects = suspects or spared
            weak += least
        elif needed(by_unit, by_unit_without):
            sure += least
            continue
        else:
            unsure += least
        after, by_unit = without, by_unit_without
        causes = scales.causes(after, by_unit)
    return Weighed(after, by_unit, causes, weak, unsure, sure, suspects)


def weighing_notes(weighed: Weighed, shift: Array | None) -> list[str]:
    """Return what to say of causes that were taken out, and of those that stay whatever their intervals."""
    notes = [
        f"{name.replace('_', ' ')} pays on stretches left out of the training data, but not on the "
        "held-out data, and is not named."
        for name in weighed.weak
    ]
    notes += [
        f"{name.replace('_', ' ')} pays, but its numbers' intervals hold the values that do nothing: it "
        "is not named."
        for name in weighed.unsure
    ]
    open_ones = could_be_nothing(weighed.after, cause_intervals(weighed.after, shift))
    notes += [
        f"Each number of {name.replace('_', ' ')} by itself may be nothing, since it trades against others; "
        "it is named because without all of them the held-out error is far larger."
        for name in weighed.needed
        if name in open_ones
    ]
    return notes
