"""What looks wrong with the data themselves, before anything is blamed on the robot.

A column in other units, two columns swapped, a sensor that froze, a trial of another robot: each makes the
model err grossly, and each can be imitated by a cause of error, wrongly. They are looked for first, and
where one is found no cause is named.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.diagnosis.base_frame.registration import SHIFTS
from catheter_sim.diagnosis.data.trials import Trial, all_inputs, measured_of
from catheter_sim.diagnosis.data_faults.bumps import bumped_trackers
from catheter_sim.diagnosis.data_faults.mistakes import most_likely_mistake
from catheter_sim.diagnosis.data_faults.model_error import computed_outputs
from catheter_sim.diagnosis.data_faults.odd_trial import odd_trial
from catheter_sim.diagnosis.data_faults.unrelated import outputs_that_do_not_follow
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.prediction import predicted
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.report.result import DataFault
from catheter_sim.diagnosis.stages.calibrate import Calibrated
from catheter_sim.diagnosis.stages.pose import Posed
from catheter_sim.diagnosis.thresholds import FEWEST_VALUES

SUSPECTED = "The data look wrong, so that no cause was looked for"


@dataclass(frozen=True)
class Faults:
    """What looks wrong with the data.

    Attributes:
        found: (): the data look sound.
    """

    found: tuple[DataFault, ...]

    @property
    def notes(self) -> tuple[Note, ...]:
        """Return a note on each."""
        return tuple(Note("data_fault", f"{SUSPECTED}: {item.words}") for item in self.found)


def find_data_faults(posed: Posed, before: Calibrated) -> Faults:
    """Return what looks wrong with the data."""
    return Faults(data_faults(posed.train, before.fit, posed.heldout.trials, before.noise))


def data_faults(
    problem: Problem, before: Fit, heldout: Sequence[Trial], noise: Mapping[str, float]
) -> tuple[DataFault, ...]:
    """Return what looks wrong with the data; nothing where they look sound.

    Args:
        problem: the training trials.
        before: the calibrated model without causes.
        heldout: the held-out trials. They are asked only whether one trial is of another robot or set-up,
            and whether the tracker was bumped.
        noise: of each unit.
    """
    values = sum(int(np.isfinite(measured_of(trial, problem.columns)).sum()) for trial in problem.trials)
    if values < FEWEST_VALUES:
        return (
            DataFault(
                f"only {values} measured values to learn from: fewer than {FEWEST_VALUES} prove nothing."
            ),
        )
    if not any(np.ptp(all_inputs(trial.inputs), axis=0).any() for trial in problem.trials):
        return (DataFault("the inputs never change: nothing that depends on them can be told."),)
    models = computed_outputs(problem, before, problem.trials)
    idle = outputs_that_do_not_follow(problem, models)
    if idle:
        return idle
    shifted = any(name in SHIFTS for name in (item.name for item in problem.nuisances))
    found = most_likely_mistake(
        problem.trials,
        problem.columns,
        problem.robot,
        lambda inputs: predicted(problem, before.numbers, before.x, inputs),
        shifted,
    )
    if found is not None:
        return (
            DataFault(
                f"{found.words}: put right, the calibrated model's error falls from "
                f"{100 * found.before:.0f} to {100 * found.error:.0f} % of the measurements' spread."
            ),
        )
    trials = (*problem.trials, *heldout)
    return bumped_trackers(
        trials, problem.columns, computed_outputs(problem, before, trials), noise
    ) or odd_trial(problem, before, heldout, noise)
