"""From a folder of measurements to a diagnosis, step by step; each step is a function of its own.

1. Take out what a frozen sensor repeats; move measured positions into the robot's base frame
   (`registration`); split into training and held-out trials (`trials.split`).
2. Calibrate the nuisance parameters on the training trials, or the numbers that the data set names
   under `[calibration]`: the model "before" (`fit` without terms). Where the data themselves look wrong
   (`suspicions`), no cause is looked for.
3. Estimate the noise, which weighs units against each other (`noise`).
4. Choose causes inside the training trials (`select`).
5. Fit the chosen hypothesis to every training row, with intervals (`fit`, `intervals`). Hypotheses that do as
   well there and not on the held-out trials are told apart by these (`told_apart`).
6. Look at the held-out trials: errors, the interval of the gain, shares (`findings`, `evidence`). A
   cause that does not pay there is not named (`weighing`), nor is any where what is left has a structure
   (`verdict`).
7. Replay the held-out trials in MuJoCo with the causes in it (`confirm`); where it differs from the twin, the
   intervals are widened by what that would change (`intervals.model_margin`), and the causes weighed again.
8. Say what to measure next (`experiment`), and write everything down (`result`).
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from catheter_sim.diagnosis.confirm import replays
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.evidence import residual_series
from catheter_sim.diagnosis.experiment import next_experiment
from catheter_sim.diagnosis.findings import (
    calibrated_numbers,
    confirmed,
    doubts,
    figures,
    held_out,
    ranking,
    trial_fits,
    with_intervals,
)
from catheter_sim.diagnosis.fit import fit
from catheter_sim.diagnosis.hypothesis import Problem, measured_of, moved, robot_with
from catheter_sim.diagnosis.intervals import cause_intervals, model_margin, shift_by_model
from catheter_sim.diagnosis.noise import noise_floor, repeat_noise, white_noise
from catheter_sim.diagnosis.nuisance import Nuisance, nuisances_of
from catheter_sim.diagnosis.registration import (
    Registration,
    document,
    frame_numbers,
    register,
    registered,
    registration_notes,
    unmoved,
)
from catheter_sim.diagnosis.residuals import STAGES
from catheter_sim.diagnosis.result import CAUSE_FOUND, DATA_SUSPECT, Diagnosis, write_results
from catheter_sim.diagnosis.select import alike, candidates_for, equals_of, select
from catheter_sim.diagnosis.structure import structure_tests
from catheter_sim.diagnosis.suspicions import SURER, mistake, relative_error, suspicions, thawed
from catheter_sim.diagnosis.told_apart import as_good_elsewhere, told_apart, told_apart_note
from catheter_sim.diagnosis.trials import Dataset, Trial, split, unit_of
from catheter_sim.diagnosis.twin import twin_for
from catheter_sim.diagnosis.verdict import left_over, left_over_note, mostly_left, verdict_of
from catheter_sim.diagnosis.weighing import Scales, put_on, weigh, weighing_notes
from catheter_sim.diagnosis.workers import HERE, Workers, workers
from catheter_sim.effects.apply import embodied
from catheter_sim.mjcf.build import build_mjcf
from catheter_sim.progress import Stages
from catheter_sim.robots.channels import Inputs
from catheter_sim.robots.posture import Array

SUSPECTED = "The data look wrong, so that no cause was looked for"
UNFINISHED = ".unfinished"  # folder of finished fits in the output folder of a run that was stopped
_SMALLEST_WEIGHT = 1e-3  # of the spread of a unit's measurements


def diagnose(
    dataset_folder: str | os.PathLike[str],
    output_folder: str | os.PathLike[str],
    jobs: int = 1,
    progress: bool = False,
    dask: str = "",
) -> Diagnosis:
    """Diagnose the data set in a folder and write what was found to another.

    A run that was stopped left its finished fits in the output folder; the same run, started again,
    takes them over. They are gone when it is done.

    Args:
        dataset_folder: with a dataset.toml.
        output_folder: gets diagnosis.json, report.html, robot.toml, model.xml and the fitted series.
        jobs: processes of this machine to fit with.
        progress: show what is being done where standard error is a terminal.
        dask: address of a Dask scheduler to fit on instead, "" for none.

    Raises:
        InputError: the data set is not what it must be, the output folder cannot be written, or no
            scheduler answers.
    """
    dataset = load_dataset(dataset_folder)
    unfinished = Path(output_folder) / UNFINISHED
    diagnosis = diagnose_dataset(dataset, Workers(jobs, dask, unfinished), progress)
    actuation = dataset.trials[0].inputs.actuation
    write_results(diagnosis, output_folder, build_mjcf(embodied(diagnosis.extended_robot), actuation))
    shutil.rmtree(unfinished, ignore_errors=True)
    return diagnosis


def diagnose_dataset(
    dataset: Dataset, place: Workers = HERE, progress: bool = False, simulation: bool = True
) -> Diagnosis:
    """Return the diagnosis of a data set.

    Args:
        dataset: the measurements.
        place: where to fit.
        progress: show what is being done where standard error is a terminal.
        simulation: replay the held-out trials in MuJoCo at the end.

    Raises:
        InputError: no scheduler answers, or processes were killed again and again.
    """
    with Stages("diagnose", progress) as stages, workers(place) as pool:
        stages.say("calibrating")
        dataset, frozen = thawed(dataset)
        dataset, registration = in_base_frame(dataset)
        train, heldout = split(dataset)
        problem = training_problem(dataset, train, frame_numbers(registration))
        wanted = bool(dataset.calibration)  # numbers that may trade against one another
        before = fit(problem, (), cross_validate=False, thorough=wanted)
        white = noise_floor(
            white_noise(residual_series(problem, before)), repeat_noise(train, problem.columns)
        )
        suspected = suspicions(problem, before, heldout, white)
        stages.say("choosing causes")
        candidates = () if suspected else candidates_for(problem)
        selection = select(problem, candidates, pool, stages.say)
        stages.say("fitting the chosen causes")
        after = fit(
            problem, selection.chosen.terms, selection.chosen.values, cross_validate=False, thorough=wanted
        )
        test = replace(problem, trials=heldout)
        trained = after
        after, equals = told_apart(problem, test, trained, selection.equals, wanted, pool)
        # A cut trial's held-out part runs through all its rows; a whole trial stands for itself.
        noise = noise_floor(
            white_noise(residual_series(problem, after)), repeat_noise(train, problem.columns)
        )
        by_unit = held_out(problem, test, before, after, noise)
        unit = max(by_unit, key=lambda name: by_unit[name].rmse_after / max(by_unit[name].noise_floor, 1e-12))
        stages.say("weighing the causes")
        scales = Scales(problem, test, before, noise, unit, wanted, pool)
        weighed = weigh(scales, put_on(scales, after))
        shift: Array | None = None
        while True:
            fits = trial_fits(problem, (*train, *heldout), before, weighed.after)
            structure = {stage: structure_tests(dataset, fits, unit, stage) for stage in STAGES}
            left = left_over(weighed.by_unit[unit], structure["after"], len(weighed.after.terms))
            verdict = verdict_of(problem, before, weighed.after, weighed.by_unit, unit, left)
            verdict = DATA_SUSPECT if suspected else verdict
            shown = weighed.after if verdict == CAUSE_FOUND else before
            if not simulation:
                break
            stages.say("replaying in MuJoCo")
            robot = robot_with(problem, shown.frees, shown.x)
            replayed = [
                replace(item, outputs=moved(problem, shown.frees, shown.x, item.outputs))
                for item in replays(robot, heldout, problem.columns, dataset.gravity_mps2, pool)
            ]
            shift = shift_by_model(test, shown, [item.outputs for item in replayed])
            again = weigh(scales, weighed, shift) if verdict == CAUSE_FOUND else weighed
            if again.after is weighed.after:
                weighed = again
                break
            weighed, shift = again, None
        frame = {
            name: value
            for (effect, name), value in (weighed.after if verdict == CAUSE_FOUND else before).values.items()
            if not effect and name in registration.free
        }
        notes = [
            *(f"{SUSPECTED}: {item.words}" for item in suspected),
            *dataset.notes,
            *frozen,
            *registration_notes(registration, frame),
        ]
        if set(weighed.after.causes) - set(trained.causes) and verdict == CAUSE_FOUND:
            notes.append(told_apart_note(trained, weighed.after))
        if weighed.after.terms and (left is not None or mostly_left(weighed.by_unit[unit])):
            notes.append(left_over_note(weighed.after, weighed.by_unit[unit], left))
        as_chosen: dict[str, float] = {}
        if verdict == CAUSE_FOUND:
            if weighed.weak or weighed.unsure:  # what was as good was fitted beside others that are gone
                equals = equals_of(problem, weighed.after, candidates, pool)
                equals = as_good_elsewhere(problem, test, weighed.after, equals, wanted, pool)
            if weighed.after is not trained:
                chosen, _ = figures(problem, trial_fits(problem, heldout, before, trained), trained)
                as_chosen = {f"{name}_as_chosen_in_training": value for name, value in chosen.items()}
            after, by_unit, causes = weighed.after, dict(weighed.by_unit), weighed.causes
            notes += weighing_notes(weighed, shift)
        else:
            after, by_unit, causes = before, held_out(problem, test, before, before, noise), ()
            fits = trial_fits(problem, (*train, *heldout), before, before)
            structure["after"] = structure["before"]
        equals = tuple(item for item in equals if causes and alike(after, [item]))
        groups = alike(after, equals)
        robot = robot_with(problem, after.frees, after.x)
        extra, said = figures(problem, fits, after)
        extra |= {name: value for name, value in as_chosen.items() if "after" in name}
        notes += [*said, *doubts(causes, by_unit)]
        if simulation:
            found, said = confirmed(problem, heldout, replayed, fits)
            extra |= found
            notes += said
        causes = with_intervals(causes, cause_intervals(after, shift))
        margin = model_margin(after, np.zeros(len(after.frees)) if shift is None else shift)
        stages.say("looking for what to measure next")
        floor = np.array([by_unit[unit_of(name)].noise_floor for name in problem.columns])
        following = next_experiment(
            problem, after, equals, groups, floor, dataset.gravity_mps2, simulation, pool
        )
        stages.say("measuring how sure the calibration is")
        calibrated = calibrated_numbers(problem, after, wanted, margin, pool)
    return Diagnosis(
        dataset=dataset,
        verdict=verdict,
        unit=unit,
        by_unit=by_unit,
        causes=causes,
        ranking=ranking(problem, test, selection, after, unit),
        indistinguishable=groups,
        next_experiment=following,
        extended_robot=robot,
        fits=fits,
        notes=tuple(notes),
        extra=extra,
        calibrated=calibrated,
        structure=structure,
        suspicions=suspected,
        registration=document(registration, frame),
        chosen_in_training=trained.causes,
    )


def in_base_frame(dataset: Dataset) -> tuple[Dataset, Registration]:
    """Return the data set with its positions in the robot's base frame, and how they were moved there.

    A mistake in the data, such as inches for mm, may look like a tracker far away: where putting it right
    does better than any motion, nothing is moved, and `suspicions` will name it.
    """
    train, _ = split(dataset)
    robot, columns = replace(dataset.robot, actuation=train[0].inputs.actuation), dataset.output_channels
    twin = twin_for(robot, robot.actuation, columns, dataset.gravity_mps2)
    registration = register(train, columns, robot, twin)
    if not registration.applied:
        return dataset, registration

    def predict(inputs: Inputs) -> Array:
        return twin([robot], inputs, 1)[0]

    moved_there = registered(dataset, registration)
    found = mistake(train, columns, robot, predict)
    there = relative_error(split(moved_there)[0], columns, predict, shifted=True)
    if found is not None and found.error < SURER * there:
        return dataset, unmoved(registration)
    return moved_there, registration


def training_problem(dataset: Dataset, train: Sequence[Trial], frame: tuple[Nuisance, ...] = ()) -> Problem:
    """Return what is to be fitted: the nominal robot, its twin and the training trials.

    Units are weighed by the white part of the calibrated model's residual.

    Args:
        dataset: in the base frame.
        train: its training trials.
        frame: numbers of the tracker's frame to calibrate besides (`registration.frame_numbers`).
    """
    actuation = train[0].inputs.actuation
    robot = replace(dataset.robot, actuation=actuation)
    columns = dataset.output_channels
    problem = Problem(
        robot=robot,
        nuisances=(*(dataset.calibration or nuisances_of(dataset.robot_reference)), *frame),
        trials=tuple(train),
        columns=columns,
        weight=np.ones(len(columns)),
        twin=twin_for(robot, actuation, columns, dataset.gravity_mps2),
    )
    spread: dict[str, float] = {}
    for index, name in enumerate(columns):
        values = np.concatenate([measured_of(trial, columns)[:, index] for trial in train])
        spread[unit_of(name)] = max(spread.get(unit_of(name), 0.0), float(np.nanstd(values)), 1e-9)
    problem = replace(problem, weight=np.array([spread[unit_of(name)] for name in columns]))
    noise = white_noise(residual_series(problem, fit(problem, (), cross_validate=False)))
    weight = [
        max(noise.get(unit_of(name), 0.0), _SMALLEST_WEIGHT * spread[unit_of(name)]) for name in columns
    ]
    return replace(problem, weight=np.array(weight))
