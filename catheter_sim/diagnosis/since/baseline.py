"""What an earlier recording says of a robot: its best model, and what that model gets wrong, row by row."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.base_frame.registration import Registration
from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.data.enough import too_little_to_learn
from catheter_sim.diagnosis.data.trials import Dataset, Trial, measured_of
from catheter_sim.diagnosis.fitting.noise import times_noise
from catheter_sim.diagnosis.fitting.prediction import robot_with
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.fitting.stretches import blocks_of
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.report.wording import listed
from catheter_sim.diagnosis.stages.acquit_trials import acquit_trials
from catheter_sim.diagnosis.stages.calibrate import calibrate
from catheter_sim.diagnosis.stages.choose_causes import Choice, choose_causes
from catheter_sim.diagnosis.stages.find_data_faults import Faults, find_data_faults
from catheter_sim.diagnosis.stages.pose import pose
from catheter_sim.diagnosis.stages.prepare import prepare, readings_of
from catheter_sim.diagnosis.stages.run import Run
from catheter_sim.diagnosis.thresholds import BASELINE_BUDGET, EARLIER_CAUSES
from catheter_sim.diagnosis.verdict.discrepancy import explained
from catheter_sim.errors import InputError
from catheter_sim.theory.predict import Prediction

LEFT_OUT = "earlier_trials_left_out"


@dataclass(frozen=True)
class Baseline:
    """An earlier recording, explained as well as causes can.

    Attributes:
        dataset: it, in the robot's base frame.
        robot: calibrated, with the causes that explain it, believed or not.
        errors: measured minus computed, of each trial, shape (r, o), in file units; NaN where missing.
        columns: the outputs, shape (o,).
        problem: its trials.
        registration: how its positions were moved into the base frame.
        twin: what fits go by.
        misfit: its largest error over the noise, of any unit.
        relative_error: its largest error over the spread of what was measured, of any unit.
        notes: on trials that were left out.
        choice: of its causes; None: none were looked for.
    """

    dataset: Dataset
    robot: RobotSpec
    errors: tuple[Array, ...]
    columns: tuple[str, ...]
    problem: Problem
    registration: Registration
    twin: Prediction
    misfit: float
    relative_error: float
    notes: tuple[Note, ...] = ()
    choice: Choice | None = None

    @property
    def name(self) -> str:
        """Return the name of its data set."""
        return self.dataset.name

    @property
    def inputs(self) -> tuple[Inputs, ...]:
        """Return the inputs of each of its trials."""
        return tuple(trial.inputs for trial in self.dataset.trials)


def baseline(run: Run, dataset: Dataset, is_paired: bool) -> Baseline:
    """Return what an earlier recording says of the robot.

    Its best hypothesis is taken whether or not its causes would be named: whatever it soaks up, both
    recordings share. Trials that look wrong are left out, if most do not.

    Args:
        run: where to fit.
        dataset: the earlier recording.
        is_paired: the later one's rows pair with its rows. What both share then cancels, and no causes are
            looked for; the specimen's numbers alone are calibrated.

    Raises:
        InputError: the recording looks wrong by itself, or has too little to learn from.
    """
    run.say("explaining the earlier recording")
    read = readings_of(dataset)
    lacking = too_little_to_learn(read.train, dataset.output_channels)
    if lacking:
        raise InputError(f"{dataset.folder}: nothing can be compared with it: {lacking[0]}")
    prepared = prepare(dataset, read)
    posed = pose(prepared)
    before = calibrate(posed)
    faults = acquit_trials(run, posed, before, find_data_faults(posed, before))
    if faults.found:
        return baseline(run, _without_wrong_trials(dataset, faults), is_paired)
    choice, chosen = None, before.fit
    if not is_paired:
        left_s = run.deadline - time.monotonic()
        hurried = replace(run, deadline=time.monotonic() + BASELINE_BUDGET * left_s)
        choice = choose_causes(hurried, posed, faults, EARLIER_CAUSES)
        chosen = choice.fit
    robot = robot_with(posed.train, chosen.numbers, chosen.x)
    trials = posed.dataset.trials
    errors = errors_with(posed.train, robot, trials)
    sizes = by_unit(posed.train.columns, np.concatenate(errors))
    measured = np.concatenate([measured_of(trial, posed.train.columns) for trial in trials])
    spread = by_unit(posed.train.columns, measured - np.nanmean(measured, axis=0))
    return Baseline(
        dataset=posed.dataset,
        robot=robot,
        errors=errors,
        columns=posed.train.columns,
        problem=replace(posed.train, trials=trials),
        registration=posed.registration,
        twin=prepared.twin,
        misfit=max(times_noise(size, before.noise.get(unit, 0.0)) for unit, size in sizes.items()),
        relative_error=max(size / max(spread[unit], 1e-12) for unit, size in sizes.items()),
        notes=tuple(note for note in dataset.notes if note.code == LEFT_OUT),
        choice=choice,
    )


def errors_with(problem: Problem, robot: RobotSpec, trials: Sequence[Trial]) -> tuple[Array, ...]:
    """Return measured minus computed of each trial, shape (r, o), in file units; NaN where missing."""
    return tuple(
        measured_of(trial, problem.columns) - problem.twin([robot], trial.inputs, 1)[0] for trial in trials
    )


def _without_wrong_trials(dataset: Dataset, faults: Faults) -> Dataset:
    """Return an earlier recording without the trials that look wrong, with a note.

    Raises:
        InputError: it looks wrong as a whole, or fewer than two trials, or half of them, would be left.
    """
    wrong = {item.where for item in faults.found}
    kept = tuple(replace(trial, role="") for trial in dataset.trials if trial.file not in wrong)
    left_out = len(dataset.trials) - len(kept)
    if left_out < len(wrong) or len(kept) < 2 or left_out >= len(kept):
        raise InputError(f"{dataset.folder}: nothing can be compared with it: {faults.found[0].words}")
    note = Note(
        LEFT_OUT,
        f"Of the earlier recording {listed(sorted(wrong))} was left out. {faults.found[0].words}",
    )
    return replace(dataset, trials=kept, notes=(*dataset.notes, note))


def left_by_unit(base: Baseline, later: Sequence[Trial], robot: RobotSpec) -> Mapping[str, float]:
    """Return what is left of both recordings, root mean square by unit.

    Args:
        base: the earlier one.
        later: the later one's trials, without what it shares with that.
        robot: the later one's.
    """
    errors = (*base.errors, *errors_with(base.problem, robot, later))
    return by_unit(base.columns, np.concatenate(errors))


def smooth_errors(base: Baseline, there: Problem) -> tuple[Array, ...]:
    """Return what a smooth error of unknown cause, learned from the earlier recording, is elsewhere.

    Args:
        base: the earlier recording.
        there: trials of the same outputs, none missing.

    Returns:
        Measured minus computed, of each trial, shape (r, o), in file units.
    """
    residual = np.concatenate(
        [
            (-error / base.problem.weight)[np.isfinite(error)]
            for error in (item[:: base.problem.every] for item in base.errors)
        ]
    )
    flat = explained(base.problem, residual, blocks_of(base.problem), there)
    found, start = [], 0
    for trial in there.trials:
        shape = (len(trial.inputs), len(base.columns))
        part = flat[start : start + shape[0] * shape[1]].reshape(shape)
        found.append(-part * base.problem.weight)
        start += shape[0] * shape[1]
    return tuple(found)


def by_unit(columns: tuple[str, ...], errors: Array) -> Mapping[str, float]:
    """Return the root mean square of errors (r, o) by unit; NaN is left out."""
    units = np.array([unit_of(name) for name in columns])
    return {
        str(unit): float(np.sqrt(np.nanmean(errors[:, units == unit] ** 2)))
        for unit in dict.fromkeys(units.tolist())
        if np.isfinite(errors[:, units == unit]).any()
    }
