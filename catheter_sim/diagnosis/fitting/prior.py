"""What is known of calibrated numbers before anything is measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.fitting.problem import FittedNumber


@dataclass(frozen=True)
class Prior:
    """Squares added for nuisances that leave their middle, in units of the residuals' weights.

    A nuisance is uniform in its range, so that its standard deviation is half_range / sqrt(3). Beside
    hundreds of measurements this decides only what they leave open: where a nuisance and a cause do the same,
    the cause moves.
    """

    middle: Array
    precision: Array

    def cost(self, x: Array) -> float:
        return float(self.precision @ (x - self.middle) ** 2)

    def gradient(self, x: Array) -> Array:
        return self.precision * (x - self.middle)


def prior_of(numbers: Sequence[FittedNumber]) -> Prior:
    scale = np.array([fitted.parameter.scale for fitted in numbers])
    spread = np.array([fitted.spread for fitted in numbers])
    known = np.isfinite(spread)
    middle = [fitted.parameter.to_fit(fitted.parameter.null) for fitted in numbers]
    return Prior(np.where(known, middle, 0.0) / scale, np.where(known, (scale / spread) ** 2, 0.0))
