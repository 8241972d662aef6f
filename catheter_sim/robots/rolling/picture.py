"""What a robot of rolling joints looks like: its links as meshes, what is drawn, its axis."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import mujoco
import numpy as np
import trimesh

from catheter_sim.arrays import Array
from catheter_sim.mjcf.names import face
from catheter_sim.mjcf.parts import Part
from catheter_sim.mjcf.solids import FIXED, Bore, Colour, bored, together
from catheter_sim.robots.rolling.description import (
    RollingJoint,
    hole_position,
    last_joint,
    rods,
    rolling_joints,
)
from catheter_sim.robots.rolling.spec import Rod, RollingRobot, RollingSegment

# ----------------------------------------------------------------------------------------------------
# What the links of a rolling-joint robot look like: the profile that the statics roll on, as meshes.
#
# All are in metres, in the frame of a link: origin on the robot's axis at the height of its joint's line,
# +z toward the tip. The lower face is the joint's two arcs, from the line to where each meets the link's
# round outline; the top is flat. Rod holes lie where the specification has them, wide by rod and clearance
# as far as wall, lumen and neighbours leave room; countersunk ones widen toward the faces. Link 0 is the
# fixed base, in the base frame, with its flat top at z = 0.
#
# Links are translucent, to show the rods. One that gives way along its axis is drawn in two parts that
# slide into one another: its profile (`link_<k>`) and its top (`link_top_<k>`).

LINK_PREFIX = "link"
TOP_PREFIX = f"{LINK_PREFIX}_top"
BASE_PREFIX = "base"

_OUTER_SECTIONS = 32
_LUMEN_SECTIONS = 16
_HOLE_SECTIONS = 8
_STRIPS = 8  # of each arc
_COUNTERSINK = 1.6  # its width at the face over the hole's, where there is room
# Shares of the outer radius: the thinnest wall, and the smallest hole, that are drawn.
_WALL, _VISIBLE = 0.02, 0.02
# Shares of the link's length, for any robot that the checks let pass: how far up the profile and its
# holes' mouths may reach, where the upper mouths begin, and by how much halves of a soft link overlap.
_FACE, _LOWER, _UPPER, _OVERLAP = 0.8, 0.85, 0.9, 0.03
_BASE_LENGTH, _COLLAR_LENGTH, _COLLAR_WIDTH = 1.6, 1.4, 1.35  # over the outer radius

# By segment, and by the side of the larger arc: to tell them apart.
RESIN: tuple[tuple[Colour, Colour], ...] = (
    ((0.55, 0.66, 0.78, 0.42), (0.36, 0.48, 0.62, 0.42)),
    ((0.86, 0.72, 0.52, 0.42), (0.72, 0.57, 0.36, 0.42)),
    ((0.50, 0.72, 0.64, 0.42), (0.34, 0.56, 0.48, 0.42)),
)


@dataclass(frozen=True)
class Hole:
    """A rod's hole as it is drawn.

    Attributes:
        place: x and y [m].
        radius: of its straight part [m].
        face_radius: in the link's faces [m].
        countersink: how far the straight part lies back from them [m].
    """

    place: tuple[float, float]
    radius: float
    face_radius: float
    countersink: float


def arc_height(joint: RollingJoint, u: Array) -> Array:
    """Return the height of a joint's profile above its line at rest [m].

    Beyond an arc's quarter turn there is no profile: it goes on level.

    Args:
        joint: the joint.
        u: place along the bending direction, from the robot's axis [m].
    """
    offset = np.asarray(u) - joint.line_m
    radius = np.where(offset >= 0.0, joint.radius_positive_m, joint.radius_negative_m)
    return radius - np.sqrt(np.maximum(radius**2 - offset**2, 0.0))


def link_meshes(robot: RollingRobot) -> dict[str, trimesh.Trimesh]:
    """Return every mesh that `link_parts` names, by its key: links that are alike share theirs."""
    meshes = {"link.base": _base(robot)}
    for joint in rolling_joints(robot):
        key, length = _mesh_key(joint), joint.link_length_m
        if key in meshes:
            continue
        if _is_soft(joint.segment):
            seam = _seam(robot, joint)
            meshes[key] = _link(robot, joint, seam + _OVERLAP * length)
            meshes[f"{key}.top"] = _block(robot, joint.segment, seam, length)
        else:
            meshes[key] = _link(robot, joint, length)
    return meshes


def link_parts(robot: RollingRobot, index: int) -> tuple[Part, ...]:
    """Return what link `index` shows: 0 for the fixed base, 1 to n for the links from base to tip."""
    if index == 0:
        return (Part("link.base", BASE_PREFIX, 0.0, 0.0, FIXED, "plastic", False),)
    joint = rolling_joints(robot)[index - 1]
    pair = RESIN[robot.segments.index(joint.segment) % len(RESIN)]
    colour = pair[1 if _larger_side(joint) == "n" else 0]
    lower = Part(_mesh_key(joint), LINK_PREFIX, 0.0, 0.0, colour, "plastic", True)
    if not _is_soft(joint.segment):
        return (lower,)
    return lower, replace(lower, mesh_key=f"{_mesh_key(joint)}.top", name_prefix=TOP_PREFIX)


def base_bottom_m(robot: RollingRobot) -> float:
    """Return where the fixed base begins, below its flat top at z = 0 [m]."""
    outer = robot.segments[0].outer_radius_m
    deepest = max((hole.countersink for hole in holes(robot, robot.segments[0])), default=0.0)
    return -_COLLAR_LENGTH * outer - max(_BASE_LENGTH * outer, 4.0 * deepest)


def holes(robot: RollingRobot, segment: RollingSegment) -> tuple[Hole, ...]:
    """Return the holes of a segment's links that can be drawn: one for each rod that passes them.

    A hole is drawn narrower where rod and clearance do not fit, and left out where nothing fits.
    """
    first = next(joint.index for joint in rolling_joints(robot) if joint.segment == segment)
    outer = segment.outer_radius_m
    visible, wall = _VISIBLE * outer, _WALL * outer
    passing: list[tuple[Rod, tuple[float, float]]] = []
    for rod in rods(robot):
        x, y = hole_position(rod, segment)
        place = (float(x), float(y))
        beside = all(math.dist(place, other) > 2.0 * (visible + wall) for _, other in passing)
        if last_joint(robot, rod) >= first and beside:
            passing.append((rod, place))

    def room(place: tuple[float, float], others: list[tuple[tuple[float, float], float]]) -> float:
        """Return how wide a hole may be, given other holes' places and radii."""
        far = math.hypot(*place)
        inside = far - robot.channel_radius_m if robot.channel_radius_m > visible else outer
        around = [math.dist(place, other) - radius for other, radius in others]
        return min(outer - far, inside, *around) - wall

    straight = []
    for rod, place in passing:
        # Neighbours share what lies between them.
        others = [
            (other, 0.5 * math.dist(place, other) - 0.5 * wall) for _, other in passing if other != place
        ]
        straight.append(min(rod.rod_radius_m + robot.clearance_m, room(place, others)))
    result = []
    for (rod, place), radius in zip(passing, straight, strict=True):
        if radius < visible:
            continue
        others = [
            (other, _COUNTERSINK * wide if item.countersink_m > 0 else wide)
            for (item, other), wide in zip(passing, straight, strict=True)
            if other != place
        ]
        widest = max(radius, min(_COUNTERSINK * radius, room(place, others)))
        face = widest if rod.countersink_m > 0 else radius
        result.append(Hole(place, radius, face, rod.countersink_m))
    return tuple(result)


