"""The wall of the atrium as a closed mesh and as convex pieces, with its two openings.

The grid runs in rings from the rim of the annulus to the roof. Its vertices near the puncture are moved
onto the rim of the hole, so that the hole is round and not cut along the grid.
"""

from __future__ import annotations

import numpy as np

from catheter_sim.anatomy.wall import Wall
from catheter_sim.arrays import Array
from catheter_sim.procedure.anatomy import WALL_M, Anatomy, centre_m, coaptation_axes, inward, semi_axes_m

AROUND, UPWARD = 36, 15  # cells of the grid
HOLE_RADIUS_M = 5e-3  # of the hole in the septum; assumed: a sheath of 8 mm widens it
_BLENDED = 3  # rings over which the annulus' ellipse goes over into the atrium's


def wall(anatomy: Anatomy, puncture: Array, direction: Array) -> Wall:
    """Return the wall with its holes.

    Args:
        anatomy: the atrium.
        puncture: where the axis of the sheath meets the septum, shape (3,) [m].
        direction: of the sheath, unit vector into the atrium, shape (3,).
    """
    inner, cells = _grid(anatomy)
    inner = _pushed_out(anatomy, inner, puncture, direction)
    kept = []
    for cell in cells:
        corners = inner[list(cell)]
        if _off_axis(corners.mean(axis=0), puncture, direction) > 0.98 * HOLE_RADIUS_M:
            kept.append(cell)
    return Wall(inner, inner - WALL_M * inward(anatomy, inner), tuple(kept))


def _grid(anatomy: Anatomy) -> tuple[Array, list[tuple[int, ...]]]:
    """Return the inner vertices, rings from the annulus upward and the roof's last, and the cells."""
    axes, middle = semi_axes_m(anatomy), centre_m(anatomy)
    around: Array = np.arange(AROUND, dtype=np.float64) * (2.0 * np.pi / AROUND)
    lowest = np.arcsin(-middle[2] / axes[2])
    rings = []
    for ring, latitude in enumerate(np.linspace(lowest, 0.5 * np.pi, UPWARD + 1)[:-1]):
        flat = np.cos(latitude) * np.stack([axes[0] * np.cos(around), axes[1] * np.sin(around)], axis=1)
        share = max(0.0, 1.0 - ring / _BLENDED)
        flat = (1.0 - share) * flat + share * annulus_rim(anatomy, around)[:, :2]
        height = np.full(AROUND, middle[2] + axes[2] * np.sin(latitude))
        rings.append(np.column_stack([flat, height]))
    roof = len(rings) * AROUND
    vertices = np.concatenate([*rings, [(0.0, 0.0, middle[2] + axes[2])]])
    cells: list[tuple[int, ...]] = []
    for ring in range(UPWARD):
        for k in range(AROUND):
            low, after = ring * AROUND + k, ring * AROUND + (k + 1) % AROUND
            if ring == UPWARD - 1:
                cells.append((low, after, roof))
            else:
                cells.append((low, after, after + AROUND, low + AROUND))
    return vertices, cells


def annulus_rim(anatomy: Anatomy, around: Array) -> Array:
    """Return the annulus' points in these directions about +z from +x, shape (n, 3) [m]."""
    along, across = coaptation_axes(anatomy)
    ray = np.stack([np.cos(around), np.sin(around), np.zeros(len(around))], axis=1)
    size = np.hypot(ray @ along / anatomy.annulus_along_m, ray @ across / anatomy.annulus_across_m)
    return ray / size[:, np.newaxis]


def _off_axis(place: Array, puncture: Array, direction: Array) -> float:
    """Return the distance of a point on the septal side from the sheath's axis; inf on the other side [m]."""
    way = place - puncture
    along = float(way @ direction)
    if abs(along) > 4.0 * HOLE_RADIUS_M:
        return np.inf
    return float(np.linalg.norm(way - along * direction))


def _pushed_out(anatomy: Anatomy, vertices: Array, puncture: Array, direction: Array) -> Array:
    """Return the vertices with those inside the hole moved to its rim, on the wall."""
    axes, middle = semi_axes_m(anatomy), centre_m(anatomy)
    moved = vertices.copy()
    for index, vertex in enumerate(vertices):
        distance = _off_axis(vertex, puncture, direction)
        if distance >= HOLE_RADIUS_M:
            continue
        way = vertex - puncture
        aside = way - (way @ direction) * direction
        if distance < 1e-9:
            aside = np.cross(direction, (0.0, 0.0, 1.0))
        start = puncture + aside / np.linalg.norm(aside) * HOLE_RADIUS_M
        # where the line along the sheath through that point meets the ellipsoid, nearest to the septum
        p, d = (start - middle) / axes, direction / axes
        a, b, c = d @ d, p @ d, p @ p - 1.0
        moved[index] = start + (-b - np.sqrt(max(b * b - a * c, 0.0))) / a * direction
    return moved
