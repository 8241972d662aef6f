"""Plain and printed forms of a catheter's equations."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from catheter_sim.arrays import Array
from catheter_sim.mechanics.arcs import arc_end
from catheter_sim.robots.catheter.description import elements, moving
from catheter_sim.robots.catheter.kinematics import exponential, four_dof_lengths_m, four_dof_tool, turn
from catheter_sim.robots.catheter.measured import (
    Side,
    StretchingJoint,
    TorsionCalibration,
    bent_to,
    plateau_branch,
)
from catheter_sim.robots.catheter.spec import CatheterRobot, CatheterSegment

_Z = np.array([0.0, 0.0, 1.0])


def tube_end(segment: CatheterSegment, advance_m: ArrayLike) -> tuple[Array, Array]:
    """Return where a prismatic segment's unloaded tube ends at advances (...) [m], in its guide's end frame.

    Position, shape (..., 3) [m], and orientation, shape (..., 3, 3).
    """
    advance = np.asarray(advance_m, dtype=float)
    curvature = np.array([segment.tube_curvature_x_per_m, segment.tube_curvature_y_per_m])
    return arc_end(curvature * advance[..., None], advance)


def element_frames(robot: CatheterRobot, q: Array) -> tuple[Array, Array]:
    """Return the distal faces of the elements, base to tip, at joint values (..., m).

    Centres, shape (..., n, 3) [m], and orientations, shape (..., n, 3, 3); the last is the tool's.
    """
    shape = q.shape[:-1]
    place = np.zeros((*shape, 3))
    rotation = np.broadcast_to(np.eye(3), (*shape, 3, 3))
    value = dict(zip(moving(robot), np.moveaxis(q, -1, 0), strict=True))
    found: list[tuple[Array, Array]] = []
    parts = elements(robot)
    for index, segment in enumerate(robot.segments):
        faces = [part.face_m for part in parts if part.segment == index]
        if segment.joint == "bending":
            axis = "xy".index(segment.bends_toward)
            bend = np.zeros((*shape, 2))
            bend[..., axis] = value[index]
            for face in [*faces, segment.length_m]:
                step, turned = arc_end(bend * (face / segment.length_m), np.full(shape, face))
                found.append((place + (rotation @ step[..., None])[..., 0], rotation @ turned))
            place, rotation = found.pop()
            continue
        if segment.joint == "torsion":
            rotation = rotation @ exponential(turn(_Z, np.zeros(3)), value[index])[..., :3, :3]
        if segment.joint == "prismatic":
            step, turned = tube_end(segment, value[index])
            place, rotation = place + (rotation @ step[..., None])[..., 0], rotation @ turned
        place = place + rotation[..., 2] * segment.length_m
        found.append((place, rotation))
    places, rotations = zip(*found, strict=True)
    return np.stack(places, axis=-2), np.stack(rotations, axis=-3)


def four_dof_tool_as_printed(robot: CatheterRobot, q: Array) -> tuple[Array, Array]:
    """Return Eqs 6-7 of Nayar 2023 as printed; arguments and result as of `four_dof_tool`.

    The third row of R is not of unit length, and p_y neither points where R does nor stays finite at
    theta_pb = 0. For comparison only.
    """
    pb, db, advance, t = np.moveaxis(q, -1, 0)
    cp, sp, cd, sd, ct, st = np.cos(pb), np.sin(pb), np.cos(db), np.sin(db), np.cos(t), np.sin(t)
    position, R = four_dof_tool(robot, q)
    R, position = R.copy(), position.copy()
    R[..., 2, 1] = ct * sp - sd * cp * st
    proximal_m, middle_m, distal_m, end_m = four_dof_lengths_m(robot)
    end = end_m + advance
    position[..., 1] = sp * (middle_m + cd * end) + distal_m * sd * sp / db - proximal_m * (1.0 + cp) / pb
    return position, R


def torsion_as_printed_rad(
    segment: CatheterSegment, displacement_m: Array, calibration: TorsionCalibration
) -> Array:
    """Return the torsion along displacements of 0 or more, shape (r,) [rad] (Eqs 26-28).

    The first row counts as loading. At rest Eq. 28 gives s = 1/2, halfway between the branches; and a
    turn below the upper plateau jumps from one branch to the other. `measured.torsion_rad` does neither.
    """
    change = np.diff(displacement_m, prepend=displacement_m[0] - 1.0)
    s = 0.5 * (np.sign(change) + 1.0)
    return plateau_branch(segment, displacement_m - calibration.width_m * s, calibration)


def displacement_for_angles_m(joint: StretchingJoint, angle_rad: Array) -> Array:
    """Return the displacements that bend a joint along `angle_rad`, from new tendons, shape (r,) [m]."""
    sides = [Side(), Side()]
    result = np.empty(len(angle_rad))
    pulled = 0  # the side that bends, or bent last
    for row, angle in enumerate(np.degrees(angle_rad)):
        if angle != 0.0:
            pulled = 0 if angle > 0.0 else 1
        ways = []
        for index, sign in enumerate((1.0, -1.0)):
            sides[index], way = bent_to(joint, sides[index], max(sign * float(angle), 0.0))
            ways.append(sign * way)
        result[row] = ways[pulled]
    return result
