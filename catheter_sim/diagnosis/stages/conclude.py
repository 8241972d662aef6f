"""What is told: the reported hypothesis with its figures, its equals, and the notes on it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from catheter_sim.diagnosis.base_frame.registration import registration_notes
from catheter_sim.diagnosis.causes.again import equals_of
from catheter_sim.diagnosis.causes.comparison import rival_groups
from catheter_sim.diagnosis.causes.heldout_choice import also_equal_on_heldout, heldout_choice_note
from catheter_sim.diagnosis.causes.plausible import implausible_notes, parted
from catheter_sim.diagnosis.causes.weighing import weighing_notes
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.report.result import Cause, StructureTest, TrialFit, UnitResult
from catheter_sim.diagnosis.stages.calibrate import Calibrated
from catheter_sim.diagnosis.stages.choose_causes import Choice
from catheter_sim.diagnosis.stages.decide_on_heldout import Settled
from catheter_sim.diagnosis.stages.judge import Verdict
from catheter_sim.diagnosis.stages.pose import Posed
from catheter_sim.diagnosis.stages.replay_in_mujoco import Replayed
from catheter_sim.diagnosis.stages.run import Run
from catheter_sim.diagnosis.verdict.agreement import agreement_with_simulation
from catheter_sim.diagnosis.verdict.further_numbers import doubts, further_numbers
from catheter_sim.diagnosis.verdict.harm import harm_note
from catheter_sim.diagnosis.verdict.heldout_figures import trial_fits
from catheter_sim.diagnosis.verdict.rules import most_error_remains, remainder_note


@dataclass(frozen=True)
class Conclusion:
    """What is reported.

    Attributes:
        fit: the reported hypothesis.
        by_unit: its held-out figures.
        causes: its causes with their shares of the gain; (): none is named.
        absorbs: causes by whose numbers the best hypothesis soaks up what is missing; none of them is named.
        equals: hypotheses that do as well, another effect in the place of one of its causes.
        groups: names of effects that these data cannot tell apart, the named one first.
        fits: every trial, computed before and by this hypothesis.
        structure: tests of the residuals, by stage.
        frame: fitted numbers of the tracker's frame, by name.
        further: further numbers, by name, unit included.
        notes: on all of that.
    """

    fit: Fit
    by_unit: Mapping[str, UnitResult]
    causes: tuple[Cause, ...]
    absorbs: tuple[Cause, ...]
    equals: tuple[Fit, ...]
    groups: tuple[tuple[str, ...], ...]
    fits: tuple[TrialFit, ...]
    structure: Mapping[str, tuple[StructureTest, ...]]
    frame: Mapping[str, float]
    further: Mapping[str, float]
    notes: tuple[Note, ...]


def concluded_plainly(posed: Posed, before: Calibrated, settled: Settled, verdict: Verdict) -> Conclusion:
    """Return the reported hypothesis with its figures and nothing else, where the rest could not be told."""
    shown, by_unit = verdict.shown, settled.weighed.by_unit
    causes, _ = parted(settled.weighed.causes, settled.weighed.after)
    if not verdict.names_causes:
        causes, by_unit = (), settled.scales.held_out(shown)
    trials = (*posed.train.trials, *posed.heldout.trials)
    fits = trial_fits(posed.train, trials, before.fit, shown)
    return Conclusion(shown, dict(by_unit), causes, (), (), (), fits, verdict.structure, {}, {}, ())


def conclude(
    run: Run,
    posed: Posed,
    before: Calibrated,
    choice: Choice,
    settled: Settled,
    verdict: Verdict,
    replayed: Replayed,
) -> Conclusion:
    """Return what is reported: the settled hypothesis if its causes are named, else the calibrated model."""
    shown, fits, structure = verdict.shown, verdict.fits, dict(verdict.structure)
    by_unit = settled.weighed.by_unit
    causes, absorbs = parted(settled.weighed.causes, settled.weighed.after)
    if not verdict.names_causes:
        by_unit, causes = settled.scales.held_out(shown), ()
        trials = (*posed.train.trials, *posed.heldout.trials)
        fits = trial_fits(posed.train, trials, before.fit, before.fit)
        structure["after"] = structure["before"]
    equals = _equals(run, posed, choice, settled) if causes else ()
    equals = tuple(item for item in equals if rival_groups(shown, [item]))
    frame = {
        name: value
        for (effect, name), value in shown.values.items()
        if not effect and name in posed.registration.free
    }
    notes = [
        *registration_notes(posed.registration, frame),
        *_notes_on_causes(posed, choice, settled, verdict, replayed),
    ]
    further, said = further_numbers(posed.train, fits, shown)
    if verdict.names_causes:
        further |= _as_chosen_in_training(posed, before, choice, settled)
    notes += [*said, *doubts(causes, by_unit)]
    if replayed.replays:
        found, said = agreement_with_simulation(posed.train, posed.heldout.trials, replayed.replays, fits)
        further |= found
        notes += said
    return Conclusion(
        fit=shown,
        by_unit=dict(by_unit),
        causes=causes,
        absorbs=absorbs,
        equals=equals,
        groups=rival_groups(shown, equals),
        fits=fits,
        structure=structure,
        frame=frame,
        further=further,
        notes=tuple(notes),
    )


def _equals(run: Run, posed: Posed, choice: Choice, settled: Settled) -> tuple[Fit, ...]:
    """Return what does as well as the settled hypothesis, on the training and the held-out trials."""
    weighed = settled.weighed
    if not weighed.weak and not weighed.unsure:
        return settled.equals
    # What was found to be as good was fitted beside causes that are gone now.
    equals = equals_of(posed.train, weighed.after, choice.candidates, run.pool)
    return also_equal_on_heldout(posed.train, posed.heldout, weighed.after, equals, posed.thorough, run.pool)


def _notes_on_causes(
    posed: Posed, choice: Choice, settled: Settled, verdict: Verdict, replayed: Replayed
) -> list[Note]:
    """Return what to say of causes that are named, of those that are not, and why."""
    weighed = settled.weighed
    result = weighed.by_unit[settled.unit]
    notes = []
    if choice.selection.unfinished:
        notes.append(
            Note(
                "search_unfinished",
                "Time ran out before the search for causes ended: what is told is the best so far.",
            )
        )
    if set(weighed.after.causes) - set(choice.fit.causes) and verdict.names_causes:
        notes.append(heldout_choice_note(choice.fit, weighed.after))
    much_left = most_error_remains(result, posed.train.model_share)
    if weighed.after.terms and (verdict.remainder is not None or much_left):
        notes.append(remainder_note(weighed.after, result, verdict.remainder, verdict.in_part))
    if weighed.after.terms and verdict.harms and not verdict.names_causes:
        notes.append(harm_note(weighed.after, verdict.harms))
    notes += implausible_notes(weighed.after)
    if verdict.names_causes:
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
