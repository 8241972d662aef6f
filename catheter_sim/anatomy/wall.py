"""A wall as a closed mesh to be drawn, and as convex pieces to be touched."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh

from catheter_sim.arrays import Array


@dataclass(frozen=True)
class Wall:
    """The wall as a shell.

    Attributes:
        inner, outer: its vertices, shape (n, 3) each [m].
        cells: indices of three or four vertices, counter-clockwise seen from outside.
    """

    inner: Array
    outer: Array
    cells: tuple[tuple[int, ...], ...]


def shell(part: Wall) -> trimesh.Trimesh:
    """Return the wall as one closed mesh, its openings included, its faces outward."""
    count = len(part.inner)
    faces = []
    edges: dict[tuple[int, int], tuple[int, int]] = {}
    for cell in part.cells:
        for k in range(1, len(cell) - 1):
            a, b, c = cell[0], cell[k], cell[k + 1]
            faces += [(a + count, b + count, c + count), (a, c, b)]
        for a, b in zip(cell, (*cell[1:], cell[0]), strict=True):
            if edges.pop((b, a), None) is None:
                edges[a, b] = (a, b)
    for a, b in edges.values():  # rims
        faces += [(a, b, b + count), (a, b + count, a + count)]
    mesh = trimesh.Trimesh(np.concatenate([part.inner, part.outer]), np.array(faces), process=False)
    mesh.remove_unreferenced_vertices()
    return mesh


def blocks(part: Wall) -> list[Array]:
    """Return the corners of every cell's convex block, shape (6 or 8, 3) each [m]."""
    return [np.concatenate([part.inner[list(cell)], part.outer[list(cell)]]) for cell in part.cells]


def facings(part: Wall) -> Array:
    """Return the unit normals of the blocks' inner faces, away from the wall, shape (m, 3)."""
    normals = []
    for cell in part.cells:
        a, b, c, d = part.inner[[cell[0], cell[1], cell[2], cell[-1]]]
        normals.append(-np.cross(c - a, d - b) if len(cell) > 3 else -np.cross(b - a, c - a))
    found = np.array(normals)
    return found / np.linalg.norm(found, axis=1, keepdims=True)
