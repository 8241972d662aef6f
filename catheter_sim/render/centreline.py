"""The centreline that an analytic posture promises, and what of the drawn robot must show it.

A continuum robot has a backbone, and its geoms `backbone_<i>` are looked at. A robot of rolling joints
has none: its links are round about its axis, so the middle of the links' own pixels is the axis. No
geom is made for the check; what is looked at is what a user sees. In a joint's gap pixels are missing
on one side, which moves the middle there a little: a tenth of a pixel or two at 640 x 480. A catheter's
rings and modules are round about its axis too; its exposed tube is no geom, and not looked at.
"""

from __future__ import annotations

import numpy as np

from catheter_sim.mjcf.catheter_visuals import BASE_PREFIX as CATHETER_BASE_PREFIX
from catheter_sim.mjcf.catheter_visuals import MODULE_PREFIX, RING_PREFIX, solid_length
from catheter_sim.mjcf.catheter_visuals import base_bottom_m as catheter_bottom_m
from catheter_sim.mjcf.rolling_links import BASE_PREFIX, LINK_PREFIX, base_bottom_m
from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.catheter_layout import elements, hinge_counts, turning
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.posture import Array, Posture
from catheter_sim.robots.rolling import RollingRobot
from catheter_sim.statics.arcs import arc_end

_POINTS = 4  # interpolated points between two faces
_ARC_POINTS = 40  # on a bending joint of a catheter


def shows_centreline(robot: Robot, geom: str) -> bool:
    """Return whether the geom of this name is one whose pixels' middle is the robot's centreline."""
    prefixes: tuple[str, ...] = ("backbone",)
    if isinstance(robot, RollingRobot):
        prefixes = (LINK_PREFIX, BASE_PREFIX)
    elif isinstance(robot, CatheterRobot):
        prefixes = (RING_PREFIX, MODULE_PREFIX, CATHETER_BASE_PREFIX)
    return geom.startswith(tuple(f"{prefix}_" for prefix in prefixes))


def centreline(robot: Robot, posture: Posture) -> Array:
    """Return points on the centreline from the robot's base to its tip, shape (n, 3) [m]."""
    if isinstance(robot, RollingRobot):
        return links_axis(robot, posture)
    if isinstance(robot, CatheterRobot):
        return catheter_axis(robot, posture)
    return backbone_curve(posture)


def catheter_axis(robot: CatheterRobot, posture: Posture) -> Array:
    """Return the straight pieces' ends and points on the bending joints' arcs, shape (n, 3) [m].

    The axis ends where what is drawn of the last module does: a holder that houses its implant is
    drawn shorter than it is long.
    """
    last_face = {part.segment: number for number, part in enumerate(elements(robot))}
    bends = dict(zip((item.name for item in turning(robot)), _bends(robot, posture), strict=True))
    place, R = np.zeros(3), np.eye(3)
    points = [np.array([0.0, 0.0, catheter_bottom_m(robot)]), place]
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


def _bends(robot: CatheterRobot, posture: Posture) -> list[float]:
    """Return the angles of the joints that have one, base to tip [rad]."""
    ends = np.cumsum(hinge_counts(robot))[:-1]
    return [float(part.sum()) for part in np.split(posture.joint_angles, ends)]


def links_axis(robot: RollingRobot, posture: Posture) -> Array:
    """Return the axes of the base piece and of all links, one after another, shape (2 n + 2, 3) [m].

    Links are straight: the axis has a kink, and a step of a fraction of a millimetre, in each joint.
    Each is taken from beside the face below it, whatever its length under load.
    """
    axis = posture.R_w[:, :, 2]
    below = np.concatenate([np.zeros((1, 3)), posture.p_w[:-1]])
    begin = posture.p_w - ((posture.p_w - below) * axis).sum(axis=1, keepdims=True) * axis
    base = np.array([(0.0, 0.0, base_bottom_m(robot)), (0.0, 0.0, 0.0)])
    return np.concatenate([base, np.stack([begin, posture.p_w], axis=1).reshape(-1, 3)])


def backbone_curve(posture: Posture) -> Array:
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
