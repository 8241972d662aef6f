"""Which way to move the drives so that the tip moves as wished: the robot taken for arcs.

Friction and load are left out: the direction is right, the size a little large. Who steers looks
again after each change.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import lsq_linear

from catheter_sim.robots.posture import Array
from catheter_sim.statics.arcs import segment_frames

_DIFFERENCE_RAD = 1e-5
# A change of a drive by its whole range weighs as much as a miss by this share of the robot's
# length: it keeps antagonists from working against each other, and steps small near a singularity.
_EFFORT = 0.02


def arc_tips(bend: Array, length: Array) -> Array:
    """Return the tips of robots of arcs, shape (..., 3) [m].

    Args:
        bend: of each segment, toward +x and +y, shape (..., s, 2) [rad].
        length: shape (s,) [m].
    """
    return segment_frames(bend, length)[0][..., -1, :]


def tip_jacobian(bend: Array, length: Array) -> Array:
    """Return how the tip moves with the segments' bends, shape (3, s, 2) [m/rad]."""
    steps = _DIFFERENCE_RAD * np.eye(bend.size).reshape(-1, *bend.shape)
    slopes = (arc_tips(bend + steps, length) - arc_tips(bend - steps, length)) / (2.0 * _DIFFERENCE_RAD)
    return slopes.T.reshape(3, *bend.shape)


def change_toward(
    way_m: Array, bend: Array, length: Array, drive_bend: Array, least: Array, most: Array
) -> Array:
    """Return the change of the drives' levels that moves the tip by `way_m`, or as near as they can.

    Args:
        way_m: wished motion of the tip, shape (3,) [m].
        bend: of each segment now, shape (s, 2) [rad].
        length: of the segments, shape (s,) [m].
        drive_bend: bend at level 1 of each drive, shape (s, 2, d) [rad].
        least, most: bounds of the change, least <= 0 <= most, shape (d,).
    """
    jacobian = np.einsum("isa,sad->id", tip_jacobian(bend, length), drive_bend)
    effort = _EFFORT * float(length.sum()) * np.eye(drive_bend.shape[-1])
    # A drive at the end of its range: the solver wants room between the bounds.
    low, high = np.minimum(least, -1e-9), np.maximum(most, 1e-9)
    found = lsq_linear(
        np.concatenate([jacobian, effort]), np.concatenate([way_m, np.zeros(len(effort))]), (low, high)
    )
    return np.clip(found.x, least, most)
