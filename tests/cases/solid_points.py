"""Where a closed mesh is solid, and points spread over its surface."""

from __future__ import annotations

import math

import numpy as np
import trimesh
from numpy.typing import NDArray

Array = NDArray[np.float64]


def winding_number(mesh: trimesh.Trimesh, points: Array) -> Array:
    """Return how often the closed mesh surrounds each point: 0 outside (solid angle over 4 pi)."""
    a, b, c = (mesh.triangles[:, corner] - points[:, np.newaxis] for corner in range(3))
    la, lb, lc = (np.linalg.norm(edge, axis=2) for edge in (a, b, c))
    numerator = np.einsum("pti,pti->pt", a, np.cross(b, c))
    denominator = (
        la * lb * lc
        + np.einsum("pti,pti->pt", a, b) * lc
        + np.einsum("pti,pti->pt", b, c) * la
        + np.einsum("pti,pti->pt", c, a) * lb
    )
    return np.arctan2(numerator, denominator).sum(axis=1) / (2.0 * math.pi)


def surface(mesh: trimesh.Trimesh) -> Array:
    """Return points spread over the surface: corners, edges and middles of the triangles."""
    corner = mesh.triangles
    shares = np.array([(i, j, 3 - i - j) for i in range(4) for j in range(4 - i)]) / 3.0
    return np.einsum("sk,tki->tsi", shares, corner).reshape(-1, 3)
