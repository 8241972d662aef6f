"""What a hypothesis says of a programme, how sure it is of it, and what the programme so tells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import read_inputs
from catheter_sim.diagnosis.data.trials import Trial
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.least_squares import linearised
from catheter_sim.diagnosis.fitting.prediction import predicted
from catheter_sim.diagnosis.fitting.prior import prior_of
from catheter_sim.diagnosis.fitting.problem import Problem, box_of
from catheter_sim.diagnosis.fitting.stretches import blocks_of
from catheter_sim.diagnosis.next_experiment.alive import Alive
from catheter_sim.diagnosis.next_experiment.information import Information, Predictive, information
from catheter_sim.diagnosis.next_experiment.programmes import Programme
from catheter_sim.diagnosis.report.next_experiment import NEXT_EXPERIMENT_FILE
from catheter_sim.diagnosis.thresholds import ROWS_AS_ONE, TRUSTED_SHARE
from catheter_sim.errors import InputError
from catheter_sim.tables import Table


def told_by(
    problem: Problem, hypotheses: Sequence[Alive], programme: Programme, noise: Array
) -> Information | None:
    """Return what a programme tells; None where a hypothesis cannot follow it."""
    inputs = playable(problem, programme)
    if inputs is None:
        return None
    trials = [as_said(problem, item.fit, inputs) for item in hypotheses]
    if any(trial is None for trial in trials):
        return None
    plain = _without_causes(problem, hypotheses, inputs)
    predictives = [
        _predictive(problem, item.fit, trial, noise, plain)
        for item, trial in zip(hypotheses, trials, strict=True)
        if trial is not None
    ]
    stretch = stretches_of(problem, trials[0])
    return information([item.belief for item in hypotheses], predictives, stretch)


def stretches_of(problem: Problem, trial: Trial | None) -> np.ndarray:
    """Return the stretch of each output of a trial as a diagnosis of it with the data so far would cut it."""
    assert trial is not None
    measured = problem.columns[:1]  # the trials so far have not measured what a further sensor would
    together = replace(problem, trials=(*problem.trials, trial), every=1, columns=measured)
    return np.repeat(blocks_of(together)[-len(trial.inputs) :], len(problem.columns))


def playable(problem: Problem, programme: Programme) -> Trial | None:
    robot = replace(problem.robot, actuation=problem.trials[0].inputs.actuation)
    try:
        inputs = read_inputs(robot, programme.table)
    except InputError:
        return None
    return Trial(NEXT_EXPERIMENT_FILE, "train", inputs, Table(inputs.time_s, {}, NEXT_EXPERIMENT_FILE))


def as_said(problem: Problem, result: Fit, trial: Trial) -> Trial | None:
    """Return a trial with the outputs that a hypothesis says; None where it finds no posture."""
    try:
        outputs = predicted(problem, result.numbers, result.x, trial.inputs)
    except InputError:
        return None
    if not np.isfinite(outputs).all():
        return None
    columns = {name: outputs[:, index] for index, name in enumerate(problem.columns)}
    return replace(trial, outputs=Table(trial.inputs.time_s, columns, NEXT_EXPERIMENT_FILE))


def said(problem: Problem, trial: Trial) -> Array:
    return np.stack([trial.outputs.columns[name] for name in problem.columns], axis=1)


def _without_causes(problem: Problem, hypotheses: Sequence[Alive], trial: Trial) -> Array | None:
    """Return what a hypothesis without its causes says, shape (r, o): the most believed one's calibration."""
    result = hypotheses[0].fit
    kept = [index for index, item in enumerate(result.numbers) if not item.effect]
    numbers = tuple(result.numbers[index] for index in kept)
    outputs = predicted(problem, numbers, result.x[kept], trial.inputs)
    return outputs if np.isfinite(outputs).all() else None


def _predictive(problem: Problem, result: Fit, trial: Trial, noise: Array, plain: Array | None) -> Predictive:
    """Return what a hypothesis says of a trial, in units of the noise, with what it leaves open."""
    mean = said(problem, trial)
    size = noise * np.sqrt(ROWS_AS_ONE)
    alone = replace(problem, trials=(trial,), every=1)
    low, high = box_of(result.numbers)
    spread = np.zeros((mean.size, 0))
    if len(result.numbers):
        slope = linearised(alone, result.numbers, result.x, high).jacobian
        slope = slope * np.broadcast_to(problem.weight / size, mean.shape).reshape(-1, 1)
        slope = np.where(np.isfinite(slope), slope, 0.0)
        spread = slope @ _open_directions(result, low, high)
    if plain is not None:
        doubt = TRUSTED_SHARE * ((mean - plain) / size).reshape(-1, 1)
        spread = np.concatenate([spread, doubt], axis=1)
    return Predictive((mean / size).reshape(-1), spread)


def _open_directions(result: Fit, low: Array, high: Array) -> Array:
    """Return the root of the covariance of a hypothesis's numbers after the data so far, shape (p, p).

    Where the data say nothing of a number it is uniform between its bounds, or as wide as is known of it.
    """
    known = prior_of(result.numbers).precision
    width = np.maximum(high - low, 1e-12)
    wide = np.where(np.isfinite(width), 12.0 / width**2, 0.0)
    residual = result.residual
    variance = max(float(residual @ residual) / max(len(residual) - len(result.numbers), 1), 1e-12)
    precision = result.jacobian.T @ result.jacobian / (ROWS_AS_ONE * variance)
    precision = precision + np.diag(np.where(known > 0.0, known, wide) + 1e-9)
    values, vectors = np.linalg.eigh(precision)
    return np.asarray(vectors / np.sqrt(np.maximum(values, 1e-12)))
