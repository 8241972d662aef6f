"""What is drawn of a catheter, and where its centreline is.

Its rings and modules are round about its axis; its exposed tube is no geom, and not looked at.
"""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np
import trimesh

from catheter_sim.arrays import Array
from catheter_sim.core.posture import Posture
from catheter_sim.kinds.catheter.layout import elements, hinge_counts, turning
from catheter_sim.kinds.catheter.mjcf.visuals import (
    BASE_PREFIX,
    MODULE_PREFIX,
    RING_PREFIX,
    base_bottom_m,
    body_meshes,
    body_parts,
    solid_length,
)
from catheter_sim.kinds.catheter.spec import CatheterRobot
from catheter_sim.mechanics.arcs import arc_end
from catheter_sim.mjcf.parts import Part

CENTRELINE_PARTS: tuple[str, ...] = (RING_PREFIX, MODULE_PREFIX, BASE_PREFIX)
_ARC_POINTS = 40  # on a bending joint


def meshes(robot: CatheterRobot) -> Mapping[str, trimesh.Trimesh]:
    """Return every mesh that `parts` names, by its name."""
    return body_meshes(robot)


def parts(robot: CatheterRobot, element: int) -> tuple[Part, ...]:
    """Return what a body shows: 0 for what carries the base, then the pieces from base to tip."""
    return body_parts(robot, element)


def centreline(robot: CatheterRobot, posture: Posture) -> Array:
    """Return the straight pieces' ends and points on the bending joints' arcs, shape (n, 3) [m].

    The axis ends where what is drawn of the last module does: a holder that houses its implant is
    drawn shorter than it is long.
    """
    last_face = {part.segment: number for number, part in enumerate(elements(robot))}
    bends = dict(zip((item.name for item in turning(robot)), _bends(robot, posture), strict=True))
    place, R = np.zeros(3), np.eye(3)
    points = [np.array([0.0, 0.0, base_bottom_m(robot)]), place]
    for index, segment in enumerate(robot.segments):
        if segment.joint == "bending":
            bend = np.zeros(2)
            bend["xy".index(segment.bends_toward)] = bends[segment.name]
            shares = np.arange(1, _ARC_POINTS + 1) / _ARC_POINTS
            steps, turns = arc_end(shares[:, np.newaxis] * bend, shares * segment.length_m)
            points += [place + R @ step for step in steps]
            place, R = points[-1], R @ turns[-1]
            continue
        place, R = posture.p_w[last_face[index]], posture.R_w[last_face[index]]
        points.append(place)
    hidden = robot.segments[-1].length_m - solid_length(robot, len(robot.segments) - 1)
    if robot.segments[-1].joint != "bending":
        points[-1] = place - hidden * R[:, 2]
    return np.array(points)


def geom_places(robot: CatheterRobot, model: mujoco.MjModel) -> Array:
    """Return where the model's geoms stand in their bodies, shape (ngeom, 3) [m]."""
    return model.geom_pos.copy()


def _bends(robot: CatheterRobot, posture: Posture) -> list[float]:
    """Return the angles of the joints that have one, base to tip [rad]."""
    ends = np.cumsum(hinge_counts(robot))[:-1]
    return [float(part.sum()) for part in np.split(posture.joint_angles, ends)]
