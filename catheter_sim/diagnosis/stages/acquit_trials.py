"""Whether trials that the model meets worse than others are wrong, or show a cause more than others do.

A curved tube bends a catheter more in the trials that push it out far, a zero that creeps shows in the
longest trial. So where only some trials look wrong, single causes are fitted to all. If with one of them the
data look sound by every check, and no trial is met worse than before, nothing is wrong with the data.
"""

from __future__ import annotations

import numpy as np

from catheter_sim.core.posture import Array
from catheter_sim.diagnosis.causes.choose import candidates_for, singles_of
from catheter_sim.diagnosis.data_faults.beside_model import BesideModel
from catheter_sim.diagnosis.data_faults.model_error import computed_outputs
from catheter_sim.diagnosis.fitting.fit import Fit, fit
from catheter_sim.diagnosis.stages.calibrate import Calibrated
from catheter_sim.diagnosis.stages.find_data_faults import Faults, data_faults
from catheter_sim.diagnosis.stages.pose import Posed
from catheter_sim.diagnosis.stages.run import Run
from catheter_sim.diagnosis.thresholds import ACQUITTED_SHARE, ACQUITTING


def acquit_trials(run: Run, posed: Posed, before: Calibrated, faults: Faults) -> Faults:
    """Return `faults`, or none where they are of some trials and a single cause accounts for all trials."""
    if not faults.of_trials:
        return faults
    run.say("asking whether a cause is what makes some trials look wrong")
    singles = singles_of(posed.train, candidates_for(posed.train), run.pool)
    errors = _error_shares(posed, before, before.fit)
    for single in singles[:ACQUITTING]:
        found = fit(posed.train, single.terms, single.values, cross_validate=False)
        no_worse = _error_shares(posed, before, found) <= ACQUITTED_SHARE * errors
        if no_worse.all() and not _data_faults(posed, before, found).found:
            return Faults(())
    return faults


def _data_faults(posed: Posed, before: Calibrated, found: Fit) -> Faults:
    return data_faults(posed.train, found, posed.heldout.trials, before.noise)


def _error_shares(posed: Posed, before: Calibrated, found: Fit) -> Array:
    """Return the error of each trial, training and held-out, in the same unit for every fit, shape (t,)."""
    trials = (*posed.train.trials, *posed.heldout.trials)
    models = computed_outputs(posed.train, found, trials)
    seen = BesideModel(trials, posed.train.columns, models, before.noise, posed.train.moving)
    noise = np.array([seen.noise_of(column) for column in range(len(seen.columns))])
    return np.array([np.sqrt(np.nanmean((error / noise) ** 2)) for error in seen.errors])