def _mesh_key(joint: RollingJoint) -> str:
    """Return a name that links of one segment share if their profiles lie alike; a segment's has no dot."""
    return f"link_{joint.segment.name}.{'xy'[joint.axis]}{_larger_side(joint)}"


def _larger_side(joint: RollingJoint) -> str:
    """Return "p" or "n", the side of the larger arc or arm, or "" where the profile is symmetric."""
    lean = (joint.radius_positive_m - joint.radius_negative_m, -joint.line_m)
    return "" if lean == (0.0, 0.0) else "p" if lean > (0.0, 0.0) else "n"


def _is_soft(segment: RollingSegment) -> bool:
    return math.isfinite(segment.link_modulus_Pa)


def profile_height(joint: RollingJoint, u: Array) -> Array:
    """Return the height of a link's lower face; as `arc_height` but for links too short to have it."""
    return np.minimum(arc_height(joint, u), _FACE * joint.link_length_m)


def _lower_mouth(joint: RollingJoint, hole: Hole) -> float:
    """Return where the straight part of a hole begins above a link's profile [m]."""
    face = float(profile_height(joint, np.array(hole.place[joint.axis])))
    return min(face + hole.countersink, _LOWER * joint.link_length_m)


def _seam(robot: RollingRobot, joint: RollingJoint) -> float:
    """Return where the top of a soft link begins: a third of the way up its straight part [m]."""
    outer = joint.segment.outer_radius_m
    drawn = holes(robot, joint.segment)
    low = max(
        *profile_height(joint, np.array([-outer, outer])), *(_lower_mouth(joint, hole) for hole in drawn)
    )
    high = joint.link_length_m - max((hole.countersink for hole in drawn), default=0.0)
    return low + (max(high, _UPPER * joint.link_length_m) - low) / 3.0


