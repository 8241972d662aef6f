"""Where pure rolling puts the links, compiled."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.rolling.theory.kernels.columns import AXIS, LINE, RADIUS_NEGATIVE, RADIUS_POSITIVE
from catheter_sim.mechanics.compiled import compiled


@compiled
def roll_on(joint: Array, k: int, theta: float, length: float, face: Array, R: Array, origin: Array) -> None:
    """Go from the flat below joint k to its link's: move `face` and `R`, fill its frame's `origin`."""
    a, line = int(joint[k, AXIS]), joint[k, LINE]
    radius = joint[k, RADIUS_POSITIVE] if theta >= 0.0 else joint[k, RADIUS_NEGATIVE]
    sine, cosine = math.sin(theta), math.cos(theta)
    for i in range(3):
        e, z = R[i, a], R[i, 2]
        face[i] += (line + radius * (theta - sine)) * e + radius * (1.0 - cosine) * z
        R[i, a] = cosine * e - sine * z
        R[i, 2] = sine * e + cosine * z
        origin[i] = face[i] - line * R[i, a]
        face[i] = origin[i] + length * R[i, 2]


@compiled
def tops(joint: Array, theta: Array, length: Array, face: Array, R_w: Array) -> None:
    """Fill the links' flat tops and orientations, shapes (r, n, 3) and (r, n, 3, 3), of r rows of angles."""
    rows, n = theta.shape
    here, R, origin = np.empty(3), np.empty((3, 3)), np.empty(3)
    for row in range(rows):
        here[:] = 0.0
        R[:, :] = np.eye(3)
        for k in range(n):
            roll_on(joint, k, theta[row, k], length[row, k], here, R, origin)
            face[row, k], R_w[row, k] = here, R
