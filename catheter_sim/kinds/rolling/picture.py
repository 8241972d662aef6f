"""What is drawn of a robot of rolling joints, and where its centreline is.

It has no backbone: its links are round about its axis, so the middle of the links' own pixels is the axis. In
a joint's gap pixels are missing on one side, which moves the middle there a little: a tenth of a pixel or two
at 640 x 480.
"""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np
import trimesh

from catheter_sim.arrays import Array
from catheter_sim.core.posture import Posture
from catheter_sim.kinds.rolling.layout import rolling_joints
from catheter_sim.kinds.rolling.mjcf.links import (
    BASE_PREFIX,
    LINK_PREFIX,
    TOP_PREFIX,
    base_bottom_m,
    link_meshes,
    link_parts,
)
from catheter_sim.kinds.rolling.spec import RollingRobot
from catheter_sim.mjcf.names import face
from catheter_sim.mjcf.parts import Part

CENTRELINE_PARTS: tuple[str, ...] = (LINK_PREFIX, BASE_PREFIX)


def meshes(robot: RollingRobot) -> Mapping[str, trimesh.Trimesh]:
    """Return every mesh that `parts` names, by its name."""
    return link_meshes(robot)


def parts(robot: RollingRobot, element: int) -> tuple[Part, ...]:
    """Return what a link shows: 0 for the fixed base, 1 to n for the links from base to tip."""
    return link_parts(robot, element)


def centreline(robot: RollingRobot, posture: Posture) -> Array:
    """Return the axes of the base piece and of all links, one after another, shape (2 n + 2, 3) [m].

    Links are straight: the axis has a kink, and a step of a fraction of a millimetre, in each joint.
    Each is taken from beside the face below it, whatever its length under load.
    """
    axis = posture.R_w[:, :, 2]
    below = np.concatenate([np.zeros((1, 3)), posture.p_w[:-1]])
    begin = posture.p_w - ((posture.p_w - below) * axis).sum(axis=1, keepdims=True) * axis
    base = np.array([(0.0, 0.0, base_bottom_m(robot)), (0.0, 0.0, 0.0)])
    return np.concatenate([base, np.stack([begin, posture.p_w], axis=1).reshape(-1, 3)])


def geom_places(robot: RollingRobot, model: mujoco.MjModel) -> Array:
    """Return where the model's geoms stand in their bodies, shape (ngeom, 3) [m].

    Tops of links that give way are where the simulation has moved their faces.
    """
    places: Array = model.geom_pos.copy()
    for joint in rolling_joints(robot):
        top = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, f"{TOP_PREFIX}_{joint.index}")
        if top >= 0:
            site = model.site(face(joint.index)).id
            places[top, 2] += model.site_pos[site, 2] - joint.link_length_m
    return places
