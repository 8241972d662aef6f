"""Model minus measurement over each column's weight, of many parameter vectors at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import numbers_of
from catheter_sim.diagnosis.data.trials import measured_of
from catheter_sim.diagnosis.fitting.gross_errors import tempered
from catheter_sim.diagnosis.fitting.prediction import all_as_measured, distinct_robots
from catheter_sim.diagnosis.fitting.problem import FittedNumber, Problem
from catheter_sim.diagnosis.thresholds import NO_EQUILIBRIUM_ERROR
from catheter_sim.theory.predict import along


def residuals(problem: Problem, numbers: Sequence[FittedNumber], xs: Array) -> Array:
    """Return model minus measurement over weight for many parameter vectors, shape (B, n).

    A residual larger than `GROSS_ERROR` is made smaller, so that its square is Huber's loss (`tempered`). A
    robot without equilibrium errs by more than any robot that stands still.

    Args:
        problem: trials and twin.
        numbers: what the columns of `xs` are.
        xs: shape (B, p), in units of the parameters' scales.
    """
    parts = []
    robots, which = distinct_robots(problem, numbers, xs)
    keys = [numbers_of(trial.inputs) for trial in problem.trials]
    inputs = {key: trial.inputs for key, trial in zip(keys, problem.trials, strict=True)}
    computed = along(problem.twin, robots, list(inputs.values()), problem.every)  # each repeated trial once
    models = {
        key: all_as_measured(problem, numbers, xs, outputs[which])
        for key, outputs in zip(inputs, computed, strict=True)
    }
    for key, trial in zip(keys, problem.trials, strict=True):
        measured = measured_of(trial, problem.columns)[:: problem.every]
        error = (models[key] - measured) / problem.weight
        parts.append(error[:, np.isfinite(measured)])
    stacked = np.concatenate(parts, axis=1)
    found = np.isfinite(stacked)
    if found.all():
        return tempered(stacked)
    return np.where(found, tempered(np.where(found, stacked, 0.0)), no_equilibrium_residual(problem))


def column_of(problem: Problem) -> np.ndarray:
    """Return the index of the output column of each residual, shape (n,)."""
    parts = []
    for trial in problem.trials:
        finite = np.isfinite(measured_of(trial, problem.columns)[:: problem.every])
        parts.append(np.broadcast_to(np.arange(finite.shape[1]), finite.shape)[finite])
    return np.concatenate(parts)


def no_equilibrium_residual(problem: Problem) -> float:
    """Return the residual of a row without equilibrium: larger than of a robot that stands still."""
    size = max(
        float(np.nanmax(np.abs(measured_of(trial, problem.columns)) / problem.weight, initial=0.0))
        for trial in problem.trials
    )
    return float(tempered(np.array(max(NO_EQUILIBRIUM_ERROR, 2.0 * size))))
