"""What to measure next."""

from __future__ import annotations

import numpy as np

from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.next_experiment.propose import next_experiment
from catheter_sim.diagnosis.report.next_experiment import NextExperiment
from catheter_sim.diagnosis.stages.conclude import Conclusion
from catheter_sim.diagnosis.stages.pose import Posed
from catheter_sim.diagnosis.stages.run import Run


def nothing_planned() -> NextExperiment:
    """Return what is said where no experiment could be planned."""
    return NextExperiment("No next experiment could be planned.")


def plan_next_experiment(run: Run, posed: Posed, conclusion: Conclusion, simulation: bool) -> NextExperiment:
    """Return what to measure next, tried in the twin, and in the simulation if `simulation`."""
    run.say("looking for what to measure next")
    return next_experiment(
        posed.train,
        conclusion.fit,
        tuple(cause.name for cause in (*conclusion.causes, *conclusion.corrections)),
        conclusion.equals,
        conclusion.groups,
        np.array([conclusion.by_unit[unit_of(name)].noise_floor for name in posed.train.columns]),
        posed.dataset.gravity_mps2,
        simulation,
        run.pool,
        run.deadline,
    )
