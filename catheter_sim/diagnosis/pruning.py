"""Which chosen causes stay: plausible numbers, a gain of their own, and a share of what is gained."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from catheter_sim.arrays import Array
from catheter_sim.core.effect import Parameter
from catheter_sim.diagnosis.fit import Fit, fit
from catheter_sim.diagnosis.intervals import Interval, cause_intervals, intervals
from catheter_sim.diagnosis.noise import errors_of, rmse_by_unit
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.problem import Problem, with_fewer_rows
from catheter_sim.diagnosis.result import Cause, FittedParameter, UnitResult
from catheter_sim.diagnosis.thresholds import LARGE_GAIN_PERCENT
from catheter_sim.diagnosis.verdict import held_out
from catheter_sim.diagnosis.workers import SERIAL, Workers, map_calls

LEAST_GAIN_PERCENT = 0.5
"""[% of the error before] A cause with less gain on held-out data is not named. Why: assumed. Nobody would
mend such a cause."""
NO_GAIN_PERCENT = 0.1
"""[% of the error before] The same once other causes were left out. Why: small shares then move about, and
only a cause with no gain goes too."""

# ----------------------------------------------------------------------------------------------------
# Whether a cause's fitted numbers are likely at all: a fit also uses causes to soak up what is missing.


def implausible(result: Fit) -> dict[str, tuple[str, ...]]:
    """Return the numbers that are not likely, by cause; a cause all of whose numbers are is not in it.

    A number is not if it stands at a bound that is not the value that does nothing, or beyond what is likely
    of a robot that was built to its specification (`Parameter.likely`).
    """
    found: dict[str, tuple[str, ...]] = {}
    for fitted, held in zip(result.numbers, result.held, strict=True):
        value = result.values[fitted.key]
        bound = held and value != fitted.parameter.null
        if fitted.effect and (bound or not _likely(fitted.parameter, value)):
            found[fitted.effect] = (*found.get(fitted.effect, ()), fitted.parameter.name)
    return found


def soaking_notes(soaked: Sequence[Cause]) -> list[Note]:
    """Return what to say of causes that are not plausible."""
    return [
        Note(
            "not_plausible",
            f"{cause.name.replace('_', ' ').capitalize()} lowers the error only with implausible numbers: "
            f"{', '.join(cause.parameters)}. The fit uses it to take up an error of another origin, so it is "
            "left out of the corrected robot.",
        )
        for cause in soaked
    ]


def _likely(parameter: Parameter, value: float) -> bool:
    low, high = parameter.likely or (parameter.lower, parameter.upper)
    return low <= value <= high


# ----------------------------------------------------------------------------------------------------
# What speaks against naming a cause: no gain of its own, or numbers that may be nothing.


def not_significant(result: Fit, ends: Mapping[tuple[str, str], Interval]) -> tuple[str, ...]:
    """Return the causes all of whose numbers may do nothing. A number surely does something if the value that
    does nothing lies outside its 95 % interval.

    `ends`: the printed intervals (`cause_intervals`).
    """
    sure = {
        fitted.effect
        for fitted in result.numbers
        if not ends[fitted.key][0] <= fitted.parameter.null <= ends[fitted.key][1]
    }
    return tuple(name for name in result.causes if name not in sure)


def needed(by_unit: Mapping[str, UnitResult], without: Mapping[str, UnitResult]) -> bool:
    """Return whether leaving a cause out costs a large gain in some unit (`LARGE_GAIN_PERCENT`).

    Such a cause does something, whatever its intervals: where numbers trade against one another up to their
    bounds, the curvature at the fit says too little.
    """
    return any(
        by_unit[unit].gain_percent - item.gain_percent >= LARGE_GAIN_PERCENT for unit, item in without.items()
    )


def weakest_cause(causes: Sequence[Cause], names: Sequence[str]) -> tuple[str, ...]:
    """Return the one of `names` that has the least share of the held-out error; () where there is none."""
    chosen = sorted((cause.gain_percent, cause.name) for cause in causes if cause.name in names)
    return tuple(name for _, name in chosen[:1])


def without_support(causes: Sequence[Cause], suspects: Sequence[str] | None = None) -> tuple[str, ...]:
    """Return the causes, of several, without which the held-out error would be as small.

    Never all of them: of two causes that do the same, each has no share of the gain while the other is there,
    and one is needed. `suspects`: those that had none before others were left out, None where none was: then
    the shares of the rest move about, and of them only what has none at all goes too.
    """
    weak = tuple(
        cause.name
        for cause in causes
        if cause.gain_percent
        < (LEAST_GAIN_PERCENT if suspects is None or cause.name in suspects else NO_GAIN_PERCENT)
    )
    return weak if len(weak) < len(causes) else ()


# ----------------------------------------------------------------------------------------------------
# The named causes, each with its share of the held-out gain.


def named_causes(
    problem: Problem, test: Problem, after: Fit, result: UnitResult, unit: str, pool: Workers = SERIAL
) -> tuple[Cause, ...]:
    """Return the causes of a fitted hypothesis by their share of the held-out gain, largest first.

    A cause's share is the rise of the held-out error when the hypothesis is fitted without it, divided by the
    sum of these rises.
    """
    if not after.terms:
        return ()
    others = [tuple(item for item in after.terms if item is not term) for term in after.terms]
    without = map_calls(
        pool, fit, [(with_fewer_rows(problem), terms, after.values, False) for terms in others]
    )
    rises = [
        max(rmse_by_unit(test, errors_of(test, item))[unit] - result.rmse_after, 0.0) for item in without
    ]
    total = sum(rises)
    shares = [rise / total if total > 0.0 else 1.0 / len(rises) for rise in rises]
    bounds = intervals(after)
    values = after.values
    causes = []
    for term, share in zip(after.terms, shares, strict=True):
        null = {
            fitted.parameter.name: fitted.parameter.null
            for fitted in after.numbers
            if fitted.effect == term.effect
        }
        causes.append(
            Cause(
                name=term.effect,
                parameters={
                    name: FittedParameter(values[term.effect, name], bounds[term.effect, name], null[name])
                    for name in term.free
                },
                gain_percent=result.gain_percent * share,
            )
        )
    return tuple(sorted(causes, key=lambda cause: -cause.gain_percent))


def with_intervals(causes: Sequence[Cause], ends: Mapping[tuple[str, str], Interval]) -> tuple[Cause, ...]:
    """Return the causes with their parameters' intervals taken from `ends`."""
    return tuple(
        replace(
            cause,
            parameters={
                name: replace(item, ci95=ends[cause.name, name]) for name, item in cause.parameters.items()
            },
        )
        for cause in causes
    )


