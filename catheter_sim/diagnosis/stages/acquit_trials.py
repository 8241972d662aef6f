"""Whether trials that the model meets worse than others are wrong, or show a cause more than others do.

A curved tube bends a catheter more in the trials that push it out far, a zero that creeps shows in the
longest trial. So where only some trials look wrong, single causes are fitted to all. If with one of them the
data look sound by every check, and no trial is met worse than before, nothing is wrong with the data. Of what
a trial shows by itself (a jump, outputs that come before their inputs) more is asked: that the cause leaves
no trial, of the held-out ones none either, much more than its noise. It is not asked of a robot in motion,
where each fit costs minutes.
"""

from __future__ import annotations

import numpy as np

from catheter_sim.diagnosis.causes.again import singles_of
from catheter_sim.diagnosis.causes.choose import candidates_for
from catheter_sim.diagnosis.causes.forms import in_best_forms
from catheter_sim.diagnosis.data_faults.model_error import errors_in_noise
from catheter_sim.diagnosis.fitting.fit import fit
from catheter_sim.diagnosis.stages.calibrate import Calibrated
from catheter_sim.diagnosis.stages.find_data_faults import Faults, data_faults
from catheter_sim.diagnosis.stages.pose import Posed
from catheter_sim.diagnosis.stages.run import Run
from catheter_sim.diagnosis.thresholds import ACQUITTED_NOISE, ACQUITTED_SHARE, ACQUITTING, ANOTHER_FORM


def acquit_trials(run: Run, posed: Posed, before: Calibrated, faults: Faults) -> Faults:
    """Return `faults`, or none where they are of some trials and a single cause accounts for all trials."""
    heldout, trials = posed.heldout.trials, (*posed.train.trials, *posed.heldout.trials)
    named = {item.where for item in faults.found}
    asked = not posed.train.moving and named < {trial.file for trial in trials}
    if not faults.found or not (faults.of_trials or asked):
        return faults
    run.say("asking whether a cause is what makes some trials look wrong")
    singles = singles_of(posed.train, candidates_for(posed.train), run.pool)
    errors = errors_in_noise(posed.train, before.fit, trials, before.noise)
    most = ACQUITTED_SHARE * errors if faults.of_trials else np.full(len(errors), ACQUITTED_NOISE)
    for single in singles[:ACQUITTING]:
        found = fit(posed.train, single.terms, single.values, cross_validate=False)
        left = errors_in_noise(posed.train, found, trials, before.noise)
        if not faults.of_trials and (left <= ANOTHER_FORM * most).all():
            found = in_best_forms(posed.train, found, pool=run.pool)
            left = errors_in_noise(posed.train, found, trials, before.noise)
        accounted = left <= most
        if accounted.all() and not data_faults(posed.train, found, heldout, before.noise).found:
            return Faults(())
    return faults
