"""Whether trials that the model meets worse than others are wrong, or show a cause more than others do.

A curved tube bends a catheter more in the trials that push it out far, a zero that creeps shows in the
longest trial. So where only some trials look wrong, single causes are fitted to all. If with one of them the
data look sound by every check, and no trial is met worse than before, nothing is wrong with the data.
"""

from __future__ import annotations

from catheter_sim.diagnosis.causes.choose import candidates_for, singles_of
from catheter_sim.diagnosis.data_faults.model_error import errors_in_noise
from catheter_sim.diagnosis.fitting.fit import fit
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
    heldout, trials = posed.heldout.trials, (*posed.train.trials, *posed.heldout.trials)
    errors = errors_in_noise(posed.train, before.fit, trials, before.noise)
    for single in singles[:ACQUITTING]:
        found = fit(posed.train, single.terms, single.values, cross_validate=False)
        no_worse = errors_in_noise(posed.train, found, trials, before.noise) <= ACQUITTED_SHARE * errors
        if no_worse.all() and not data_faults(posed.train, found, heldout, before.noise).found:
            return Faults(())
    return faults
