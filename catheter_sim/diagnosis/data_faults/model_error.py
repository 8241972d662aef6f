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
from catheter_sim.diagnosis.fitting.noise import white_noise
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
    models: Sequence[Array],
    measured: Sequence[Array],
    columns: Sequence[str],
    shifted: bool,
    beside: Array | None = None,
) -> float:
    """Return the error over the measurements' spread, root mean square over columns; inf: no posture.

    Where positions are `shifted`, their error is counted about its mean. `beside`: outputs whose spread
    counts instead, shape (r, o).
    """
    model, values = np.concatenate(models), np.concatenate(measured)
    spread = _spread(model, values if beside is None else beside)
    error = model - values
    places = np.array([shifted and unit_of(name) == "mm" for name in columns])
    error = (error - np.where(places, np.nanmean(error, axis=0), 0.0)) / spread
    counted = error[np.isfinite(values)]
    return float(np.sqrt(np.mean(counted**2))) if np.isfinite(counted).all() else math.inf


def noise_share(measured: Sequence[Array], models: Sequence[Array], columns: Sequence[str]) -> float:
    """Return what noise alone would make of `relative_error`; an upper bound, from row to row."""
    series = {name: [item[:, k] for item in measured] for k, name in enumerate(columns)}
    noise = white_noise(series)
    spread = _spread(np.concatenate(models), np.concatenate(measured))
    return float(
        np.sqrt(
            np.mean(
                [(noise.get(unit_of(name), 0.0) / s) ** 2 for name, s in zip(columns, spread, strict=True)]
            )
        )
    )


def _spread(model: Array, values: Array) -> Array:
    """Return each output's spread, at least a share of the largest one, measured or computed, shape (o,)."""
    spread, computed = np.nanstd(values, axis=0), np.nanstd(model, axis=0)
    largest = spread.max(initial=1e-12)
    if np.isfinite(computed).all():
        # A column in a wrong unit must not make the others look small.
        largest = min(largest, computed.max(initial=1e-12))
    return np.asarray(np.maximum(spread, LEAST_SPREAD_SHARE * max(largest, 1e-12)))


def computed_outputs(problem: Problem, before: Fit, trials: Sequence[Trial]) -> list[Array]:
    return predicted_along(problem, before.numbers, before.x, [trial.inputs for trial in trials])
