"""The middle stages of a diagnosis: causes are chosen, and the held-out trials decide."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.variation import MARK
from catheter_sim.diagnosis.comparison import (
    also_equal_on_heldout,
    choose_on_heldout,
    with_heldout_residuals,
)
from catheter_sim.diagnosis.faults_of_columns import errors_in_noise
from catheter_sim.diagnosis.fit import Fit, fit
from catheter_sim.diagnosis.intervals import cause_intervals
from catheter_sim.diagnosis.noise import errors_of, rmse_by_unit, times_noise
from catheter_sim.diagnosis.prepare import (
    Calibrated,
    DiagnosisRun,
    Faults,
    SplitProblem,
    data_faults,
    noise_beside,
)
from catheter_sim.diagnosis.problem import Term
from catheter_sim.diagnosis.pruning import (
    Pruned,
    Pruning,
    implausible,
    prune,
    with_intervals,
    with_shares,
    without_soaking,
)
from catheter_sim.diagnosis.result import Cause, Unproved
from catheter_sim.diagnosis.search import (
    Selection,
    candidates_for,
    equals_of,
    in_best_forms,
    select,
    singles_of,
)
from catheter_sim.diagnosis.thresholds import ANOTHER_FORM, EQUAL_FACTOR, MOST_CAUSES, PAYS_SHARE
from catheter_sim.diagnosis.varying import varying_singles
from catheter_sim.diagnosis.verdict import held_out

EXPLAINING_CAUSES = 3
"""[single causes] This many of the best are asked whether they account for trials that look wrong. Why:
assumed. What none of the first three explains is no single cause."""
EXPLAINED_SHARE = 1.1
"""[error of a trial over the error without the cause] A cause that accounts for one trial makes no other
trial worse by more. Why: errors differ by a tenth by chance. A cause that halves one trial's mistake puts
half of it on the others."""
EXPLAINED_NOISE = 1.5
"""[noise] A cause that accounts for a jump in a trial leaves no trial a larger error. Why: outliers make the
error 1.4 times the noise. A bump that no cause makes, and that is seen, leaves several times the noise."""

# ----------------------------------------------------------------------------------------------------
# Causes chosen inside the training trials, and fitted to all their rows.


@dataclass(frozen=True)
class Choice:
    """What was chosen before the held-out trials were looked at.

    `candidates` were tried (none, where the data look wrong), by few rows (`selection`); `fit` has each cause
    in its best form, fitted to every training row.
    """

    candidates: tuple[str, ...]
    selection: Selection
    fit: Fit

    def applied(self, split: SplitProblem) -> SplitProblem:
        """Return a problem whose training rows are left out of fits as the choice left them out."""
        return replace(split, train=replace(split.train, interleaved=self.selection.interleaved))


def choose_causes(run: DiagnosisRun, split: SplitProblem, faults: Faults, most: int = MOST_CAUSES) -> Choice:
    """Return the causes that explain the training trials, at most so many; none where the data look wrong."""
    run.say("choosing causes")
    candidates = () if faults.found else candidates_for(split.train)
    selection = select(split.train, candidates, run.pool, run.say, run.deadline, most)
    run.say("fitting the chosen causes")
    chosen = selection.chosen
    fitted = fit(split.train, chosen.terms, chosen.values, cross_validate=False, thorough=split.thorough)
    choice = Choice(candidates, selection, fitted)
    train = choice.applied(split).train
    fitted = in_best_forms(train, fitted, split.thorough, run.pool, run.deadline)
    return replace(choice, fit=fitted)


# ----------------------------------------------------------------------------------------------------
# What the held-out trials say of the chosen causes.
#
# They decide between hypotheses that do as well on the training trials. A cause that does not pay there is
# taken out, and so is one whose numbers are not plausible.


@dataclass(frozen=True)
class HeldoutChoice:
    """The hypothesis that the held-out trials leave.

    `soaked` are causes taken out since their numbers are not plausible; `equals` do as well on both parts,
    one other effect in each.
    """

    pruning: Pruning
    pruned: Pruned
    soaked: tuple[Cause, ...]
    equals: tuple[Fit, ...]

    @property
    def unit(self) -> str:
        """Return the unit that is reported first: the worst explained one."""
        return self.pruning.unit

    @property
    def terms(self) -> tuple[Term, ...]:
        """Return the causes that the held-out trials leave, plausible or not."""
        return (*self.pruned.after.terms, *(Term(item.name, tuple(item.parameters)) for item in self.soaked))


def no_heldout_choice(run: DiagnosisRun, split: SplitProblem, before: Calibrated) -> HeldoutChoice:
    """Return the calibrated model without causes, where none could be decided on."""
    train, heldout = split.train, split.heldout
    by_unit = held_out(train, heldout, before.fit, before.fit, before.noise)
    unit = max(by_unit, key=lambda name: times_noise(by_unit[name].rmse_after, by_unit[name].noise_floor))
    pruning = Pruning(train, heldout, before.fit, before.noise, unit, split.thorough, run.pool)
    return HeldoutChoice(pruning, Pruned(before.fit, by_unit, ()), (), ())


def decide_on_heldout(
    run: DiagnosisRun, split: SplitProblem, before: Calibrated, choice: Choice
) -> HeldoutChoice:
    """Return what the held-out trials leave of the chosen causes."""
    train, heldout = split.train, split.heldout
    chosen = without_idle_variations(split, choice.fit)
    after, equals = choose_on_heldout(
        train, heldout, chosen, choice.selection.equals, split.thorough, run.pool
    )
    noise = noise_beside(train, after)
    by_unit = held_out(train, heldout, before.fit, after, noise)
    unit = max(by_unit, key=lambda name: times_noise(by_unit[name].rmse_after, by_unit[name].noise_floor))
    run.say("testing the causes on held-out data")
    pruning = Pruning(train, heldout, before.fit, noise, unit, split.thorough, run.pool)
    return with_plausible_causes(
        run, split, choice, pruning, prune(pruning, with_shares(pruning, after)), equals
    )


def without_idle_variations(split: SplitProblem, chosen: Fit) -> Fit:
    """Return a hypothesis whose numbers vary only where that lowers the held-out error (by `PAYS_SHARE`)."""
    for term in chosen.terms:
        steady = tuple(name for name in term.free if MARK not in name)
        if steady == term.free:
            continue
        terms = [replace(item, free=steady) if item is term else item for item in chosen.terms]
        without = fit(
            split.train,
            [item for item in terms if item.free],
            chosen.values,
            cross_validate=False,
            thorough=split.thorough,
        )
        steadily, varying = (
            with_heldout_residuals(split.heldout, item).cross_validated_rms for item in (without, chosen)
        )
        if varying > (1.0 - PAYS_SHARE) * steadily:
            return without_idle_variations(split, without)
    return chosen


def with_plausible_causes(
    run: DiagnosisRun,
    split: SplitProblem,
    choice: Choice,
    pruning: Pruning,
    pruned: Pruned,
    equals: tuple[Fit, ...],
    soaked: tuple[Cause, ...] = (),
) -> HeldoutChoice:
    """Return a pruned hypothesis without what is not plausible, and with its equals.

    `equals` do as well as the hypothesis from which causes were taken out; `soaked` were not plausible
    before.
    """
    plausible, more = without_soaking(pruning, pruned)
    if plausible.after.terms and (more or pruned.weak or pruned.unsure):
        # What was found to be as good was fitted beside causes that are gone now.
        found = equals_of(split.train, plausible.after, choice.candidates, run.pool)
        equals = also_equal_on_heldout(
            split.train, split.heldout, plausible.after, found, split.thorough, run.pool
        )
    return HeldoutChoice(pruning, plausible, (*soaked, *more), equals if plausible.after.terms else ())


# ----------------------------------------------------------------------------------------------------
# What fits data that hold too little to name a cause, where a search was asked for all the same.


def fit_unproved(split: SplitProblem, choice: Choice, kept: HeldoutChoice) -> Unproved:
    """Return the hypothesis that fits: the kept one, or the simplest of the best that were tried."""
    after = kept.pruned.after
    if not after.terms:
        after = _best_tried(split, choice)
    pruning = replace(kept.pruning, noise=noise_beside(split.train, after))
    by_unit = pruning.held_out(after)
    training = rmse_by_unit(split.train, errors_of(split.train, after))
    times = max(
        times_noise(max(training.get(unit, 0.0), item.rmse_after), item.noise_floor)
        for unit, item in by_unit.items()
    )
    unlikely = implausible(after)
    causes = tuple(cause for cause in pruning.causes(after, by_unit) if cause.name not in unlikely)
    return Unproved(with_intervals(causes, cause_intervals(after)), times, by_unit)


def _best_tried(split: SplitProblem, choice: Choice) -> Fit:
    """Return the hypothesis of fewest numbers that errs as little as the best; the null where none does."""
    null = choice.selection.null
    best = min((null, *choice.selection.tried), key=lambda item: item.cross_validated_rms)
    most = min(EQUAL_FACTOR * best.cross_validated_rms, (1.0 - PAYS_SHARE) * null.cross_validated_rms)
    near = [item for item in choice.selection.tried if item.cross_validated_rms <= most and not item.rough]
    found = min(near, key=lambda item: (len(item.numbers), item.cross_validated_rms), default=null)
    return fit(split.train, found.terms, found.values, cross_validate=False, thorough=split.thorough)


# ----------------------------------------------------------------------------------------------------
# Whether trials that the model meets worse than others are wrong, or show a cause more than others do.
#
# A curved tube bends a catheter more in the trials that push it out far, a zero that creeps shows in the
# longest trial. So where only some trials look wrong, single causes are fitted to all. If with one of them
# the data look sound by every check, and no trial is met worse than before, nothing is wrong with the data.
# Of what a trial shows by itself (a jump, outputs that come before their inputs) more is asked: that the
# cause leaves no trial, of the held-out ones none either, much more than its noise. So it is of causes of
# which a number varies: a drive's zero may jump as a tracker does. These are asked where every trial has such
# rows, too: what changes sides with the input's direction leaps and comes back in all. It is not asked of a
# robot in motion, where each fit costs minutes.


def without_explained_faults(
    run: DiagnosisRun, split: SplitProblem, before: Calibrated, faults: Faults
) -> Faults:
    """Return `faults`, or none where they are of some trials and a single cause accounts for all trials."""
    trials = (*split.train.trials, *split.heldout.trials)
    files, named = {trial.file for trial in trials}, {item.where for item in faults.found}
    asked = not split.train.moving and named < files
    at_rows = not split.train.moving and named <= files and all(item.rows for item in faults.found)
    if not faults.found or not (faults.of_trials or asked or at_rows):
        return faults
    run.say("asking whether a cause is what makes some trials look wrong")
    singles = singles_of(split.train, candidates_for(split.train), run.pool)
    errors = errors_in_noise(split.train, before.fit, trials, before.noise)
    most = EXPLAINED_SHARE * errors if faults.of_trials else np.full(len(errors), EXPLAINED_NOISE)
    for single in singles[:EXPLAINING_CAUSES] if faults.of_trials or asked else ():
        found = fit(split.train, single.terms, single.values, cross_validate=False)
        left = errors_in_noise(split.train, found, trials, before.noise)
        if not faults.of_trials and (left <= ANOTHER_FORM * most).all():
            found = in_best_forms(split.train, found, pool=run.pool)
        if _accounts(split, found, before, most):
            return Faults(())
    everything = replace(split.train, trials=trials)  # only they say together when a number stepped
    candidates = candidates_for(split.train)
    for single in varying_singles(everything, candidates, run.pool) if asked or at_rows else ():
        found = fit(everything, single.terms, single.values, cross_validate=False)
        if _accounts(split, found, before, np.full(len(errors), EXPLAINED_NOISE)):
            return Faults(())
    return faults


def _accounts(split: SplitProblem, found: Fit, before: Calibrated, most: Array) -> bool:
    """Return whether a cause leaves no trial more than so many times its noise, and the data look sound."""
    heldout, trials = split.heldout.trials, (*split.train.trials, *split.heldout.trials)
    left = errors_in_noise(split.train, found, trials, before.noise)
    return bool((left <= most).all()) and not data_faults(split.train, found, heldout, before.noise).found
