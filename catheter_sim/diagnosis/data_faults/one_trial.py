"""One trial with columns swapped, turned in sign, in another unit, or with its inputs' zero off."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import drives_of
from catheter_sim.core.drive import Quantity
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.data_faults.beside_model import BesideModel
from catheter_sim.diagnosis.data_faults.mistakes import Mistake, most_likely_mistake
from catheter_sim.diagnosis.report.result import DataFault
from catheter_sim.diagnosis.thresholds import (
    GROSS_SHARE,
    MISTAKE_SOLVED_SHARE,
    ONE_TRIAL_TIMES,
    OUTSTANDING_SHARE,
    ZERO_CONVINCING,
    ZERO_TIMES,
    ZEROS_TRIED,
)


def mistakes_of_one_trial(
    seen: BesideModel, robot: RobotSpec, predict: Callable[[Inputs], Array]
) -> tuple[DataFault, ...]:
    """Return the trials in which the model errs far more than in others, but for one mistake.

    In the middle trial it must err far less: a cause of an error is at work in all of them. With the mistake
    put right the model must meet the trial no worse than that one, or well.
    """
    errors = seen.error_shares
    usual = float(np.median(errors))
    faults = []
    for number in np.argsort(errors)[::-1].tolist():
        if errors[number] <= ONE_TRIAL_TIMES * usual:
            break
        trial = seen.trials[number]
        found = None
        if errors[number] > GROSS_SHARE:
            everything = np.concatenate(list(seen.models))
            found = most_likely_mistake(
                [trial],
                seen.columns,
                robot,
                predict,
                beside=everything,
                solved=max(MISTAKE_SOLVED_SHARE, usual),
            )
        if errors[number] > ZERO_TIMES * np.delete(errors, number).max():
            found = found or _zero_off(seen, number, robot, predict, usual)
        if found is not None:
            faults.append(
                DataFault(
                    f"{found.words}. If you correct that, the model's error falls from "
                    f"{100 * found.before:.0f} to {100 * found.error:.0f} % of the spread. The other trials "
                    "have no such mistake.",
                    trial.file,
                )
            )
    return tuple(faults)


def _zero_off(
    seen: BesideModel, number: int, robot: RobotSpec, predict: Callable[[Inputs], Array], usual: float
) -> Mistake | None:
    """Return how far the zero of a trial's inputs looks off; None: it does not, or something else is wrong.

    In several trials that is a cause. With it put right this trial must be explained about as well as others.
    """
    given = seen.trials[number].inputs
    drives = drives_of(robot, given.actuation)
    count = given.tendon.shape[1]
    largest = np.max([np.abs(trial.inputs.tendon).max(axis=0) for trial in seen.trials], axis=0)
    moved = np.flatnonzero(largest > 0.0)
    choices = [(largest, "the inputs")]
    if len(drives) == count and len(moved) > 1:
        choices += [(largest * (np.arange(count) == k), drives[k].column) for k in moved.tolist()]
    before = float(seen.error_shares[number])
    best = Mistake("", before)
    for zero, name in choices:
        for share in (sign * size for size in ZEROS_TRIED for sign in (1.0, -1.0)):
            tendon = given.tendon - share * zero
            if drives[0].quantity is Quantity.TENSION:
                tendon = np.maximum(tendon, 0.0)
            error = seen.error_share(number, predict(replace(given, tendon=tendon)))
            if error < best.error:
                words = f"The zero of {name} looks off by about {100 * share:.0f} % of the largest value"
                best = Mistake(words, error, before)
    solved = best.error < min(ZERO_CONVINCING * before, max(ONE_TRIAL_TIMES * usual, OUTSTANDING_SHARE))
    return best if solved else None