# ----------------------------------------------------------------------------------------------------
# Which of the chosen causes stay named: each must pay on the held-out trials, and surely do something.
#
# Causes are taken out one at a time, since without one of them another may be needed. A cause surely does
# something if the printed interval of one of its numbers does not hold the value that does nothing. The
# simulation widens these intervals (`intervals.model_margin`), so that the causes are pruned again after
# the replay.


@dataclass(frozen=True)
class Pruning:
    """What causes are pruned by.

    `problem` has the training trials, `test` the held-out ones; `before` is the calibrated model without
    causes, `noise` that of each unit. Shares of the gain are counted in `unit`.
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
class Pruned:
    """A hypothesis whose causes were pruned.

    Attributes:
        after: the hypothesis with those that are left, fitted to all training rows.
        by_unit: its held-out figures.
        causes: with their shares of the gain.
        weak: causes taken out since they do not pay on the held-out trials.
        unsure: those taken out since their intervals hold the values that do nothing.
        needed: causes of which the same is true, but without which the error is far larger.
        suspects: the first that did not pay (`without_support`); None: all did.
    """

    after: Fit
    by_unit: Mapping[str, UnitResult]
    causes: tuple[Cause, ...]
    weak: tuple[str, ...] = ()
    unsure: tuple[str, ...] = ()
    needed: tuple[str, ...] = ()
    suspects: tuple[str, ...] | None = None


def with_shares(pruning: Pruning, after: Fit) -> Pruned:
    """Return a hypothesis with its held-out figures and its causes' shares, nothing taken out yet."""
    by_unit = pruning.held_out(after)
    return Pruned(after, by_unit, pruning.causes(after, by_unit))


