"""What is reported: the hypothesis with its figures, its causes and corrections, and the notes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from catheter_sim.diagnosis.base_frame.registration import registration_notes
from catheter_sim.diagnosis.causes.comparison import rivals_of
from catheter_sim.diagnosis.causes.heldout_choice import heldout_choice_note
from catheter_sim.diagnosis.causes.plausible import soaking_notes
from catheter_sim.diagnosis.causes.weighing import weighing_notes
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.report.result import Cause, StructureTest, TrialFit, UnitResult
from catheter_sim.diagnosis.stages.calibrate import Calibrated
from catheter_sim.diagnosis.stages.choose_causes import Choice
from catheter_sim.diagnosis.stages.decide_on_heldout import Settled
from catheter_sim.diagnosis.stages.examine import Examined
from catheter_sim.diagnosis.stages.judge import Verdict
from catheter_sim.diagnosis.stages.pose import Posed
from catheter_sim.diagnosis.stages.replay_in_mujoco import Replayed
from catheter_sim.diagnosis.stages.score_hypotheses import Scores
from catheter_sim.diagnosis.thresholds import DISCREPANCY_SURE
from catheter_sim.diagnosis.verdict.agreement import agreement_with_simulation
from catheter_sim.diagnosis.verdict.further_numbers import doubts, further_numbers
from catheter_sim.diagnosis.verdict.harm import harm_note
from catheter_sim.diagnosis.verdict.heldout_figures import trial_fits
from catheter_sim.diagnosis.verdict.probabilities import Beliefs
from catheter_sim.diagnosis.verdict.rules import remainder_note, unproved_note


@dataclass(frozen=True)
class Conclusion:
    """What is reported.

    Attributes:
        fit: the reported hypothesis.
        by_unit: its held-out figures.
        causes: its established causes, the most probable first.
        corrections: its other causes, the most probable first.
        absorbs: causes by whose numbers the best hypothesis soaks up what is missing; none of them is in the
            reported one.
        equals: hypotheses that do as well, another effect in the place of one of its causes.
        groups: names of effects that these data cannot tell apart, the reported one first.
        fits: every trial, computed before and by this hypothesis.
        structure: tests of the residuals, by stage.
        frame: fitted numbers of the tracker's frame, by name.
        further: further numbers, by name, unit included.
        notes: on all of that.
    """

    fit: Fit
    by_unit: Mapping[str, UnitResult]
    causes: tuple[Cause, ...]
    corrections: tuple[Cause, ...]
    absorbs: tuple[Cause, ...]
    equals: tuple[Fit, ...]
    groups: tuple[tuple[str, ...], ...]
    fits: tuple[TrialFit, ...]
    structure: Mapping[str, tuple[StructureTest, ...]]
    frame: Mapping[str, float]
    further: Mapping[str, float]
    notes: tuple[Note, ...]


def concluded_plainly(
    posed: Posed, before: Calibrated, settled: Settled, examined: Examined, scores: Scores, verdict: Verdict
) -> Conclusion:
    """Return the reported hypothesis with its figures and nothing else, where the rest could not be told."""
    shown, by_unit = verdict.shown, settled.weighed.by_unit
    ordered = by_probability(settled.weighed.causes, scores.beliefs)
    if not verdict.corrects:
        ordered, by_unit = (), settled.scales.held_out(shown)
    causes = tuple(cause for cause in ordered if cause.name in verdict.established)
    corrections = tuple(cause for cause in ordered if cause not in causes)
    trials = (*posed.train.trials, *posed.heldout.trials)
    fits = trial_fits(posed.train, trials, before.fit, shown)
    structure = examined.structure
    return Conclusion(shown, dict(by_unit), causes, corrections, (), (), (), fits, structure, {}, {}, ())


def conclude(
    posed: Posed,
    before: Calibrated,
    choice: Choice,
    settled: Settled,
    examined: Examined,
    scores: Scores,
    verdict: Verdict,
    replayed: Replayed,
) -> Conclusion:
    """Return what is reported: the hypothesis that is left, or the calibrated model if that is no better."""
    shown, fits, structure = verdict.shown, examined.fits, dict(examined.structure)
    by_unit, ordered = settled.weighed.by_unit, by_probability(settled.weighed.causes, scores.beliefs)
    groups = tuple(cause.one_of for cause in ordered if len(cause.one_of) > 1)
    alike = scores.beliefs.members
    rivals = rivals_of(settled.weighed.after, settled.equals)
    equals = tuple(item for name, rival, item in rivals if rival in alike.get(name, {}))
    if not verdict.corrects:
        by_unit, ordered, groups, equals = settled.scales.held_out(shown), (), (), ()
        trials = (*posed.train.trials, *posed.heldout.trials)
        fits = trial_fits(posed.train, trials, before.fit, before.fit)
        structure["after"] = structure["before"]
    causes = tuple(cause for cause in ordered if cause.name in verdict.established)
    frame = {
        name: value
        for (effect, name), value in shown.values.items()
        if not effect and name in posed.registration.free
    }
    notes = [
        *registration_notes(posed.registration, frame),
        *_notes_on_causes(choice, settled, examined, scores, verdict, replayed),
    ]
    further, said = further_numbers(posed.train, fits, shown)
    if verdict.corrects:
        further |= _as_chosen_in_training(posed, before, choice, settled)
    notes += [*said, *doubts(ordered, by_unit)]
    if replayed.replays:
        found, said = agreement_with_simulation(posed.train, posed.heldout.trials, replayed.replays, fits)
        further |= found
        notes += said
    return Conclusion(
        fit=shown,
        by_unit=dict(by_unit),
        causes=causes,
        corrections=tuple(cause for cause in ordered if cause not in causes),
        absorbs=tuple(
            replace(item, probability=scores.beliefs.groups.get(item.name, item.probability))
            for item in settled.soaked
        ),
        equals=equals,
        groups=groups,
        fits=fits,
        structure=structure,
        frame=frame,
        further=further,
        notes=tuple(notes),
    )


def by_probability(causes: tuple[Cause, ...], believed: Beliefs) -> tuple[Cause, ...]:
    """Return the causes with their probabilities and groups, the most probable first."""
    found = [
        replace(
            cause,
            probability=believed.groups.get(cause.name, cause.probability),
            members=believed.members.get(cause.name, {}),
        )
        for cause in causes
    ]
    return tuple(sorted(found, key=lambda cause: -cause.probability))


def _notes_on_causes(
    choice: Choice,
    settled: Settled,
    examined: Examined,
    scores: Scores,
    verdict: Verdict,
    replayed: Replayed,
) -> list[Note]:
    """Return what to say of causes that are reported, of those that are not, and why."""
    weighed = settled.weighed
    notes = []
    if choice.selection.unfinished:
        notes.append(
            Note(
                "search_unfinished",
                "Time ran out before the search for causes ended. The report shows the best set so far.",
            )
        )
    if set(weighed.after.causes) - set(choice.fit.causes) and verdict.corrects:
        notes.append(heldout_choice_note(choice.fit, weighed.after))
    if weighed.after.terms and verdict.more_is_wrong:
        notes.append(remainder_note(weighed.after, weighed.by_unit[settled.unit], examined.remainder))
    if weighed.after.terms and examined.harms and not verdict.corrects:
        notes.append(harm_note(weighed.after, examined.harms))
    if verdict.unproved:
        notes.append(unproved_note(verdict.unproved))
    notes += soaking_notes(settled.soaked)
    unlisted = scores.unlisted
    if verdict.corrects and unlisted is not None and unlisted.surer < DISCREPANCY_SURE:
        notes.append(
            Note(
                "one_unlisted_form",
                f"{unlisted.name.replace('_', ' ').capitalize()} alone, in a form that is not listed, may "
                f"replace these {len(weighed.after.causes)} corrections. With a smooth error beside it, it "
                "explains the held-out data as well.",
            )
        )
    if verdict.corrects:
        notes += weighing_notes(weighed, replayed.shift)
    return notes


def _as_chosen_in_training(
    posed: Posed, before: Calibrated, choice: Choice, settled: Settled
) -> dict[str, float]:
    """Return the held-out numbers of the hypothesis as it was chosen, where another one is reported."""
    if settled.weighed.after is choice.fit:
        return {}
    fits = trial_fits(posed.train, posed.heldout.trials, before.fit, choice.fit)
    found, _ = further_numbers(posed.train, fits, choice.fit)
    return {f"{name}_as_chosen_in_training": value for name, value in found.items() if "after" in name}
