"""The answer where too little was measured to name any cause: no model runs for it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.data.trials import Trial
from catheter_sim.diagnosis.report.next_experiment import NextExperiment
from catheter_sim.diagnosis.report.result import DATA_SUSPECT, Diagnosis, TrialFit, UnitResult
from catheter_sim.diagnosis.stages.prepare import Prepared, Readings


def not_searched(read: Readings | Prepared) -> Diagnosis:
    """Return the diagnosis of measurements that lack something: what it is, and nothing of the robot.

    No figure is worked out, and no probability. The robot is as specified.
    """
    units = dict.fromkeys(unit_of(name) for name in read.dataset.output_channels)
    unknown = math.nan
    by_unit = {
        unit: UnitResult(unit, unknown, unknown, unknown, unknown, (unknown, unknown), unknown)
        for unit in units
    }
    return Diagnosis(
        dataset=read.dataset,
        verdict=DATA_SUSPECT,
        unit=next(iter(units)),
        by_unit=by_unit,
        causes=(),
        ranking=(),
        indistinguishable=(),
        next_experiment=NextExperiment("Record what is missing, and diagnose again."),
        extended_robot=read.dataset.robot,
        fits=tuple(_not_computed(trial) for trial in (*read.train, *read.heldout)),
        notes=read.notes,
        data_faults=(*read.faults, *read.lacking),
    )


def _not_computed(trial: Trial) -> TrialFit:
    """Return a trial as it was measured, with nothing computed beside it."""
    none = {name: np.full(len(trial.inputs), np.nan) for name in trial.outputs.columns}
    computed = replace(trial.outputs, columns=none)
    return TrialFit(trial.file, trial.role, trial.inputs.time_s, trial.outputs, computed, computed)
