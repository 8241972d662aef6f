"""What loads do at the hinges of a planar chain, compiled."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.planar_kernels.columns import LENGTH
from catheter_sim.mechanics.compiled import compiled


@compiled
def find_load_moments(
    cell: Array, weight: Array, wrench: Array, angles: Array, load: Array, outer: Array
) -> None:
    """Fill the loads' moments about the hinges, and by how much turning one changes those of others.

    `outer[max(k, m)]` is the derivative of the moment at hinge k by the angle of cell m, as in
    `planar.hinge_moment_slopes`. `wrench`: force along x and z on the tip, moment about y.
    """
    n = len(angles)
    hinge = np.empty((n, 2))
    face = np.empty((n, 2))
    x, z, lean = 0.0, 0.0, 0.0
    for k in range(n):
        half = 0.5 * cell[k, LENGTH]
        x += half * math.sin(lean)
        z += half * math.cos(lean)
        hinge[k, 0], hinge[k, 1] = x, z
        lean += angles[k]
        x += half * math.sin(lean)
        z += half * math.cos(lean)
        face[k, 0], face[k, 1] = x, z
    fx, fz = wrench[0], wrench[1]
    about = z * fx - x * fz
    along = x * fx + z * fz
    for k in range(n - 1, -1, -1):
        fx += weight[k, 0]
        fz += weight[k, 1]
        about += face[k, 1] * weight[k, 0] - face[k, 0] * weight[k, 1]
        along += face[k, 0] * weight[k, 0] + face[k, 1] * weight[k, 1]
        load[k] = about - hinge[k, 1] * fx + hinge[k, 0] * fz + wrench[2]
        outer[k] = hinge[k, 0] * fx + hinge[k, 1] * fz - along