def prune(pruning: Pruning, pruned: Pruned, shift: Array | None = None) -> Pruned:
    """Return a hypothesis without the causes that do not pay or may do nothing.

    `shift`: by how much the simulation would change its numbers (`intervals.shift_by_model`); it belongs to
    this hypothesis alone. None: unknown.
    """
    after, by_unit, causes = pruned.after, pruned.by_unit, pruned.causes
    weak, unsure, sure, suspects = pruned.weak, pruned.unsure, pruned.needed, pruned.suspects
    while after.terms:
        unsupported = without_support(causes, suspects)
        ends = cause_intervals(after, shift if after is pruned.after else None)
        doubted = () if unsupported else [name for name in not_significant(after, ends) if name not in sure]
        least = weakest_cause(causes, unsupported or doubted)
        if not least:
            break
        terms = tuple(term for term in after.terms if term.effect not in least)
        without = fit(pruning.problem, terms, after.values, cross_validate=False, thorough=pruning.thorough)
        by_unit_without = pruning.held_out(without)
        if unsupported:
            suspects = suspects or unsupported
            weak += least
        elif needed(by_unit, by_unit_without):
            sure += least
            continue
        else:
            unsure += least
        after, by_unit = without, by_unit_without
        causes = pruning.causes(after, by_unit)
    return Pruned(after, by_unit, causes, weak, unsure, sure, suspects)


def without_soaking(pruning: Pruning, pruned: Pruned) -> tuple[Pruned, tuple[Cause, ...]]:
    """Return a hypothesis without causes whose numbers are not plausible, and those causes, one at a time.

    Without one that soaks up what is missing another's numbers may be plausible: the one with the least share
    of the gain goes first.
    """
    soaked: tuple[Cause, ...] = ()
    while True:
        not_likely = implausible(pruned.after)
        names = weakest_cause(pruned.causes, tuple(not_likely))
        if not names:
            return pruned, soaked
        soaked += tuple(replace(item, plausible=False) for item in pruned.causes if item.name in names)
        terms = tuple(term for term in pruned.after.terms if term.effect not in names)
        after = fit(
            pruning.problem, terms, pruned.after.values, cross_validate=False, thorough=pruning.thorough
        )
        left = with_shares(pruning, after)
        pruned = prune(pruning, replace(left, weak=pruned.weak, unsure=pruned.unsure))


def pruning_notes(pruned: Pruned, shift: Array | None) -> list[Note]:
    """Return what to say of causes that were taken out, and of those that stay whatever their intervals."""
    notes = [
        Note(
            "no_gain_on_heldout",
            f"{name.replace('_', ' ')} lowers the error inside the training data, but not on the held-out "
            "data. It is not named.",
        )
        for name in pruned.weak
    ]
    notes += [
        Note(
            "may_be_nothing",
            f"{name.replace('_', ' ')} lowers the error, but the intervals of its numbers hold the values "
            "without effect. It is not named.",
        )
        for name in pruned.unsure
    ]
    open_ones = not_significant(pruned.after, cause_intervals(pruned.after, shift))
    notes += [
        Note(
            "named_though_open",
            f"Each number of {name.replace('_', ' ')} may be zero by itself, since others can replace it. It "
            "is kept because the held-out error is far larger without all of them.",
        )
        for name in pruned.needed
        if name in open_ones
    ]
    return notes
