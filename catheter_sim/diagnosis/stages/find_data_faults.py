"""What looks wrong with the data themselves, before anything is blamed on the robot.

A column in other units, two columns swapped, a sensor that froze, a trial of another robot: each makes the
model err grossly, and each can be imitated by a cause of error, wrongly. They are looked for first, and
where one is found no cause is named. What speaks against some trials alone may be a cause that these trials
call upon more than others: see `acquit_trials`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.base_frame.registration import SHIFTS
from catheter_sim.diagnosis.data.trials import Trial
from catheter_sim.diagnosis.data_faults.beside_model import BesideModel
from catheter_sim.diagnosis.data_faults.bumps import bumped_trackers
from catheter_sim.diagnosis.data_faults.clipped import clipped_outputs
from catheter_sim.diagnosis.data_faults.exchanged_points import exchanged_points
from catheter_sim.diagnosis.data_faults.hardly_moved import hardly_moved
from catheter_sim.diagnosis.data_faults.interpolated import interpolated_outputs
from catheter_sim.diagnosis.data_faults.jumps import jumps_elsewhere
from catheter_sim.diagnosis.data_faults.mistakes import most_likely_mistake
from catheter_sim.diagnosis.data_faults.model_error import computed_outputs
from catheter_sim.diagnosis.data_faults.moved_between import moved_between_trials
from catheter_sim.diagnosis.data_faults.odd_trial import odd_trial
from catheter_sim.diagnosis.data_faults.one_trial import mistakes_of_one_trial
from catheter_sim.diagnosis.data_faults.out_of_step import outputs_out_of_step
from catheter_sim.diagnosis.data_faults.outstanding import outstanding_trials
from catheter_sim.diagnosis.data_faults.undriven import moved_without_inputs
from catheter_sim.diagnosis.data_faults.unrelated import outputs_that_do_not_follow
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.prediction import predicted
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.report.result import DataFault
from catheter_sim.diagnosis.stages.calibrate import Calibrated
from catheter_sim.diagnosis.stages.pose import Posed

SUSPECTED = "The data look wrong, so no cause was looked for"


@dataclass(frozen=True)
class Faults:
    """What looks wrong with the data.

    Attributes:
        found: (): the data look sound.
        of_trials: they are of some trials only, which the model meets worse than others.
    """

    found: tuple[DataFault, ...]
    of_trials: bool = False

    @property
    def notes(self) -> tuple[Note, ...]:
        """Return a note on each."""
        return tuple(Note("data_fault", f"{SUSPECTED}: {item.words}") for item in self.found)


def find_data_faults(posed: Posed, before: Calibrated) -> Faults:
    """Return what looks wrong with the data."""
    if posed.faults:
        return Faults(posed.faults)
    return data_faults(posed.train, before.fit, posed.heldout.trials, before.noise)


def data_faults(
    problem: Problem, before: Fit, heldout: Sequence[Trial], noise: Mapping[str, float]
) -> Faults:
    """Return what looks wrong with the data; nothing where they look sound.

    The checks run in an order in which the fault that explains others comes first, and the first that finds
    something speaks.

    Args:
        problem: the training trials.
        before: the calibrated model, without causes or with what may account for what it errs.
        heldout: the held-out trials. They are asked only whether they were measured as the others were.
        noise: of each unit.
    """
    trials = (*problem.trials, *heldout)
    models = computed_outputs(problem, before, trials)
    seen = BesideModel(trials, problem.columns, models, noise, problem.moving)
    checks: tuple[tuple[Callable[[], tuple[DataFault, ...]], bool], ...] = (
        (lambda: hardly_moved(problem.robot, trials, problem.columns, models), False),
        (lambda: interpolated_outputs(seen), False),
        (lambda: _mistake_in_all(problem, before), False),
        (lambda: bumped_trackers(trials, problem.columns, models, noise), False),
        (lambda: mistakes_of_one_trial(seen, problem.robot, _prediction(problem, before)), True),
        (lambda: exchanged_points(seen), False),
        (lambda: jumps_elsewhere(seen), False),
        (lambda: outputs_out_of_step(seen), False),
        (lambda: outputs_that_do_not_follow(problem, models[: len(problem.trials)]), False),
        (lambda: moved_without_inputs(seen), False),
        (lambda: clipped_outputs(seen), False),
        (lambda: outstanding_trials(seen), True),
        (lambda: moved_between_trials(seen), False),
        (lambda: odd_trial(problem, before, heldout, noise), True),
    )
    for check, of_trials in checks:
        if found := check():
            return Faults(found, of_trials)
    return Faults(())


def _mistake_in_all(problem: Problem, before: Fit) -> tuple[DataFault, ...]:
    """Return the mistake in all trials without which the calibrated model agrees with them far better."""
    shifted = any(name in SHIFTS for name in (item.name for item in problem.nuisances))
    found = most_likely_mistake(
        problem.trials, problem.columns, problem.robot, _prediction(problem, before), shifted
    )
    if found is None:
        return ()
    return (
        DataFault(
            f"{found.words}. If you correct that, the model's error falls from {100 * found.before:.0f} to "
            f"{100 * found.error:.0f} % of the measurements' spread."
        ),
    )


def _prediction(problem: Problem, before: Fit) -> Callable[[Inputs], Array]:
    """Return what the calibrated model says along inputs."""
    return lambda inputs: predicted(problem, before.numbers, before.x, inputs)