def _link(robot: RollingRobot, joint: RollingJoint, top: float) -> trimesh.Trimesh:
    """Return a link from its profile up to `top` [m]."""
    segment, length = joint.segment, joint.link_length_m
    outer = segment.outer_radius_m
    cuts = [joint.line_m]
    for radius, sign in ((joint.radius_positive_m, 1.0), (joint.radius_negative_m, -1.0)):
        last = math.asin(min((outer - sign * joint.line_m) / radius, 1.0))
        cuts += [
            joint.line_m + sign * radius * math.sin(last * part / _STRIPS) for part in range(1, _STRIPS + 1)
        ]
    bores = []
    for hole in holes(robot, segment):
        z_from = _lower_mouth(joint, hole)
        z_to = max(length - hole.countersink, _UPPER * length)
        # The lower half of a soft link ends within its top, where nobody sees its mouths.
        bores.append(_bore(hole, z_from, z_to if top == length else 0.5 * (z_from + top)))
    return bored(
        outer,
        _OUTER_SECTIONS,
        bores + _lumen(robot, outer),
        partial(profile_height, joint),
        cuts,
        joint.axis,
        top,
    )


def _block(robot: RollingRobot, segment: RollingSegment, bottom: float, top: float) -> trimesh.Trimesh:
    """Return a straight piece with a segment's holes between two levels, countersunk at its top [m]."""
    middle = 0.5 * (bottom + top)
    bores = [
        _bore(hole, 0.5 * (bottom + middle), max(top - hole.countersink, middle))
        for hole in holes(robot, segment)
    ]
    outer = segment.outer_radius_m
    return bored(outer, _OUTER_SECTIONS, bores + _lumen(robot, outer), partial(_level, bottom), (), 0, top)


def _base(robot: RollingRobot) -> trimesh.Trimesh:
    """Return the fixed piece under the first joint, with a collar that is clamped."""
    segment = robot.segments[0]
    outer = segment.outer_radius_m
    bottom = base_bottom_m(robot)
    top = bottom + _COLLAR_LENGTH * outer
    collar = bored(
        _COLLAR_WIDTH * outer, _OUTER_SECTIONS, _lumen(robot, outer), partial(_level, bottom), (), 0, top
    )
    # Sunk into the collar by a hair.
    return together([_block(robot, segment, top - _WALL * outer, 0.0), collar])


def _level(z: float, u: Array) -> Array:
    return np.full(np.shape(u), z)


def _bore(hole: Hole, z_from: float, z_to: float) -> Bore:
    return Bore(hole.place, hole.radius, hole.face_radius, z_from, z_to, _HOLE_SECTIONS)


def _lumen(robot: RollingRobot, outer: float) -> list[Bore]:
    radius = robot.channel_radius_m
    return [Bore((0.0, 0.0), radius, radius, 0.0, 0.0, _LUMEN_SECTIONS)] if radius > _VISIBLE * outer else []


# ----------------------------------------------------------------------------------------------------
# What is drawn of a robot of rolling joints, and which parts lie about its axis.
#
# It has no backbone: its links are round about its axis.

CENTRELINE_PARTS: tuple[str, ...] = (LINK_PREFIX, BASE_PREFIX)


def meshes(robot: RollingRobot) -> Mapping[str, trimesh.Trimesh]:
    """Return every mesh that `parts` names, by its name."""
    return link_meshes(robot)


def parts(robot: RollingRobot, element: int) -> tuple[Part, ...]:
    """Return what a link shows: 0 for the fixed base, 1 to n for the links from base to tip."""
    return link_parts(robot, element)


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
