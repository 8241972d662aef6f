"""The exposed tube of a prismatic segment: its unloaded arc, and its law as a beam.

Between the end of what guides it and the module that it carries, an advance s shows s of tube.
Unloaded it is an arc of that length and of the segment's tube curvature.

Law. Seen from its chord the tube turns at its two ends: by alpha from the guide to the chord, by beta
from the chord to the module, vectors toward +x and +y. With the whole bend b = alpha + beta and the
skew d = alpha - beta, an Euler-Bernoulli beam of bending stiffness EI with curvature k at rest has

    energy  EI / (2 s) (|b - k s|^2 + 3 |d|^2)
    chord   s (sin(|b| / 2) / (|b| / 2) - |d|^2 / 40)

In a plane the first is the moments EI / s (4 alpha - 2 beta) and EI / s (4 beta - 2 alpha), exact for small
bends under any force and moment at the end. The second is exact for arcs and right to second order
else; its slopes let an axial load bend the tube.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from catheter_sim.arrays import Array
from catheter_sim.kinds.catheter.spec import CatheterSegment
from catheter_sim.mechanics.arcs import arc_end, arc_functions

SKEW_STIFFNESS = 3.0  # against skew, over that against the whole bend
SKEW_SHORTENING = 1.0 / 40.0  # of the length, per squared skew
SMALL_RAD = 1e-3  # [rad] below it a series is exact to the last bit but one


def tube_bend(segment: CatheterSegment) -> tuple[Array, float]:
    """Return the axis, shape (3,), about which a curved tube bends, and its curvature [1/m], above 0."""
    x, y = segment.tube_curvature_x_per_m, segment.tube_curvature_y_per_m
    size = math.hypot(x, y)
    return np.array([-y, x, 0.0]) / size, size


def tube_end(segment: CatheterSegment, advance_m: ArrayLike) -> tuple[Array, Array]:
    """Return where the unloaded tube ends, in the frame of the guide's end.

    Args:
        segment: a prismatic one.
        advance_m: shape (...).

    Returns:
        Position, shape (..., 3) [m], and orientation, shape (..., 3, 3).
    """
    advance = np.asarray(advance_m, dtype=float)
    curvature = np.array([segment.tube_curvature_x_per_m, segment.tube_curvature_y_per_m])
    return arc_end(curvature * advance[..., None], advance)


def tube_chord_change(advance_m: Array, curvature_per_m: Array) -> tuple[Array, Array]:
    """Return chord less length of an arc, and its slope in the length; shapes broadcast.

    Returns:
        Change [m], and change per meter, 1.
    """
    half = 0.5 * curvature_per_m * advance_m
    sine, _ = arc_functions(half * half)
    return advance_m * (sine - 1.0), np.cos(half) - 1.0


def end_turn(x_rad: float, y_rad: float) -> tuple[tuple[float, float], tuple[float, float, float, float]]:
    """Return how far a universal joint, a hinge toward +x and then one toward +y, turns its axis.

    Returns:
        The turn as a vector toward +x and +y [rad], and its slopes: of the first component in x and y,
        then of the second.
    """
    sx, cx, sy, cy = math.sin(x_rad), math.cos(x_rad), math.sin(y_rad), math.cos(y_rad)
    across_x, across_y = sx * cy, sy
    sine = math.hypot(across_x, across_y)
    angle = math.atan2(sine, cx * cy)
    if angle < SMALL_RAD:
        ratio, slope = 1.0 + angle * angle / 6.0, 1.0 / 3.0
    else:
        ratio, slope = angle / sine, (sine - angle * cx * cy) / sine**3
    by_x, by_y = slope * sx * cy, slope * cx * sy
    return (ratio * across_x, ratio * across_y), (
        ratio * cx * cy + across_x * by_x,
        -ratio * sx * sy + across_x * by_y,
        across_y * by_x,
        ratio * cy + across_y * by_y,
    )


def end_twist_rad(x_rad: float, y_rad: float) -> float:
    """Return by how much the same universal joint twists about the turned axis [rad]."""
    return 2.0 * math.atan(math.tan(0.5 * x_rad) * math.tan(0.5 * y_rad))


def chord_share(bend_rad: float, skew_rad: float) -> tuple[float, float, float]:
    """Return chord over length at sizes of bend and skew, and its slopes in each, over bend and over skew."""
    half = 0.5 * bend_rad
    if half < SMALL_RAD:
        share, slope = 1.0 - half * half / 6.0, -1.0 / 12.0
    else:
        share, slope = math.sin(half) / half, (half * math.cos(half) - math.sin(half)) / (4.0 * half**3)
    return share - SKEW_SHORTENING * skew_rad**2, slope, -2.0 * SKEW_SHORTENING
