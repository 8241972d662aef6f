"""Small closed triangle meshes: prisms with holes, boxes, rods. Lengths in metres, axis +z.

Nothing here knows a robot. Vertices and faces follow from the arguments alone, so that a model that is
written twice is the same text twice; outlines are rounded to a nanometre first, for the last bit of a
sine depends on the machine and could decide how a symmetric outline is cut into triangles.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import mapbox_earcut
import numpy as np
import trimesh
from numpy.typing import NDArray

from catheter_sim.arrays import Array


def circle(radius: float, sections: int, centre: tuple[float, float] = (0.0, 0.0)) -> Array:
    """Return `sections` points on a circle, counter-clockwise, shape (sections, 2)."""
    angle = np.arange(sections) * (2.0 * math.pi / sections)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1) * radius + np.asarray(centre)


def prism(outline: Array, holes: Sequence[Array], z_from: float, z_to: float) -> trimesh.Trimesh:
    """Return the closed prism over a polygon with holes.

    Args:
        outline: counter-clockwise, shape (n, 2).
        holes: each counter-clockwise, inside the outline and apart from one another.
        z_from, z_to: where it begins and ends, z_from < z_to.
    """
    rings = [np.asarray(outline), *(np.asarray(hole)[::-1] for hole in holes)]
    ends = np.cumsum([len(ring) for ring in rings])
    flat = np.asarray(np.concatenate(rings), dtype=np.float64).round(9)
    cap = triangles(flat, ends)
    count = len(flat)
    walls = []
    for begin, end in zip([0, *ends[:-1]], ends, strict=True):
        here = np.arange(begin, end)
        after = np.roll(here, -1)
        walls += [np.stack([here, after, after + count], 1), np.stack([here, after + count, here + count], 1)]
    vertices = np.concatenate(
        [np.column_stack([flat, np.full(count, z_from)]), np.column_stack([flat, np.full(count, z_to)])]
    )
    return trimesh.Trimesh(vertices, np.concatenate([cap[:, ::-1], cap + count, *walls]), process=False)


def triangles(flat: Array, ends: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return counter-clockwise triangles over a polygon with holes, shape (m, 3).

    Args:
        flat: corners of the outline and then of the holes, shape (n, 2).
        ends: where each of them ends.
    """
    cap = mapbox_earcut.triangulate_float64(flat, ends.astype(np.uint32)).reshape(-1, 3).astype(np.int64)
    corner = flat[cap]
    first, second = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    clockwise = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0] < 0
    cap[clockwise] = cap[clockwise][:, ::-1]
    return cap


def across_y(profile: Array, y_from: float, y_to: float) -> trimesh.Trimesh:
    """Return the closed prism along y over a counter-clockwise polygon (x, z), shape (n, 2)."""
    mesh = prism(profile, (), -y_to, -y_from)
    x, z, minus_y = mesh.vertices.T
    return trimesh.Trimesh(np.column_stack([x, -minus_y, z]), mesh.faces, process=False)


def box(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> trimesh.Trimesh:
    """Return the box between two values of each coordinate."""
    outline = np.array([(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])])
    return prism(outline, (), *z)


def domed_rod(radius: float, length: float, sections: int) -> trimesh.Trimesh:
    """Return a rod from z = 0 to `length` with half a ball below z = 0, which rounds a kink there."""
    angle = np.linspace(0.0, math.pi / 2.0, 4)[1:]
    profile = [(radius * math.sin(a), -radius * math.cos(a)) for a in angle] + [(radius, length)]
    rings = [np.column_stack([circle(r, sections), np.full(sections, z)]) for r, z in profile]
    south, north = len(rings) * sections, len(rings) * sections + 1
    vertices = np.concatenate([*rings, [(0.0, 0.0, -radius), (0.0, 0.0, length)]])
    here = np.arange(sections)
    after = np.roll(here, -1)
    faces = [np.stack([np.full(sections, south), after, here], 1)]
    for ring in range(len(rings) - 1):
        low, high = ring * sections, (ring + 1) * sections
        faces += [
            np.stack([here + low, after + low, after + high], 1),
            np.stack([here + low, after + high, here + high], 1),
        ]
    last = (len(rings) - 1) * sections
    faces.append(np.stack([here + last, after + last, np.full(sections, north)], 1))
    return trimesh.Trimesh(vertices, np.concatenate(faces), process=False)


def together(solids: Sequence[trimesh.Trimesh]) -> trimesh.Trimesh:
    """Return closed solids as one mesh; they may sink into one another."""
    counts = np.cumsum([0, *(len(solid.vertices) for solid in solids)])
    return trimesh.Trimesh(
        np.concatenate([solid.vertices for solid in solids]),
        np.concatenate([solid.faces + begin for solid, begin in zip(solids, counts, strict=False)]),
        process=False,
    )


def raised(mesh: trimesh.Trimesh, z: float) -> trimesh.Trimesh:
    """Return `mesh` moved by `z` along its axis."""
    return trimesh.Trimesh(mesh.vertices + np.array([0.0, 0.0, z]), mesh.faces, process=False)
