"""How a hypothesis does on the held-out trials: errors by unit, the gain and how sure it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from catheter_sim.diagnosis.data.trials import Trial
from catheter_sim.diagnosis.fitting.evidence import (
    chance_of_gain,
    errors_of,
    gain_interval,
    gain_percent,
    outputs_of,
    rmse_by_unit,
    stretch_squares,
)
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.report.result import TrialFit, UnitResult
from catheter_sim.tables import Table


def held_out(
    train: Problem, test: Problem, before: Fit, after: Fit, noise: Mapping[str, float]
) -> dict[str, UnitResult]:
    """Return the held-out figures of every unit of `noise`."""
    return {unit: _of_unit(train, test, before, after, unit, floor) for unit, floor in noise.items()}


def _of_unit(train: Problem, test: Problem, before: Fit, after: Fit, unit: str, noise: float) -> UnitResult:
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
