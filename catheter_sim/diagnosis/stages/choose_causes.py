"""Causes chosen inside the training trials, and fitted to all their rows."""

from __future__ import annotations

from dataclasses import dataclass

from catheter_sim.diagnosis.causes.choose import Selection, candidates_for, select
from catheter_sim.diagnosis.causes.forms import in_best_forms
from catheter_sim.diagnosis.fitting.fit import Fit, fit
from catheter_sim.diagnosis.stages.find_data_faults import Faults
from catheter_sim.diagnosis.stages.pose import Posed
from catheter_sim.diagnosis.stages.run import Run
from catheter_sim.diagnosis.thresholds import MOST_CAUSES


@dataclass(frozen=True)
class Choice:
    """What was chosen before the held-out trials were looked at.

    Attributes:
        candidates: the effects that were tried; (): none, since the data look wrong.
        selection: what the search tried and chose, by few rows.
        fit: the chosen hypothesis, each cause in its best form, fitted to every training row.
    """

    candidates: tuple[str, ...]
    selection: Selection
    fit: Fit


def choose_causes(run: Run, posed: Posed, faults: Faults, most: int = MOST_CAUSES) -> Choice:
    """Return the causes that explain the training trials, at most so many; none where the data look wrong."""
    run.say("choosing causes")
    candidates = () if faults.found else candidates_for(posed.train)
    selection = select(posed.train, candidates, run.pool, run.say, run.deadline, most)
    run.say("fitting the chosen causes")
    chosen = selection.chosen
    fitted = fit(posed.train, chosen.terms, chosen.values, cross_validate=False, thorough=posed.thorough)
    fitted = in_best_forms(posed.train, fitted, posed.thorough, run.pool, run.deadline)
    return Choice(candidates, selection, fitted)
