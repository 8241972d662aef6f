"""What is drawn of a notched tube, and where its centreline is: the axis of its uncut pieces."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np
import trimesh

from catheter_sim.arrays import Array
from catheter_sim.core.posture import Posture
from catheter_sim.kinds.notched_tube.layout import notches
from catheter_sim.kinds.notched_tube.mjcf.pieces import TUBE_PREFIX, base_bottom_m, tube_meshes, tube_parts
from catheter_sim.kinds.notched_tube.spec import NotchedTubeRobot
from catheter_sim.mjcf.parts import Part

CENTRELINE_PARTS: tuple[str, ...] = (TUBE_PREFIX,)


def meshes(robot: NotchedTubeRobot) -> Mapping[str, trimesh.Trimesh]:
    """Return every mesh that `parts` names, by its name."""
    return tube_meshes(robot)


def parts(robot: NotchedTubeRobot, element: int) -> tuple[Part, ...]:
    """Return what a link shows: 0 for the fixed base, 1 to n for the links from base to tip."""
    return tube_parts(robot, element)


def centreline(robot: NotchedTubeRobot, posture: Posture) -> Array:
    """Return the axes of the base and of all uncut pieces, one after another, shape (2 n + 2, 3) [m]."""
    uncut = np.array([[notch.uncut_m] for notch in notches(robot)])
    begin = posture.p_w - uncut * posture.R_w[:, :, 2]
    base = np.array([(0.0, 0.0, base_bottom_m(robot)), (0.0, 0.0, 0.0)])
    return np.concatenate([base, np.stack([begin, posture.p_w], axis=1).reshape(-1, 3)])


def geom_places(robot: NotchedTubeRobot, model: mujoco.MjModel) -> Array:
    """Return where the model's geoms stand in their bodies, shape (ngeom, 3) [m]."""
    return model.geom_pos.copy()
