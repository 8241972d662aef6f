"""Where a robot is: the one result of simulation and static models, with its markers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.robot import Marker

# ----------------------------------------------------------------------------------------------------
# Where a robot is: the one result that the simulation and every static model return per row.


@dataclass(frozen=True)
class Posture:
    """A robot's posture in the base frame, SI units.

    Attributes:
        p_w: centres of the elements' distal faces, base to tip, shape (n, 3) [m].
        R_w: their orientations, shape (n, 3, 3); columns are the body axes in the base frame.
        joint_angles: one per hinge in the order of `channels.joint_names`, shape (m,) [rad].
        actuator_tension: per tendon, in the robot's order, at the actuator, shape (t,) [N].
        tendon_tension: per tendon and subsegment, base to tip, shape (t, n) [N]; NaN beyond a
            tendon's end.
        markers_w: positions of the robot's markers, shape (m, 3) [m], where they are seen elsewhere than
            their elements' frames say; None: they are there.
    """

    p_w: Array
    R_w: Array
    joint_angles: Array
    actuator_tension: Array
    tendon_tension: Array
    markers_w: Array | None = None


def finite_rows(postures: Sequence[Posture]) -> int:
    """Return how many postures come before the first one with a position or turn that is no number."""
    for row, posture in enumerate(postures):
        parts = (posture.p_w, posture.R_w, posture.joint_angles)
        if not all(np.isfinite(part).all() for part in parts):
            return row
    return len(postures)


@dataclass(frozen=True)
class Observed:
    """What is measured of a robot, row by row, SI units; what is not asked for may be left out (k = 0).

    Positions and orientations may belong to different frames.

    Attributes:
        time_s: of the rows, shape (r,).
        p_w: positions in the base frame, shape (r, k, 3) [m].
        R_w: orientations, shape (r, m, 3, 3).
        joint_angles: shape (r, j) [rad].
        tension: at the actuators, shape (r, t) [N].
    """

    time_s: Array
    p_w: Array
    R_w: Array
    joint_angles: Array
    tension: Array


# ----------------------------------------------------------------------------------------------------
# Where a robot's markers are: points that are fixed to its elements.


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
