"""From a folder of measurements to a diagnosis, step by step; each step is a function of its own.

1. Split into training and held-out trials (`trials.split`).
2. Calibrate the nuisance parameters on the training trials: the model "before" (`fit` without terms).
3. Estimate the noise, which weighs units against each other (`noise`).
4. Choose causes inside the training trials (`select`).
5. Fit the chosen hypothesis to every training row, with intervals (`fit`, `intervals`).
6. Look at the held-out trials, once: errors, and the interval of the gain (`evidence`).
7. Replay the held-out trials in MuJoCo with the causes in it (`confirm`).
8. Say what to measure next (`experiment`), and write everything down (`result`).
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from tqdm import tqdm

from catheter_sim.diagnosis.confirm import Replay, replay
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.evidence import (
    TIP,
    errors_of,
    gain_interval,
    gain_percent,
    rmse_by_unit,
    tip_errors,
)
from catheter_sim.diagnosis.experiment import next_experiment
from catheter_sim.diagnosis.fit import Fit, Problem, fit, intervals, measured_of, robot_with
from catheter_sim.diagnosis.noise import is_white, noise_floor, repeat_noise, white_noise
from catheter_sim.diagnosis.nuisance import nuisances_of
from catheter_sim.diagnosis.result import (
    Candidate,
    Cause,
    Diagnosis,
    FittedParameter,
    TrialFit,
    UnitResult,
    write_results,
)
from catheter_sim.diagnosis.select import Selection, candidates_for, select
from catheter_sim.diagnosis.trials import Dataset, Trial, split, unit_of
from catheter_sim.diagnosis.twin import twin_for
from catheter_sim.effects.apply import embodied
from catheter_sim.mjcf.build import build_mjcf
from catheter_sim.robots.posture import Array
from catheter_sim.robots.specification import ContinuumRobot
from catheter_sim.tables import Table

NEAR_NOISE = 1.5  # times the noise floor: an error so small is no discrepancy
_SMALLEST_WEIGHT = 1e-3  # of the spread of a unit's measurements


def diagnose(
    dataset_folder: str | os.PathLike[str],
    output_folder: str | os.PathLike[str],
    jobs: int = 1,
    progress: bool = False,
) -> Diagnosis:
    """Diagnose the data set in a folder and write what was found to another.

    Args:
        dataset_folder: with a dataset.toml.
        output_folder: gets diagnosis.json, report.html, robot.toml, model.xml and the fitted series.
        jobs: processes to fit with.
        progress: show what is being done where standard error is a terminal.

    Raises:
        InputError: the data set is not what it must be, or the output folder cannot be written.
    """
    dataset = load_dataset(dataset_folder)
    diagnosis = diagnose_dataset(dataset, jobs, progress)
    actuation = dataset.trials[0].inputs.actuation
    write_results(diagnosis, output_folder, build_mjcf(embodied(diagnosis.extended_robot), actuation))
    return diagnosis


def diagnose_dataset(
    dataset: Dataset, jobs: int = 1, progress: bool = False, simulation: bool = True
) -> Diagnosis:
    """Return the diagnosis of a data set; arguments as in `diagnose`.

    Args:
        dataset: the measurements.
        jobs: processes to fit with.
        progress: show what is being done where standard error is a terminal.
        simulation: replay the held-out trials in MuJoCo at the end.
    """
    hidden = not (progress and sys.stderr.isatty())
    with tqdm(bar_format="{desc} ({elapsed})", disable=hidden, leave=False) as bar:
        bar.set_description("calibrating")
        train, heldout = split(dataset)
        problem = training_problem(dataset, train)
        bar.set_description("choosing causes")
        selection = select(problem, candidates_for(problem.robot), jobs, bar.set_description)
        bar.set_description("fitting the chosen causes")
        before = fit(problem, (), cross_validate=False)
        after = fit(problem, selection.chosen.terms, selection.chosen.values, cross_validate=False)
        test = replace(problem, trials=heldout)
        # A cut trial's held-out part runs through all its rows; a whole trial stands for itself.
        noise = noise_floor(
            white_noise(_residual_series(problem, after)), repeat_noise(train, problem.columns)
        )
        by_unit = {unit: held_out(test, before, after, unit, noise[unit]) for unit in noise}
        unit = max(by_unit, key=lambda name: by_unit[name].rmse_after / max(by_unit[name].noise_floor, 1e-12))
        verdict = verdict_of(problem, before, after, by_unit)
        if verdict != "cause_found":
            after = before
            by_unit = {name: held_out(test, before, before, name, noise[name]) for name in noise}
        bar.set_description("weighing the causes")
        causes = named_causes(problem, test, after, by_unit[unit], unit)
        groups = selection.alike if causes else ()
        robot = robot_with(problem, after.frees, after.x)
        fits = tuple(_trial_fit(problem, trial, before, after) for trial in (*train, *heldout))
        extra, notes = figures(problem, fits, after)
        notes += doubts(causes, by_unit)
        if simulation:
            bar.set_description("replaying in MuJoCo")
            found, said = confirmed(dataset, problem, robot, heldout, fits)
            extra |= found
            notes += said
    return Diagnosis(
        dataset=dataset,
        verdict=verdict,
        unit=unit,
        by_unit=by_unit,
        causes=causes,
        ranking=ranking(test, selection, unit),
        indistinguishable=groups,
        next_experiment=next_experiment(
            problem.robot, dataset.trials, [cause.name for cause in causes], groups
        ),
        extended_robot=robot,
        fits=fits,
        notes=tuple(notes),
        extra=extra,
    )


def training_problem(dataset: Dataset, train: Sequence[Trial]) -> Problem:
    """Return what is to be fitted: the nominal robot, its twin and the training trials.

    Units are weighed by the white part of the calibrated model's residual.
    """
    actuation = train[0].inputs.actuation
    robot = replace(dataset.robot, actuation=actuation)
    columns = dataset.output_channels
    problem = Problem(
        robot=robot,
        nuisances=nuisances_of(dataset.robot_reference),
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
    noise = white_noise(_residual_series(problem, fit(problem, (), cross_validate=False)))
    weight = [
        max(noise.get(unit_of(name), 0.0), _SMALLEST_WEIGHT * spread[unit_of(name)]) for name in columns
    ]
    return replace(problem, weight=np.array(weight))


def held_out(test: Problem, before: Fit, after: Fit, unit: str, noise: float) -> UnitResult:
    """Return the held-out figures of one unit."""
    errors = errors_of(test, before), errors_of(test, after)
    rmse = [rmse_by_unit(test, error)[unit] for error in errors]
    return UnitResult(
        unit=unit,
        noise_floor=noise,
        rmse_before=rmse[0],
        rmse_after=rmse[1],
        gain_percent=gain_percent(*rmse),
        gain_percent_ci95=gain_interval(test, *errors, unit) if after is not before else (0.0, 0.0),
    )


def verdict_of(problem: Problem, before: Fit, after: Fit, by_unit: Mapping[str, UnitResult]) -> str:
    """Return the verdict.

    A cause is found where causes were chosen on the training trials and the error on the held-out ones
    falls, in at least one unit, with an interval above zero. Otherwise there is no discrepancy if the
    calibrated model's residuals are near the noise, or show no structure from row to row.
    """
    if after.terms and any(result.gain_percent_ci95[0] > 0.0 for result in by_unit.values()):
        return "cause_found"
    near = all(result.rmse_before <= NEAR_NOISE * result.noise_floor for result in by_unit.values())
    white = all(is_white(series) for series in _residual_series(problem, before).values())
    return "no_discrepancy" if near or white else "unexplained"


def named_causes(
    problem: Problem, test: Problem, after: Fit, result: UnitResult, unit: str
) -> tuple[Cause, ...]:
    """Return the causes of a fitted hypothesis by their share of the held-out gain, largest first.

    A cause's share is how much the held-out error rises when the hypothesis is fitted without it, over
    the sum of these rises.
    """
    if not after.terms:
        return ()
    rises = []
    rows = sum(len(trial.inputs) for trial in problem.trials)
    thinned = replace(problem, every=max(1, round(rows / 600)))
    for term in after.terms:
        others = tuple(item for item in after.terms if item is not term)
        without = fit(thinned, others, after.values, cross_validate=False)
        rises.append(max(rmse_by_unit(test, errors_of(test, without))[unit] - result.rmse_after, 0.0))
    total = sum(rises)
    shares = [rise / total if total > 0.0 else 1.0 / len(rises) for rise in rises]
    bounds = intervals(after)
    values = after.values
    causes = []
    for term, share in zip(after.terms, shares, strict=True):
        null = {
            free.parameter.name: free.parameter.null for free in after.frees if free.effect == term.effect
        }
        causes.append(
            Cause(
                name=term.effect,
                parameters={
                    name: FittedParameter(values[term.effect, name], bounds[term.effect, name], null[name])
                    for name in term.free
                },
                gain_percent=result.gain_percent * share,
            )
        )
    return tuple(sorted(causes, key=lambda cause: -cause.gain_percent))


def ranking(test: Problem, selection: Selection, unit: str) -> tuple[Candidate, ...]:
    """Return every set of causes that was fitted with its held-out error, best first.

    Of several variants of a set (one value, or one per channel) the one that the cross-validation
    prefers stands for it; for the chosen set the chosen variant.
    """
    best: dict[tuple[str, ...], Fit] = {}
    for item in (selection.null, *selection.singles, *selection.tried, *selection.path):
        names = tuple(sorted(item.causes))
        if names not in best or item.cross_validated_rms < best[names].cross_validated_rms:
            best[names] = item
    best[tuple(sorted(selection.chosen.causes))] = selection.chosen
    mine = np.array([unit_of(name) == unit for name in test.columns])
    scale = float(np.sqrt(np.mean(test.weight[mine] ** 2)))
    found = [
        Candidate(
            item.causes, rmse_by_unit(test, errors_of(test, item))[unit], item.cross_validated_rms * scale
        )
        for item in best.values()
    ]
    return tuple(sorted(found, key=lambda candidate: candidate.heldout_rmse))


def figures(problem: Problem, fits: Sequence[TrialFit], after: Fit) -> tuple[dict[str, float], list[str]]:
    """Return further figures of the held-out trials, and notes about the fit."""
    extra: dict[str, float] = {}
    notes = []
    heldout = [item for item in fits if item.role == "heldout"]
    if all(name in problem.columns for name in TIP):
        for stage in ("before", "after"):
            columns = {
                name: [(getattr(item, stage).columns[name], item.measured.columns[name]) for item in heldout]
                for name in TIP
            }
            extra |= {f"heldout_{name.format(stage)}": value for name, value in tip_errors(columns).items()}
        notes.append(
            "rmse counts every output by itself; a tip distance error is the length of the error vector in "
            "space. Aligned: with the mean offset over the held-out rows taken out."
        )
    if not problem.nuisances:
        notes.append(
            "Before is the robot as its file specifies it: no calibration range is known for it, so that "
            "nothing was calibrated away, the tracker's frame included."
        )
    else:
        values = {name: value for (effect, name), value in after.values.items() if not effect}
        notes.append(
            "Calibrated, as factors on the specified values: "
            + ", ".join(f"{name.replace('_', ' ')} {value:.3f}" for name, value in values.items())
            + "."
            if values
            else "No nuisance parameter was left to calibrate."
        )
    for free, stuck in zip(after.frees, after.held, strict=True):
        if stuck and free.effect:
            notes.append(f"{free.effect}.{free.parameter.name} stands at its bound: no interval.")
    return extra, notes


def doubts(causes: Sequence[Cause], by_unit: Mapping[str, UnitResult]) -> list[str]:
    """Return what a reader should doubt: causes that do not pay on held-out data, error left over."""
    notes = [
        f"{cause.name.replace('_', ' ')} pays on stretches left out of the training data, but not on the "
        "held-out data: take it as a part of this fit, not as a finding."
        for cause in causes
        if len(causes) > 1 and cause.gain_percent < 0.5
    ]
    for unit, result in by_unit.items():
        times = result.rmse_after / max(result.noise_floor, 1e-12)
        if causes and times > 3.0:
            notes.append(
                f"After correction the error [{unit}] is still {times:.0f} times "
                "what is white in it from row to row: most of what is left has causes that are not named."
            )
    return notes


def confirmed(
    dataset: Dataset,
    problem: Problem,
    robot: ContinuumRobot,
    heldout: Sequence[Trial],
    fits: Sequence[TrialFit],
) -> tuple[dict[str, float], list[str]]:
    """Return how MuJoCo, with the causes in it, does on the held-out trials, and where it disagrees."""
    extra: dict[str, float] = {}
    notes: list[str] = []
    replays: list[Replay] = []
    for trial in heldout:
        replays.append(replay(robot, trial, problem.columns, dataset.gravity_mps2))
        if replays[-1].failure:
            notes.append(f"Simulation of {trial.file}: {replays[-1].failure}.")
        if replays[-1].restless:
            notes.append(f"Simulation of {trial.file}: {replays[-1].restless} rows had not come to rest.")
    twins = [
        np.stack([item.after.columns[name] for name in problem.columns], axis=1)
        for item in fits
        if item.role == "heldout"
    ]
    for unit in dict.fromkeys(unit_of(name) for name in problem.columns):
        mine = np.array([unit_of(name) == unit for name in problem.columns])
        error = np.concatenate([(item.outputs - item.measured)[:, mine].ravel() for item in replays])
        apart = np.concatenate(
            [(item.outputs - twin)[:, mine].ravel() for item, twin in zip(replays, twins, strict=True)]
        )
        suffix = "" if unit == "1" else f"_{unit}"
        if np.isfinite(error).any():
            extra[f"heldout_simulation_rmse_after{suffix}"] = float(np.sqrt(np.nanmean(error**2)))
            extra[f"heldout_simulation_minus_twin_rms{suffix}"] = float(np.sqrt(np.nanmean(apart**2)))
    if all(name in problem.columns for name in TIP) and all(item.failure is None for item in replays):
        columns = {
            name: [
                (
                    item.outputs[:, problem.columns.index(name)],
                    item.measured[:, problem.columns.index(name)],
                )
                for item in replays
            ]
            for name in TIP
        }
        extra |= {
            f"heldout_simulation_{name.format('after')}": value for name, value in tip_errors(columns).items()
        }
    return extra, notes


def _outputs(problem: Problem, trial: Trial, result: Fit) -> Array:
    """Return a fitted hypothesis's outputs along a trial, shape (r, o)."""
    return problem.twin([robot_with(problem, result.frees, result.x)], trial.inputs, 1)[0]


def _residual_series(problem: Problem, result: Fit) -> dict[str, list[Array]]:
    """Return model minus measurement by output column, one array per trial."""
    series: dict[str, list[Array]] = {name: [] for name in problem.columns}
    for trial in problem.trials:
        error = _outputs(problem, trial, result) - measured_of(trial, problem.columns)
        for index, name in enumerate(problem.columns):
            series[name].append(error[:, index])
    return series


def _trial_fit(problem: Problem, trial: Trial, before: Fit, after: Fit) -> TrialFit:
    tables = []
    for result in (before, after):
        values = _outputs(problem, trial, result)
        columns = {name: values[:, index] for index, name in enumerate(problem.columns)}
        tables.append(Table(trial.inputs.time_s, columns, trial.file))
    return TrialFit(trial.file, trial.role, trial.inputs.time_s, trial.outputs, tables[0], tables[1])
