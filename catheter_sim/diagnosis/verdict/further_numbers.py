"""Further numbers of the held-out trials for a reader, and what to doubt."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from catheter_sim.diagnosis.data.columns import TIP
from catheter_sim.diagnosis.fitting.evidence import tip_errors
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.noise import times_noise
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.report.result import Cause, TrialFit, UnitResult
from catheter_sim.diagnosis.thresholds import DOUBT_NOISE


def further_numbers(
    problem: Problem, fits: Sequence[TrialFit], after: Fit
) -> tuple[dict[str, float], list[Note]]:
    """Return further figures of the held-out trials, and notes about the fit."""
    extra: dict[str, float] = {}
    notes = []
    heldout = [item for item in fits if item.role == "heldout"]
    if all(name in problem.columns for name in TIP):
        for stage in ("before", "after"):
            columns = {
                name: [(getattr(item, stage).columns[name], item.measured.columns[name]) for item in heldout]
                for name in TIP
            }
            extra |= {f"heldout_{name.format(stage)}": value for name, value in tip_errors(columns).items()}
        said = (
            "The tip error is a distance in space. RMSE counts every output by itself. An aligned error is "
            "without its mean offset over the held-out rows."
        )
        notes.append(Note("how_errors_count", said))
    if not problem.nuisances:
        said = (
            "Nothing was calibrated: no calibration range is known for this robot. Before is the robot as "
            "its file specifies it, in the tracker's frame as given."
        )
        notes.append(Note("nothing_calibrated", said))
    for fitted, stuck in zip(after.numbers, after.held, strict=True):
        if stuck and fitted.effect:
            said = f"{fitted.effect}.{fitted.parameter.name} is at its bound, where its interval ends."
            notes.append(Note("number_at_bound", said))
    return extra, notes


def doubts(causes: Sequence[Cause], by_unit: Mapping[str, UnitResult]) -> list[Note]:
    """Return doubts about the causes: a note for each unit in which much error is left."""
    notes = []
    for unit, result in by_unit.items():
        times = times_noise(result.rmse_after, result.noise_floor)
        if causes and times > DOUBT_NOISE:
            said = (
                f"The remaining error [{unit}] is {times:.0f} times the row-to-row noise. Most of it is "
                "unexplained."
            )
            notes.append(Note("error_left", said))
    return notes
