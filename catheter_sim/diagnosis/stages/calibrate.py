"""The model "before", calibrated to the training trials, without any cause."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from catheter_sim.diagnosis.fitting.fit import Fit, fit
from catheter_sim.diagnosis.fitting.noise import least_noise, noise_floor, repeat_noise, residual_noise
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.stages.pose import Posed


@dataclass(frozen=True)
class Calibrated:
    """The calibrated model without causes.

    Attributes:
        fit: to the training trials.
        noise: of each unit, as far as this model lets it be seen.
    """

    fit: Fit
    noise: Mapping[str, float]


def calibrate(posed: Posed) -> Calibrated:
    """Return the model without causes, its nuisance parameters fitted."""
    found = fit(posed.train, (), cross_validate=False, thorough=posed.thorough)
    return Calibrated(found, noise_beside(posed.train, found))


def noise_beside(train: Problem, result: Fit) -> dict[str, float]:
    """Return the noise of each unit: from repeats, and from what is white in a hypothesis's residuals.

    It is no less than what the readings' resolution leaves. Of the training trials alone: where one trial was
    cut, its held-out part runs through all of its rows.
    """
    found = noise_floor(residual_noise(train, result), repeat_noise(train.trials, train.columns))
    least = least_noise(train)
    return {
        unit: max(value, least[unit], train.repeatability.get(unit, 0.0)) for unit, value in found.items()
    }
