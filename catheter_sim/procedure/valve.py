"""The two leaflets: middle scallops that give way, and what lies beside them, only to be seen.

A scallop is two plates on hinges along the coaptation line: one from the annulus down to the coaptation,
and the free margin, which hangs below it against that of the other leaflet.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import trimesh

from catheter_sim.arrays import Array
from catheter_sim.mjcf.solids import together
from catheter_sim.procedure.anatomy import LEAFLET_M, Anatomy, coaptation_axes

SIDES = {"septal": 1.0, "lateral": -1.0}  # of the coaptation line
SCALLOP_M = 12e-3  # width of the scallops that the clip takes; assumed
_POINTS = 12


@dataclass(frozen=True)
class Plate:
    """A rigid plate of a leaflet, closed valve.

    Attributes:
        hinge: middle of its hinge line, shape (3,) [m].
        R: its axes as columns: across the leaflet away from the hinge, along the coaptation line, the
            normal; shape (3, 3).
        length_m, width_m, thickness_m: along these axes.
    """

    hinge: Array
    R: Array
    length_m: float
    width_m: float
    thickness_m: float


def scallop(anatomy: Anatomy, side: float) -> tuple[Plate, Plate]:
    """Return the plate from the annulus and the free margin of the leaflet on the side +1 or -1."""
    along, across = coaptation_axes(anatomy)
    outward = side * across
    middle = 0.5 * LEAFLET_M * outward  # the two margins touch
    edge = outward * anatomy.annulus_across_m
    fold = middle - (0.0, 0.0, anatomy.coaptation_depth_m)
    return (
        _plate(edge, fold, along),
        _plate(fold, fold - (0.0, 0.0, anatomy.coaptation_length_m), along),
    )


def free_edge_z_m(anatomy: Anatomy) -> float:
    """Return the height of the leaflets' free edges in the closed valve, below the annulus: < 0 [m]."""
    return -anatomy.coaptation_depth_m - anatomy.coaptation_length_m


def pushed_edge_z_m(anatomy: Anatomy, radius_m: float) -> float:
    """Return how low the free edges reach when a round rod of this radius stands between the leaflets [m].

    It pushes the margins aside; the plates from the annulus, of fixed length, turn down by that.
    """
    first, margin = scallop(anatomy, 1.0)
    reach = anatomy.annulus_across_m - radius_m - 0.5 * LEAFLET_M
    return -math.sqrt(max(first.length_m**2 - reach**2, 0.0)) - margin.length_m


def beside(anatomy: Anatomy, side: float) -> list[trimesh.Trimesh]:
    """Return the parts of a leaflet on both sides of its middle scallop, closed meshes."""
    along, across = coaptation_axes(anatomy)
    parts = []
    for end in (1.0, -1.0):
        u = np.linspace(0.5 * SCALLOP_M, 0.97 * anatomy.annulus_along_m, _POINTS)
        height = 1.0 - (u / anatomy.annulus_along_m) ** 2
        upper = end * u[:, None] * along + side * anatomy.annulus_across_m * np.sqrt(height)[:, None] * across
        lower = end * u[:, None] * along  # on the coaptation line
        lower[:, 2] -= anatomy.coaptation_depth_m * height
        parts.append(_thick(upper, lower))
    return parts


def leaflet(anatomy: Anatomy, side: float) -> trimesh.Trimesh:
    """Return a leaflet of the closed valve as one mesh of closed parts."""
    plates = [_box(plate) for plate in scallop(anatomy, side)]
    return together([*plates, *beside(anatomy, side)])


def _plate(hinge: Array, end: Array, along: Array) -> Plate:
    way = end - hinge
    length = float(np.linalg.norm(way))
    first = way / length
    R = np.stack([first, along, np.cross(first, along)], axis=1)
    return Plate(hinge, R, length, SCALLOP_M, LEAFLET_M)


def _box(plate: Plate) -> trimesh.Trimesh:
    pose = np.eye(4)
    pose[:3, :3] = plate.R
    pose[:3, 3] = plate.hinge + 0.5 * plate.length_m * plate.R[:, 0]
    return trimesh.creation.box((plate.length_m, plate.width_m, plate.thickness_m), pose)


def _thick(upper: Array, lower: Array) -> trimesh.Trimesh:
    """Return the closed solid between two rows of points, as thick as a leaflet along z."""
    down = np.array([0.0, 0.0, LEAFLET_M])
    corners = np.stack([upper + 0.5 * down, lower + 0.5 * down, lower - 0.5 * down, upper - 0.5 * down], 1)
    vertices = corners.reshape(-1, 3)
    faces = []
    for step in range(len(upper) - 1):
        for k in range(4):
            a, b = 4 * step + k, 4 * step + (k + 1) % 4
            faces += [(a, b, b + 4), (a, b + 4, a + 4)]
    last = 4 * (len(upper) - 1)
    faces += [(0, 2, 1), (0, 3, 2), (last, last + 1, last + 2), (last, last + 2, last + 3)]
    mesh = trimesh.Trimesh(vertices, np.array(faces), process=False)
    if mesh.volume < 0.0:
        mesh.invert()
    return mesh
