"""Forward kinematics of any catheter of torsion, bending and prismatic joints: tool, elements, Jacobian.

Joint values q: one for each segment with a joint, base to tip: angle [rad] or advance [m]
(`catheter_layout.moving`). A bending joint is an arc of constant curvature, as a chain: a turn by half
of the bend, a slide by chord less length, a turn by the other half (Nayar 2022, Section II-D, Eq. 20).

A prismatic segment's curved tube is one too, of a length that is its joint value (`tube`).

The rings lie on that arc, at their share of its length. A chain of rigid rings with a hinge in every
gap differs: all its turning lies in the gaps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.catheter.layout import base_heights_m, elements, is_curved, moving
from catheter_sim.kinds.catheter.spec import CatheterRobot
from catheter_sim.kinds.catheter.theory.tube import tube_bend, tube_chord_change, tube_end
from catheter_sim.kinds.catheter.theory.twists import (
    exponential,
    product_of_exponentials,
    slide,
    space_jacobian,
    turn,
)
from catheter_sim.mechanics.arcs import arc_end

_Z = np.array([0.0, 0.0, 1.0])
_BENDS_ABOUT = {"x": np.array([0.0, 1.0, 0.0]), "y": np.array([-1.0, 0.0, 0.0])}
_SMALL = 1e-3  # [rad] half a bend below which a series is exact to the last bit


@dataclass(frozen=True)
class ScrewChain:
    """A catheter as twists.

    Attributes:
        twists: in the straight posture, base to tip, shape (j, 6).
        home: the tool frame there, shape (4, 4).
        joint: index of the joint value behind each twist, shape (j,).
        chord_m: of twists that shorten with a bend: the joint's length at rest; 0 of others, shape (j,).
        share: of its joint value that each of the other twists takes: 1, 1/2, or half of a curved tube's
            curvature [1/m], shape (j,).
        curvature_per_m: of slides along the chord of a curved tube: its curvature; 0 of others, shape (j,).
    """

    twists: Array
    home: Array
    joint: Array
    chord_m: Array
    share: Array
    curvature_per_m: Array


def screw_chain(robot: CatheterRobot) -> ScrewChain:
    """Return `robot` as twists (Nayar 2022, Eqs 8-11, for any row of such joints)."""
    heights = base_heights_m(robot)
    twists: list[Array] = []
    joint: list[int] = []
    chord: list[float] = []
    share: list[float] = []
    curvature: list[float] = []
    for number, index in enumerate(moving(robot)):
        segment = robot.segments[index]
        base = heights[index] * _Z
        if segment.joint == "bending":
            about = _BENDS_ABOUT[segment.bends_toward]
            twists += [turn(about, base), slide(_Z), turn(about, base + segment.length_m * _Z)]
            joint += 3 * [number]
            chord += [0.0, segment.length_m, 0.0]
            share += [0.5, 0.0, 0.5]
            curvature += 3 * [0.0]
        elif is_curved(segment):
            about, bend = tube_bend(segment)
            twists += [turn(about, base), slide(_Z), turn(about, base)]
            joint += 3 * [number]
            chord += 3 * [0.0]
            share += [0.5 * bend, 1.0, 0.5 * bend]
            curvature += [0.0, bend, 0.0]
        else:
            twists.append(turn(_Z, base) if segment.joint == "torsion" else slide(_Z))
            joint.append(number)
            chord.append(0.0)
            share.append(1.0)
            curvature.append(0.0)
    home = np.eye(4)
    home[2, 3] = heights[-1]
    return ScrewChain(
        np.array(twists), home, np.array(joint), np.array(chord), np.array(share), np.array(curvature)
    )


def tool_frame(robot: CatheterRobot, q: Array) -> Array:
    """Return the tool frame by the product of exponentials (Nayar 2022, Eq. 12).

    Args:
        robot: the catheter.
        q: joint values, shape (..., m).

    Returns:
        Shape (..., 4, 4), base frame, SI units.
    """
    chain = screw_chain(robot)
    values, _ = _parameters(chain, q)
    return product_of_exponentials(chain.twists, values, chain.home)


def tool_jacobian(robot: CatheterRobot, q: Array) -> Array:
    """Return d(tip position, tool turn) / dq in the base frame.

    Args:
        robot: the catheter.
        q: joint values, shape (..., m).

    Returns:
        Shape (..., 6, m): rows 0-2 the tip's velocity, rows 3-5 the tool's angular velocity.
    """
    chain = screw_chain(robot)
    values, slopes = _parameters(chain, q)
    columns = space_jacobian(chain.twists, values) * slopes[..., None, :]
    tip = product_of_exponentials(chain.twists, values, chain.home)[..., :3, 3]
    columns[..., :3, :] += np.cross(columns[..., 3:, :], tip[..., None], axis=-2)
    member = (chain.joint[:, None] == np.arange(q.shape[-1])).astype(float)
    return columns @ member


def element_frames(robot: CatheterRobot, q: Array) -> tuple[Array, Array]:
    """Return the distal faces of the elements, base to tip.

    Args:
        robot: the catheter.
        q: joint values, shape (..., m).

    Returns:
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


def chord_change(bend_rad: Array, length_m: Array) -> tuple[Array, Array]:
    """Return chord less length of an arc, and its slope (Nayar 2022, Eq. 20); shapes broadcast.

    Returns:
        Change [m], and change per radian [m/rad].
    """
    half = 0.5 * np.asarray(bend_rad, dtype=float)
    small = np.abs(half) < _SMALL
    safe = np.where(small, 1.0, half)
    change = np.where(small, -(half**2) / 6.0, np.sin(safe) / safe - 1.0)
    slope = np.where(small, -half / 3.0, (safe * np.cos(safe) - np.sin(safe)) / safe**2)
    return length_m * change, 0.5 * length_m * slope


def _parameters(chain: ScrewChain, q: Array) -> tuple[Array, Array]:
    """Return each twist's parameter and its slope in its joint value, both of shape (..., j)."""
    own = q[..., chain.joint]
    change, slope = chord_change(own, chain.chord_m)
    shorter, steeper = tube_chord_change(own, chain.curvature_per_m)
    return chain.share * own + change + shorter, chain.share + slope + steeper
