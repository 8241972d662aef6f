"""The static model CC: arcs from tendon lengths and from tensions, in closed form."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.robots.continuum.rods import RodProblem

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
# Arcs from tendon lengths and tendon lengths from arcs, in closed form; arcs from tensions.
#
# Rao et al. 2021 (doi 10.3389/frobt.2020.630245), Sections 4 and 5.2.2. A segment of length l bent by the
# vector b (toward +x, toward +y, size theta) holds of a tendon at the hole h
#
# l_t = (l - h . b) sinc, sinc = sin(theta / 2n) / (theta / 2n),
#
# n being the number of its subsegments, between which the tendon is straight (Eqs. 15 and 20); a tendon
# held everywhere has n = inf and sinc = 1. The lengths are linear in l sinc and b sinc, which gives the arc
# of any number of tendons; for three at 120 degrees these are Eqs. 16-18 and 21-23. Two errata: the
# denominator 2C of Eq. 21 should be C, and sin(phi) in Eq. 23 should be cos(phi).
#
# The static model CC itself is `robots.continuum.constant_curvature`, which carries loads, friction,
# springs and more; `poses` is its closed form for tensions alone.


def tendon_lengths(
    bend: Array, length_m: Array, hole_m: Array, last_segment: NDArray[np.intp], subsegments: Array | float
) -> Array:
    """Return each tendon's length from the base to its end, shape (..., t) [m] (Eqs. 15, 20; Section 4.3).

    Args:
        bend: of each segment, toward +x and +y, shape (..., s, 2) [rad].
        length_m: of the segments' backbones, shape (s,) [m].
        hole_m: (x, y) of the tendons' holes, shape (t, 2) [m].
        last_segment: index of the segment in which each tendon ends, shape (t,).
        subsegments: of each segment, shape (s,); inf: the tendons are held everywhere.
    """
    theta = np.linalg.norm(bend, axis=-1)
    inside = np.asarray(length_m) - np.einsum("ti,...si->...ts", hole_m, bend)
    inside = inside * _straightened(theta, subsegments)[..., None, :]
    runs = np.arange(len(length_m)) <= np.asarray(last_segment)[:, None]
    return np.asarray(np.where(runs, inside, 0.0).sum(axis=-1))


def arc_of_lengths(
    tendon_length_m: Array, hole_m: Array, subsegments: float = math.inf
) -> tuple[Array, Array]:
    """Return bend, shape (..., 2) [rad], and backbone length, shape (...) [m], of one segment.

    Least squares over any number of tendons; where all holes lie in one line through the backbone, the
    bend lies in it too.

    Args:
        tendon_length_m: within the segment, shape (..., m), m >= 2 [m].
        hole_m: shape (m, 2) [m].
        subsegments: n; inf: tendons held everywhere.
    """
    design = np.column_stack([np.ones(len(hole_m)), -hole_m])
    scale = np.array([1.0, 1.0 / np.abs(hole_m).max(), 1.0 / np.abs(hole_m).max()])
    solution = np.asarray(tendon_length_m) @ np.linalg.pinv(design * scale).T * scale
    chord = np.linalg.norm(solution[..., 1:], axis=-1)  # 2 n sin(theta / 2n)
    if math.isinf(subsegments):
        return solution[..., 1:], solution[..., 0]
    theta = 2.0 * subsegments * np.arcsin(chord / (2.0 * subsegments))
    shorter = _straightened(theta, subsegments)
    return solution[..., 1:] / shorter[..., None], solution[..., 0] / shorter


def bends_of_lengths(
    tendon_length_m: Array, hole_m: Array, last_segment: NDArray[np.intp], subsegments: Array
) -> tuple[Array, Array]:
    """Return bends, shape (..., s, 2) [rad], and backbone lengths, shape (..., s) [m], of all segments.

    From the base on: what a tendon holds of the segments before is known when its own is solved.

    Args:
        tendon_length_m: from the base, shape (..., t) [m]; two or more tendons end in each segment.
        hole_m, last_segment: of the tendons, shapes (t, 2) and (t,).
        subsegments: of each segment, shape (s,).
    """
    left = np.array(tendon_length_m, dtype=float)
    bends, lengths = [], []
    for s, count in enumerate(np.asarray(subsegments)):
        own = np.asarray(last_segment) == s
        bend, length = arc_of_lengths(left[..., own], hole_m[own], float(count))
        theta = np.linalg.norm(bend, axis=-1)
        held = (length[..., None] - np.einsum("ti,...i->...t", hole_m, bend)) * _straightened(theta, count)[
            ..., None
        ]
        left = left - held
        bends.append(bend)
        lengths.append(length)
    return np.stack(bends, axis=-2), np.stack(lengths, axis=-1)


def three_tendon_arc(
    tendon_length_m: Array, radius_m: float, subsegments: float = math.inf
) -> tuple[Array, Array, Array]:
    """Return curvature [1/m], bending plane's angle [rad] and backbone length [m], each shape (...).

    Three tendons at 0, 120 and 240 degrees; Eqs. 16-18, and 21-23 with both errata mended. A straight
    segment has curvature zero and the plane at angle zero.

    Args:
        tendon_length_m: within the segment, shape (..., 3) [m].
        radius_m: of the holes about the backbone [m].
        subsegments: n; inf: tendons held everywhere.
    """
    first, second, third = np.moveaxis(np.asarray(tendon_length_m, dtype=float), -1, 0)
    total = first + second + third
    plane = np.arctan2(3.0 * (third - second), math.sqrt(3.0) * (second + third - 2.0 * first))
    size = np.sqrt(
        0.5 * ((first - second) ** 2 + (second - third) ** 2 + (third - first) ** 2)
    )  # C of Eq. 22
    curvature = 2.0 * size / (radius_m * total)
    if math.isinf(subsegments):
        return curvature, plane, total / 3.0
    share = size / (3.0 * subsegments * radius_m)  # sin(theta / 2n)
    # Eq. 21, n r total / C . asin(share), without its 0 / 0 at straight
    length = total / 3.0 / np.sinc(np.arcsin(share) / math.pi)
    return curvature, plane, length


def _straightened(theta: Array, subsegments: Array | float) -> Array:
    """Return by how much chords are shorter than their arcs, sin(theta / 2n) / (theta / 2n)."""
    return np.asarray(np.sinc(np.asarray(theta) / (2.0 * np.asarray(subsegments)) / math.pi))


def bend_per_tension(rod: RodProblem) -> Array:
    """Return each subsegment's unknowns (bend toward +x, +y, twist) per tension, shape (t, n, 3) [rad/N]."""
    runs = np.arange(len(rod.length_m)) < rod.last_disk[:, None]
    bent = runs[:, :, None] * rod.hole_m[:, None, :] * (rod.length_m / rod.bending_N_m2)[:, None]
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
