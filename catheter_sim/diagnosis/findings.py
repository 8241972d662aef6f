"""What a diagnosis reports of a fitted hypothesis: figures on held-out trials, shares, doubts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from catheter_sim.diagnosis.confirm import Replay
from catheter_sim.diagnosis.evidence import (
    TIP,
    chance_of_gain,
    errors_of,
    gain_interval,
    gain_percent,
    outputs_of,
    rmse_by_unit,
    stretch_squares,
    tip_errors,
)
from catheter_sim.diagnosis.fit import Fit, fit
from catheter_sim.diagnosis.hypothesis import Problem, thinned
from catheter_sim.diagnosis.intervals import Interval, intervals, profile_interval
from catheter_sim.diagnosis.result import Candidate, Cause, FittedParameter, TrialFit, UnitResult
from catheter_sim.diagnosis.select import Selection
from catheter_sim.diagnosis.trials import Trial, unit_of
from catheter_sim.diagnosis.workers import HERE, Workers, each
from catheter_sim.robots.posture import Array
from catheter_sim.tables import Table


def held_out(
    train: Problem, test: Problem, before: Fit, after: Fit, noise: Mapping[str, float]
) -> dict[str, UnitResult]:
    """Return the held-out figures of every unit of `noise`."""
    return {unit: _held_out(train, test, before, after, unit, floor) for unit, floor in noise.items()}


def _held_out(train: Problem, test: Problem, before: Fit, after: Fit, unit: str, noise: float) -> UnitResult:
    errors = errors_of(test, before), errors_of(test, after)
    rmse = [rmse_by_unit(test, error)[unit] for error in errors]
    interval, chance = (0.0, 0.0), 1.0
    if after is not before:
        held = stretch_squares(test, *errors, unit)
        inside = stretch_squares(train, errors_of(train, before), errors_of(train, after), unit)
        interval = gain_interval(held, inside)
        chance = chance_of_gain(-np.diff(np.concatenate(held), axis=1)[:, 0])
    return UnitResult(
        unit=unit,
        noise_floor=noise,
        rmse_before=rmse[0],
        rmse_after=rmse[1],
        gain_percent=gain_percent(*rmse),
        gain_percent_ci95=interval,
        chance=chance,
    )


def named_causes(
    problem: Problem, test: Problem, after: Fit, result: UnitResult, unit: str, pool: Workers = HERE
) -> tuple[Cause, ...]:
    """Return the causes of a fitted hypothesis by their share of the held-out gain, largest first.

    A cause's share is how much the held-out error rises when the hypothesis is fitted without it, over
    the sum of these rises.
    """
    if not after.terms:
        return ()
    others = [tuple(item for item in after.terms if item is not term) for term in after.terms]
    without = each(pool, fit, [(thinned(problem), terms, after.values, False) for terms in others])
    rises = [
        max(rmse_by_unit(test, errors_of(test, item))[unit] - result.rmse_after, 0.0) for item in without
    ]
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


def with_intervals(causes: Sequence[Cause], ends: Mapping[tuple[str, str], Interval]) -> tuple[Cause, ...]:
    """Return the causes with their parameters' intervals taken from `ends`."""
    return tuple(
        replace(
            cause,
            parameters={
                name: replace(item, ci95=ends[cause.name, name]) for name, item in cause.parameters.items()
            },
        )
        for cause in causes
    )


def calibrated_numbers(
    problem: Problem,
    result: Fit,
    along_valleys: bool,
    margin: Array | None = None,
    pool: Workers = HERE,
) -> dict[str, FittedParameter]:
    """Return the calibrated numbers of a fit, with intervals.

    Args:
        problem: what was fitted.
        result: the fit.
        along_valleys: intervals by refitting all other numbers (`profile_interval`); needs a thorough fit.
        margin: as for `intervals`; not used along valleys.
        pool: where to do that.
    """
    numbers = [free.parameter for free in result.frees if not free.effect]
    names = [item.name for item in numbers]
    if along_valleys:
        ends = each(pool, profile_interval, [(problem, result, name) for name in names])
    else:
        bounds = intervals(result, margin)
        ends = [bounds["", name] for name in names]
    return {
        item.name: FittedParameter(result.values["", item.name], end, item.null)
        for item, end in zip(numbers, ends, strict=True)
    }


