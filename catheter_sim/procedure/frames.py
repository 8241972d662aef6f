"""Rigid transforms as the procedure needs them: the robot's base in the valve frame, errors of a pose."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array

DOWN = np.array([0.0, 0.0, -1.0])  # along the valve's axis, into the ventricle


def transform(R: Array, p: Array) -> Array:
    """Return a rotation and a position as one transform, shape (4, 4)."""
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = R, p
    return result


def base_frame(puncture: Array, direction: Array, roll_rad: float, insertion_m: float) -> Array:
    """Return the robot's base frame in the valve frame, shape (4, 4).

    Args:
        puncture: on the septum, shape (3,) [m].
        direction: of the sheath, unit vector, shape (3,).
        roll_rad: from the home bending plane to the plane of the sheath and the valve's axis.
        insertion_m: of the base beyond the puncture, along the sheath.
    """
    toward_valve = DOWN - (DOWN @ direction) * direction
    toward_valve /= np.linalg.norm(toward_valve)
    aside = np.cross(direction, toward_valve)
    x = math.cos(roll_rad) * toward_valve - math.sin(roll_rad) * aside
    R = np.stack([x, np.cross(direction, x), direction], axis=1)
    return transform(R, puncture + insertion_m * direction)


def pose_error(wanted: Array, reached: Array) -> Array:
    """Return what is missing from a pose: position [m], then rotation vector [rad]; shape (6,)."""
    turn = Rotation.from_matrix(wanted[:3, :3] @ reached[:3, :3].T).as_rotvec()
    return np.concatenate([wanted[:3, 3] - reached[:3, 3], turn])
