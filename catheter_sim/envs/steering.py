"""By how much to move the drives so that the tip moves as wished, within their ranges."""

from __future__ import annotations

import numpy as np
from scipy.optimize import lsq_linear

from catheter_sim.arrays import Array

# A change of a drive by its whole range weighs as much as a miss by this share of the robot's
# length: it keeps antagonists from working against each other, and steps small near a singularity.
_EFFORT = 0.02


def change_toward(way_m: Array, slopes: Array, length_m: float, least: Array, most: Array) -> Array:
    """Return the change of the drives' levels that moves the tip by `way_m`, or as near as they can.

    Args:
        way_m: wished motion of the tip, shape (3,), or more of what is wished, (m,) [m].
        slopes: how the tip moves with the levels (`QuickModel.tip_slopes`), shape (m, d) [m].
        length_m: of the robot.
        least, most: bounds of the change, least <= 0 <= most, shape (d,).
    """
    effort = _EFFORT * length_m * np.eye(slopes.shape[1])
    # A drive at the end of its range: the solver wants room between the bounds.
    low, high = np.minimum(least, -1e-9), np.maximum(most, 1e-9)
    found = lsq_linear(
        np.concatenate([slopes, effort]), np.concatenate([way_m, np.zeros(len(effort))]), (low, high)
    )
    return np.clip(found.x, least, most)
