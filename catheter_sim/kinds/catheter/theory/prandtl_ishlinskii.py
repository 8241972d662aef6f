"""The Prandtl-Ishlinskii model of hysteresis: a weighted sum of plays (Nayar 2022, Eqs 29-34).

The weights are found by non-negative least squares, which has one answer; the paper takes a general
optimiser. With non-negative weights every loop is symmetric about its middle and bends one way: a joint
that is slack about zero and follows without a loop beyond cannot be told so. With dead zones before the
plays (as in Kuhnen 2003, Eur. J. Control 9, 407-418, but in front, so that the weights stay linear) it can.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import nnls

from catheter_sim.arrays import Array
from catheter_sim.errors import InputError
from catheter_sim.mechanics.play import plays

OPERATORS = 10  # m of the paper: one more operator than that, the first without a threshold


@dataclass(frozen=True)
class PrandtlIshlinskii:
    """Weighted plays.

    Attributes:
        thresholds: r_i of Eq. 33, half of each play's width, shape (m + 1,), in the input's unit.
        weights: w_h, shape (z (m + 1),), output per input; those of the first dead zone first.
        rmse: of the fit, in the output's unit.
        dead_zones: half widths of the memoryless dead zones before the plays, shape (z,); (0,): none.
    """

    thresholds: Array
    weights: Array
    rmse: float
    dead_zones: Array = field(default_factory=lambda: np.zeros(1))

    def __call__(self, values: Array) -> Array:
        """Return the output along the input `values`, from rest, same shape (r,) (Eq. 32)."""
        return _outputs(values, self.dead_zones, self.thresholds) @ self.weights


def identify(
    values: Array, measured: Array, operators: int = OPERATORS, dead_zones: int = 0
) -> PrandtlIshlinskii:
    """Return the model that fits a measured history from rest best (Eqs 33-34).

    Args:
        values: input, row by row, shape (r,).
        measured: output, shape (r,).
        operators: m of Eq. 33.
        dead_zones: how many dead zones stand before the plays, besides none; 0 is the paper's model.

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
    zones = largest * np.arange(dead_zones + 1) / (dead_zones + 1)
    weights, left = nnls(_outputs(values, zones, thresholds), measured)
    return PrandtlIshlinskii(thresholds, weights, float(left) / len(values) ** 0.5, zones)


def _outputs(values: Array, dead_zones: Array, thresholds: Array) -> Array:
    """Return the outputs of all plays behind all dead zones, shape (r, z k)."""
    behind = [np.copysign(np.maximum(np.abs(values) - zone, 0.0), values) for zone in dead_zones]
    return np.concatenate([plays(own, thresholds) for own in behind], axis=1)
