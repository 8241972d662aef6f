"""How far a model is off, beside how much the measurements vary."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.data.resolution import steps_of
from catheter_sim.diagnosis.data.trials import Trial, measured_of
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.noise import white_noise
from catheter_sim.diagnosis.fitting.prediction import predicted_along
from catheter_sim.diagnosis.fitting.problem import Problem


def relative_error_of(
    trials: Sequence[Trial], columns: Sequence[str], predict: Callable[[Inputs], Array], shifted: bool
) -> float:
    """Return a model's error over the measurements' spread; arguments as of `most_likely_mistake`."""
    measured = [measured_of(trial, columns) for trial in trials]
    return relative_error([predict(trial.inputs) for trial in trials], measured, columns, shifted)


def relative_error(
    models: Sequence[Array],
    measured: Sequence[Array],
    columns: Sequence[str],
    shifted: bool,
    beside: Array | None = None,
) -> float:
    """Return the error over the measurements' spread, root mean square over units; inf: no posture.

    Of each unit all columns count together, so that those that move most count most.

    Args:
        models: what the model says, shape (r, o) each.
        measured: the same as measured; NaN: missing.
        columns: outputs.
        shifted: errors of positions are counted about their means.
        beside: outputs whose spread counts instead of the measured ones', shape (r, o).
    """
    model, values = np.concatenate(models), np.concatenate(measured)
    if not np.isfinite(model[np.isfinite(values)]).all():
        return math.inf
    spread = values if beside is None else beside
    shares = []
    for unit in dict.fromkeys(unit_of(name) for name in columns):
        mine = [k for k, name in enumerate(columns) if unit_of(name) == unit]
        mine = [k for k in mine if np.isfinite(values[:, k]).any()]
        error = model[:, mine] - values[:, mine]
        if shifted and unit == "mm" and mine:
            error = error - np.nanmean(error, axis=0)
        if mine:
            total = float(np.nanvar(spread[:, mine], axis=0).mean())
            shares.append(float(np.nanmean(error**2)) / max(total, 1e-24))
    return math.sqrt(sum(shares) / len(shares)) if shares else 0.0


def noise_share(trials: Sequence[Trial], columns: Sequence[str]) -> float:
    """Return what noise alone would make of `relative_error`; an upper bound, from row to row."""
    series = {name: [trial.outputs.columns[name] for trial in trials] for name in columns}
    noise = white_noise(series, trials, steps_of(trials, columns))
    values = np.concatenate([measured_of(trial, columns) for trial in trials])
    shares = []
    for unit, size in noise.items():
        mine = [k for k, name in enumerate(columns) if unit_of(name) == unit]
        mine = [k for k in mine if np.isfinite(values[:, k]).any()]
        shares.append(size**2 / max(float(np.nanvar(values[:, mine], axis=0).mean()), 1e-24))
    return math.sqrt(sum(shares) / len(shares)) if shares else 0.0


def computed_outputs(problem: Problem, before: Fit, trials: Sequence[Trial]) -> list[Array]:
    return predicted_along(problem, before.numbers, before.x, [trial.inputs for trial in trials])


def errors_in_noise(
    problem: Problem, result: Fit, trials: Sequence[Trial], noise: Mapping[str, float]
) -> Array:
    """Return each trial's error, root mean square in units of the noise, shape (k,)."""
    scale = np.array([noise[unit_of(name)] for name in problem.columns])
    return np.array(
        [
            np.sqrt(np.nanmean(((model - measured_of(trial, problem.columns)) / scale) ** 2))
            for trial, model in zip(trials, computed_outputs(problem, result, trials), strict=True)
        ]
    )
