"""Lengths of tendons along continuous paths, compiled."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.columns import LENGTH
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.strain import path_direction, strain_of
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.vectors import turned, turned_back


@compiled
def _wrench_slope(strain: Array, wrench: Array, out: Array) -> None:
    """Set how the wrench of an unloaded stretch changes along the rod, in the body's frame."""
    ux, uy, uz = strain[0], strain[1], strain[2]
    vx, vy, vz = strain[3], strain[4], 1.0 + strain[5]
    mx, my, mz, nx, ny, nz = wrench[0], wrench[1], wrench[2], wrench[3], wrench[4], wrench[5]
    out[0] = -(uy * mz - uz * my) - (vy * nz - vz * ny)
    out[1] = -(uz * mx - ux * mz) - (vz * nx - vx * nz)
    out[2] = -(ux * my - uy * mx) - (vx * ny - vy * nx)
    out[3] = -(uy * nz - uz * ny)
    out[4] = -(uz * nx - ux * nz)
    out[5] = -(ux * ny - uy * nx)


@compiled
def measure_paths(
    rod: Array, hole: Array, last: NDArray[np.intp], span: Array, wrench: Array, p_w: Array, R_w: Array,
    length: Array,
) -> None:  # fmt: skip
    """Set the lengths of tendons along continuous paths from the base to their ends, shape (r, t) [m].

    Simpson's rule over each section, the wrench at its middle by the values and slopes at its ends.

    Args:
        rod: sections' data, shape (n, 8).
        hole: shape (t, 2) [m].
        last: number of the disk where each tendon ends, shape (t,).
        span: tensions, zero beyond a tendon's end, shape (r, t, n) [N].
        wrench: at the sections' starts, in their frames, shape (r, n, 6).
        p_w, R_w: of disks 0 to n, shapes (r, n + 1, 3) [m], (r, n + 1, 3, 3).
        length: result.
    """
    rows, tendons, n = span.shape
    strain, slope, wrenches = np.zeros((3, 6)), np.empty((2, 6)), np.empty((3, 6))
    stiffness, along = np.empty((6, 6)), np.empty(tendons)
    arm, p, path = np.empty(3), np.empty(3), np.empty(3)
    for row in range(rows):
        for k in range(tendons):
            length[row, k] = 0.0
        for j in range(n):
            for k in range(tendons):
                along[k] = span[row, k, j]
            for i in range(3):
                arm[i] = p_w[row, j + 1, i] - p_w[row, j, i]
            turned_back(R_w[row, j], arm, p)
            m, f = wrench[row, j, :3], wrench[row, j, 3:]
            for i in range(6):
                wrenches[0, i] = wrench[row, j, i]
            arm[0] = m[0] - (p[1] * f[2] - p[2] * f[1])
            arm[1] = m[1] - (p[2] * f[0] - p[0] * f[2])
            arm[2] = m[2] - (p[0] * f[1] - p[1] * f[0])
            turned(R_w[row, j], arm, path)
            turned_back(R_w[row, j + 1], path, wrenches[2, :3])
            turned(R_w[row, j], f, path)
            turned_back(R_w[row, j + 1], path, wrenches[2, 3:])
            for end in range(2):
                strain_of(rod[j], hole, along, wrenches[2 * end], strain[2 * end], stiffness)
                _wrench_slope(strain[2 * end], wrenches[2 * end], slope[end])
            for i in range(6):
                wrenches[1, i] = 0.5 * (wrenches[0, i] + wrenches[2, i])
                wrenches[1, i] += 0.125 * rod[j, LENGTH] * (slope[0, i] - slope[1, i])
            strain_of(rod[j], hole, along, wrenches[1], strain[1], stiffness)
            for k in range(tendons):
                if j >= last[k]:
                    continue
                for place in range(3):
                    path_direction(strain[place], hole[k], path)
                    size = math.sqrt(path[0] ** 2 + path[1] ** 2 + path[2] ** 2)
                    length[row, k] += (4.0 if place == 1 else 1.0) / 6.0 * rod[j, LENGTH] * size
