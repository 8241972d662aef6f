"""In how many steps a robot with friction goes from one row of inputs to the next."""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array

_BESIDE_SHARE = 0.1  # of a step's bend, beside tendons of one end that move all but alone
_ROUNDING = 1e-9


def counts_where_alone(bend_rad: Array, alone_rad: Array, step_rad: float, alone_step_rad: float) -> Array:
    """Return how many steps rows take, longer ones where the tendons of one end move all but alone.

    Args:
        bend_rad: by which the change of all inputs would bend a frictionless robot, shape (r,).
        alone_rad: the part of the tendons of one end, those that do most, shape (r,).
        step_rad: of a step.
        alone_step_rad: of a step where all else bends it by less than a tenth of `step_rad`.
    """
    beside = np.ceil((bend_rad - alone_rad) / (_BESIDE_SHARE * step_rad) - _ROUNDING)
    counts: Array = np.maximum(
        np.ceil(alone_rad / alone_step_rad), np.minimum(np.ceil(bend_rad / step_rad), beside)
    )
    return counts