def ranking(
    problem: Problem, test: Problem, selection: Selection, named: Fit, unit: str
) -> tuple[Candidate, ...]:
    """Return every set of causes that was fitted with its held-out error, best first.

    Of several variants of a set (one value, or one per channel) the one that the cross-validation
    prefers stands for it; for the chosen set the chosen variant.

    Args:
        problem: the training trials.
        test: the held-out trials.
        selection: what was tried.
        named: the hypothesis of the verdict; where causes were taken out of the chosen set, it may not be
            among those that were tried, and is then fitted to the stretches left out too.
        unit: of the errors.
    """
    best: dict[tuple[str, ...], Fit] = {}
    for item in (selection.null, *selection.singles, *selection.tried, *selection.path):
        names = tuple(sorted(item.causes))
        if names not in best or item.cross_validated_rms < best[names].cross_validated_rms:
            best[names] = item
    best[tuple(sorted(selection.chosen.causes))] = selection.chosen
    if named.terms and tuple(sorted(named.causes)) not in best:
        best[tuple(sorted(named.causes))] = fit(thinned(problem), named.terms, named.values)
    mine = np.array([unit_of(name) == unit for name in test.columns])
    scale = float(np.sqrt(np.mean(test.weight[mine] ** 2)))
    found = [
        Candidate(
            item.causes, rmse_by_unit(test, errors_of(test, item))[unit], item.left_out_error_rms * scale
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
    for free, stuck in zip(after.frees, after.held, strict=True):
        if stuck and free.effect:
            notes.append(f"{free.effect}.{free.parameter.name} stands at its bound: no interval.")
    return extra, notes


def doubts(causes: Sequence[Cause], by_unit: Mapping[str, UnitResult]) -> list[str]:
    """Return what a reader should doubt: error that is left over."""
    notes = []
    for unit, result in by_unit.items():
        times = result.rmse_after / max(result.noise_floor, 1e-12)
        if causes and times > 3.0:
            notes.append(
                f"After correction the error [{unit}] is still {times:.0f} times "
                "what is white in it from row to row: most of what is left has causes that are not named."
            )
    return notes


def confirmed(
    problem: Problem, heldout: Sequence[Trial], replays: Sequence[Replay], fits: Sequence[TrialFit]
) -> tuple[dict[str, float], list[str]]:
    """Return how MuJoCo, with the causes in it, does on the held-out trials, and where it disagrees."""
    extra: dict[str, float] = {}
    notes: list[str] = []
    for trial, item in zip(heldout, replays, strict=True):
        if item.failure:
            notes.append(f"Simulation of {trial.file}: {item.failure}.")
        if item.restless:
            notes.append(f"Simulation of {trial.file}: {item.restless} rows had not come to rest.")
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


def trial_fits(problem: Problem, trials: Sequence[Trial], before: Fit, after: Fit) -> tuple[TrialFit, ...]:
    """Return trials, measured and computed by both hypotheses."""
    return tuple(_trial_fit(problem, trial, before, after) for trial in trials)


def _trial_fit(problem: Problem, trial: Trial, before: Fit, after: Fit) -> TrialFit:
    tables = []
    for result in (before, after):
        values = outputs_of(problem, trial, result)
        columns = {name: values[:, index] for index, name in enumerate(problem.columns)}
        tables.append(Table(trial.outputs.time_s, columns, trial.file))
    return TrialFit(trial.file, trial.role, trial.outputs.time_s, trial.outputs, tables[0], tables[1])
