"""Where a robot's markers are: points that are fixed to its elements."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.robot import Marker


def offsets_of(markers: Sequence[Marker]) -> Array:
    """Return where markers lie in their elements' frames, shape (m, 3) [m]."""
    rows = [(item.offset_x_m, item.offset_y_m, item.offset_z_m) for item in markers]
    return np.array(rows, dtype=float).reshape(-1, 3)


def elements_of(markers: Sequence[Marker]) -> list[int]:
    """Return the places of markers' elements among all elements, base to tip, counted from 0."""
    return [marker.element - 1 for marker in markers]


def points_beside(p_w: Array, R_w: Array, offset: Array) -> Array:
    """Return points that are given in frames, p + R offset, shape (..., m, 3) [m].

    Args:
        p_w: the frames' origins, shape (..., m, 3) [m].
        R_w: their orientations, shape (..., m, 3, 3).
        offset: of each point in its frame, shape (..., m, 3) [m].
    """
    return p_w + np.matmul(R_w, offset[..., np.newaxis])[..., 0]


def marker_points(markers: Sequence[Marker], p_w: Array, R_w: Array) -> Array:
    """Return where markers are, shape (..., m, 3) [m].

    Args:
        markers: of the robot.
        p_w: centres of all elements' distal faces, base to tip, shape (..., n, 3) [m].
        R_w: their orientations, shape (..., n, 3, 3).
    """
    at = elements_of(markers)
    return points_beside(p_w[..., at, :], R_w[..., at, :, :], offsets_of(markers))
