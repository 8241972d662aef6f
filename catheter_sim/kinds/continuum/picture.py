"""What is drawn of a continuum robot, and where its centreline is: its backbone's."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np
import trimesh

from catheter_sim.arrays import Array
from catheter_sim.core.posture import Posture
from catheter_sim.kinds.continuum.mjcf.meshes import element_meshes, element_parts
from catheter_sim.kinds.continuum.spec import ContinuumRobot
from catheter_sim.mjcf.parts import Part

CENTRELINE_PARTS: tuple[str, ...] = ("backbone",)
_POINTS = 4  # interpolated points between two faces


def meshes(robot: ContinuumRobot) -> Mapping[str, trimesh.Trimesh]:
    """Return every mesh that `parts` names, by its name."""
    return element_meshes(robot)


def parts(robot: ContinuumRobot, element: int) -> tuple[Part, ...]:
    """Return what a link shows: 0 for the fixed base, 1 to n for the links from base to tip."""
    return element_parts(robot, element)


def centreline(robot: ContinuumRobot, posture: Posture) -> Array:
    """Return points on the smooth centreline from the base through the faces' centres, shape (n, 3) [m].

    Cubic between two faces, along their normals there: the centreline of a bent backbone does not
    cut the corner between two disks.
    """
    points = np.concatenate([np.zeros((1, 3)), posture.p_w])
    normals = np.concatenate([[(0.0, 0.0, 1.0)], posture.R_w[:, :, 2]])
    chord = np.linalg.norm(np.diff(points, axis=0), axis=1)[:, np.newaxis]
    pieces = [points[:1]]
    for t in np.arange(1, _POINTS + 1) / _POINTS:
        pieces.append(
            (1.0 + 2.0 * t) * (1.0 - t) ** 2 * points[:-1]
            + t * (1.0 - t) ** 2 * chord * normals[:-1]
            + t**2 * (3.0 - 2.0 * t) * points[1:]
            - t**2 * (1.0 - t) * chord * normals[1:]
        )
    return np.concatenate([pieces[0], np.stack(pieces[1:], axis=1).reshape(-1, 3)])


def geom_places(robot: ContinuumRobot, model: mujoco.MjModel) -> Array:
    """Return where the model's geoms stand in their bodies, shape (ngeom, 3) [m]."""
    return model.geom_pos.copy()
