"""One trial with columns swapped, turned in sign, in another unit, or with its inputs' zero off."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.data_faults.beside_model import BesideModel
from catheter_sim.diagnosis.data_faults.mistakes import most_likely_mistake
from catheter_sim.diagnosis.data_faults.model_error import relative_error
from catheter_sim.diagnosis.report.result import DataFault
from catheter_sim.diagnosis.thresholds import GROSS_SHARE, ONE_TRIAL_TIMES


def mistakes_of_one_trial(
    seen: BesideModel, robot: RobotSpec, predict: Callable[[Inputs], Array]
) -> tuple[DataFault, ...]:
    """Return the trials in which the model errs grossly, and would not with one mistake put right.

    In most trials it must err far less: a cause of an error is at work in all of them.
    """
    errors = _errors(seen)
    usual = float(np.median(errors))
    faults = []
    for number in np.argsort(errors)[::-1].tolist():
        if errors[number] <= max(GROSS_SHARE, ONE_TRIAL_TIMES * usual):
            break
        trial = seen.trials[number]
        found = most_likely_mistake([trial], seen.columns, robot, predict, alone=True)
        if found is not None:
            faults.append(
                DataFault(
                    f"{found.words}: put right, the calibrated model's error falls from "
                    f"{100 * found.before:.0f} to {100 * found.error:.0f} % of this trial's spread; in the "
                    "other trials there is no such mistake.",
                    trial.file,
                )
            )
    return tuple(faults)


def _errors(seen: BesideModel) -> Array:
    """Return each trial's error over the spread of what the model says of all trials, shape (t,)."""
    everything = np.concatenate(list(seen.models))
    return np.array(
        [
            _finite(relative_error([model], [measured], seen.columns, False, beside=everything))
            for model, measured in zip(seen.models, seen.measured, strict=True)
        ]
    )


def _finite(value: float) -> float:
    return value if np.isfinite(value) else 1e9
