"""The static model CC: arcs from tensions, in closed form."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.robots.continuum.rods import RodProblem, middles

# ----------------------------------------------------------------------------------------------------
# Disks on chains of arcs, rows of tensions at once: the closed form of CC, compiled.

_SMALL_RAD2 = 1e-4  # squared angle below which the series is exact to the last bit


@compiled
def disks_on_arcs(per_tension: Array, tension: Array, length: Array, p: Array, R: Array) -> None:
    """Write the disks' positions, shape (r, n + 1, 3) [m], and orientations, shape (r, n + 1, 3, 3).

    Args:
        per_tension: bend toward +x and +y of each subsegment by each tension, shape (t, n, 3) [rad/N]; the
            third is twist and not read.
        tension: shape (r, t) [N].
        length: of the subsegments, shape (n,) [m].
        p, R: results; disk 0 is fixed, upright at the origin.
    """
    tendons, n = per_tension.shape[0], per_tension.shape[1]
    for row in range(len(tension)):
        px = py = pz = 0.0
        xx = yy = zz = 1.0
        xy = xz = yx = yz = zx = zy = 0.0
        t00 = t01 = t02 = t11 = t12 = t22 = s0 = s1 = s2 = 0.0
        for j in range(n + 1):
            p[row, j, 0], p[row, j, 1], p[row, j, 2] = px, py, pz
            R[row, j, 0, 0], R[row, j, 0, 1], R[row, j, 0, 2] = xx, xy, xz
            R[row, j, 1, 0], R[row, j, 1, 1], R[row, j, 1, 2] = yx, yy, yz
            R[row, j, 2, 0], R[row, j, 2, 1], R[row, j, 2, 2] = zx, zy, zz
            if j == n:
                break
            same = j > 0 and length[j] == length[j - 1]
            for k in range(tendons):
                for c in range(2):
                    same = same and per_tension[k, j, c] == per_tension[k, j - 1, c]
            if not same:
                bx = by = 0.0
                for k in range(tendons):
                    bx += per_tension[k, j, 0] * tension[row, k]
                    by += per_tension[k, j, 1] * tension[row, k]
                square = bx * bx + by * by
                if square < _SMALL_RAD2:
                    sine = 1.0 - square / 6.0 * (1.0 - square / 20.0)
                    versine = 0.5 - square / 24.0 * (1.0 - square / 30.0)
                else:
                    angle = math.sqrt(square)
                    half = math.sin(0.5 * angle)
                    sine = math.sin(angle) / angle
                    versine = 2.0 * half * half / square
                t00, t01, t02 = 1.0 - versine * bx * bx, -versine * bx * by, sine * bx
                t11, t12, t22 = 1.0 - versine * by * by, sine * by, 1.0 - versine * square
                s0, s1, s2 = length[j] * versine * bx, length[j] * versine * by, length[j] * sine
            px += xx * s0 + xy * s1 + xz * s2
            py += yx * s0 + yy * s1 + yz * s2
            pz += zx * s0 + zy * s1 + zz * s2
            xx, xy, xz = (
                xx * t00 + xy * t01 - xz * t02,
                xx * t01 + xy * t11 - xz * t12,
                xx * t02 + xy * t12 + xz * t22,
            )
            yx, yy, yz = (
                yx * t00 + yy * t01 - yz * t02,
                yx * t01 + yy * t11 - yz * t12,
                yx * t02 + yy * t12 + yz * t22,
            )
            zx, zy, zz = (
                zx * t00 + zy * t01 - zz * t02,
                zx * t01 + zy * t11 - zz * t12,
                zx * t02 + zy * t12 + zz * t22,
            )


# ----------------------------------------------------------------------------------------------------
# Arcs from tensions. The static model CC itself is `robots.continuum.constant_curvature`, which carries
# loads, friction, springs and more; `poses` is its closed form for tensions alone.


def bend_per_tension(rod: RodProblem) -> Array:
    """Return each subsegment's unknowns (bend toward +x, +y, twist) per tension, shape (t, n, 3) [rad/N]."""
    runs = np.arange(len(rod.length_m)) < rod.last_disk[:, None]
    bent = runs[:, :, None] * middles(rod) * (rod.length_m / rod.bending_N_m2)[:, None]
    bent[:, rod.planar, 1] = 0.0
    return np.concatenate([bent, np.zeros((*runs.shape, 1))], axis=2)


def poses(rod: RodProblem, per_tension: Array, tension_N: Array) -> tuple[Array, Array]:
    """Return CC's disks 0 to n under tensions alone.

    Args:
        rod: the robot; its friction is not read.
        per_tension: `bend_per_tension` of it.
        tension_N: shape (t,) or, for rows, (r, t) [N].

    Returns:
        Positions, shape (n + 1, 3) [m], and orientations, shape (n + 1, 3, 3); of rows (r, ...).
    """
    shape = (*tension_N.shape[:-1], per_tension.shape[1] + 1, 3)
    rows = tension_N.reshape(-1, tension_N.shape[-1])
    p_w, R_w = np.empty((len(rows), *shape[-2:])), np.empty((len(rows), *shape[-2:], 3))
    disks_on_arcs(per_tension, rows, rod.length_m, p_w, R_w)
    return p_w.reshape(shape), R_w.reshape((*shape, 3))
