"""Which twin a data set is fitted by: analytic where rows were held, the simulation where the robot moved.

In motion every simulated step costs time. A robot's own step is chosen for accuracy; a longer one is taken
for fits if it changes the outputs by far less than the measurements' noise (`STEP_SHARE`). The replay at the
end goes by the robot's own step.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.motion import motion_step_s
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.data.resolution import resolution_of
from catheter_sim.diagnosis.data.trials import Dataset, Trial, beginnings, measured_of
from catheter_sim.diagnosis.fitting.noise import noise_from_row_to_row
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.thresholds import LONGER_STEPS, SECONDS_TO_STEP_BY, STEP_SHARE
from catheter_sim.simulation.moving_twin import MovingTwin
from catheter_sim.theory.predict import MovingPrediction, Prediction, moving_twin_for, twin_for


@dataclass(frozen=True)
class ChosenTwin:
    """What fits go by.

    Attributes:
        predict: robots and inputs to outputs.
        notes: what a reader must know of it.
    """

    predict: Prediction
    notes: tuple[Note, ...] = ()


def twin_of(dataset: Dataset, train: Sequence[Trial]) -> ChosenTwin:
    """Return what a data set's fits go by.

    Args:
        dataset: the measurements.
        train: its training trials.
    """
    actuation = train[0].inputs.actuation
    robot, columns = replace(dataset.robot, actuation=actuation), dataset.output_channels
    if not dataset.motion.moving:
        return ChosenTwin(twin_for(robot, actuation, columns, dataset.gravity_mps2))
    own = moving_twin_for(robot, actuation, columns, dataset.gravity_mps2)
    return _with_longer_steps(own, robot, train, columns, resolution_of(dataset))


def _with_longer_steps(
    own: MovingPrediction,
    robot: RobotSpec,
    train: Sequence[Trial],
    columns: Sequence[str],
    resolution: Mapping[str, float],
) -> ChosenTwin:
    """Return the twin with the longest steps that change outputs by little beside the noise."""
    inputs = [trial.inputs for trial in beginnings(train, SECONDS_TO_STEP_BY)]
    exact, cost_s = _computed(own, robot, inputs)
    steps = [resolution.get(name, 0.0) for name in columns]
    noise = noise_from_row_to_row([measured_of(trial, columns) for trial in train], steps)
    own_s = motion_step_s(robot)
    chosen, change = own, 0.0
    for factor in LONGER_STEPS:
        longer = replace(own, twin=MovingTwin(factor * own_s, together=2))
        outputs, spent_s = _computed(longer, robot, inputs)
        apart = float(np.max(np.sqrt(np.mean((outputs - exact) ** 2, axis=0)) / noise))
        if not apart <= STEP_SHARE:  # True where it diverged
            break
        chosen, change, cost_s = longer, apart, spent_s
    step_s = chosen.twin.timestep_s or own_s
    length_s = float(sum(item.time_s[-1] - item.time_s[0] for item in inputs))
    said = f"The robot moves, so every fit runs MuJoCo in steps of {1e3 * step_s:g} ms. "
    said += f"A simulated second takes {cost_s / length_s:.2g} s of a processor."
    if step_s > own_s:
        said += (
            f" The robot's own steps, {1e3 * own_s:g} ms, would change outputs by {change:.2g} of the noise."
        )
    return ChosenTwin(chosen, (Note("moving_twin", said),))


def _computed(predict: MovingPrediction, robot: RobotSpec, inputs: Sequence[Inputs]) -> tuple[Array, float]:
    """Return a robot's outputs along all trials, shape (r, o), and this process's time for them [s]."""
    begun = time.process_time()
    outputs = [predict([robot], item)[0] for item in inputs]  # one at a time: in this process
    return np.concatenate(outputs), time.process_time() - begun
