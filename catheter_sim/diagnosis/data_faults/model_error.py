"""How far a model is off, beside how much the measurements vary."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Array
from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.data.trials import Trial, measured_of
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.prediction import predicted_along
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.thresholds import LEAST_SPREAD_SHARE


def relative_error_of(
    trials: Sequence[Trial], columns: Sequence[str], predict: Callable[[Inputs], Array], shifted: bool
) -> float:
    """Return a model's error over the measurements' spread; arguments as of `most_likely_mistake`."""
    measured = [measured_of(trial, columns) for trial in trials]
    return relative_error([predict(trial.inputs) for trial in trials], measured, columns, shifted)


def relative_error(
    models: Sequence[Array], measured: Sequence[Array], columns: Sequence[str], shifted: bool
) -> float:
    """Return the error over the measurements' spread, root mean square over columns; inf: no posture.

    Where positions are `shifted`, their error is counted about its mean.
    """
    model, values = np.concatenate(models), np.concatenate(measured)
    spread = np.nanstd(values, axis=0)
    spread = np.maximum(spread, LEAST_SPREAD_SHARE * spread.max(initial=1e-12))
    error = model - values
    places = np.array([shifted and unit_of(name) == "mm" for name in columns])
    error = (error - np.where(places, np.nanmean(error, axis=0), 0.0)) / spread
    counted = error[np.isfinite(values)]
    return float(np.sqrt(np.mean(counted**2))) if np.isfinite(counted).all() else math.inf


def computed_outputs(problem: Problem, before: Fit, trials: Sequence[Trial]) -> list[Array]:
    return predicted_along(problem, before.numbers, before.x, [trial.inputs for trial in trials])
