"""Arcs from tendon lengths and tendon lengths from arcs, in closed form.

Rao et al. 2021 (doi 10.3389/frobt.2020.630245), Sections 4 and 5.2.2. A segment of length l bent by the
vector b (toward +x, toward +y, size theta) holds of a tendon at the hole h

l_t = (l - h . b) sinc, sinc = sin(theta / 2n) / (theta / 2n),

n being the number of its subsegments, between which the tendon is straight (Eqs. 15 and 20); a tendon
held everywhere has n = inf and sinc = 1. The lengths are linear in l sinc and b sinc, which gives the arc
of any number of tendons; for three at 120 degrees these are Eqs. 16-18 and 21-23. Two errata: the
denominator 2C of Eq. 21 should be C, and sin(phi) in Eq. 23 should be cos(phi).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array


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
