"""The Prandtl-Ishlinskii model of hysteresis: a weighted sum of plays (Nayar 2022, Eqs 29-34).

The weights are found by non-negative least squares, which has one answer; the paper takes a general
optimiser. With non-negative weights every loop is symmetric about its middle and bends one way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from catheter_sim.errors import InputError
from catheter_sim.robots.posture import Array

OPERATORS = 10  # m of the paper: one more operator than that, the first without a threshold


@dataclass(frozen=True)
class PrandtlIshlinskii:
    """Weighted plays.

    Attributes:
        thresholds: r_i of Eq. 33, half of each play's width, shape (m + 1,), in the input's unit.
        weights: w_h, shape (m + 1,), output per input.
        rmse: of the fit, in the output's unit.
    """

    thresholds: Array
    weights: Array
    rmse: float

    def __call__(self, values: Array) -> Array:
        """Return the output along the input `values`, from rest, same shape (r,) (Eq. 32)."""
        return plays(values, self.thresholds) @ self.weights


def plays(values: Array, thresholds: Array) -> Array:
    """Return the outputs of plays that start at rest at zero (Eqs 29-30).

    Args:
        values: input, row by row, shape (r,).
        thresholds: half of each play's width, shape (k,).

    Returns:
        Shape (r, k).
    """
    result = np.empty((len(values), len(thresholds)))
    now = np.zeros(len(thresholds))
    for row, value in enumerate(values):
        now = np.maximum(value - thresholds, np.minimum(value + thresholds, now))
        result[row] = now
    return result


def identify(values: Array, measured: Array, operators: int = OPERATORS) -> PrandtlIshlinskii:
    """Return the model that fits a measured history from rest best (Eqs 33-34).

    Args:
        values: input, row by row, shape (r,).
        measured: output, shape (r,).
        operators: m of Eq. 33.

    Raises:
        InputError: fewer rows than weights, a missing value, or an input that never moves.
    """
    if len(values) != len(measured) or len(values) <= operators:
        rows = f"{len(values)} inputs and {len(measured)} outputs"
        raise InputError(f"Prandtl-Ishlinskii model: {rows} for {operators + 1} weights")
    if not (np.isfinite(values).all() and np.isfinite(measured).all()):
        raise InputError("Prandtl-Ishlinskii model: inputs and outputs must be finite numbers")
    largest = float(np.abs(values).max())
    if largest == 0.0:
        raise InputError("Prandtl-Ishlinskii model: the input never leaves zero")
    thresholds = largest * np.arange(operators + 1) / (operators + 1)
    weights, left = nnls(plays(values, thresholds), measured)
    return PrandtlIshlinskii(thresholds, weights, float(left) / len(values) ** 0.5)
