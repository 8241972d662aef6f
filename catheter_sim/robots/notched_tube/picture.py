"""What a notched tube looks like: rings and strips of wall, what is drawn, and its axis."""

from __future__ import annotations

import math
from collections.abc import Mapping

import mujoco
import numpy as np
import trimesh

from catheter_sim.arrays import Array
from catheter_sim.mjcf.parts import Part
from catheter_sim.mjcf.solids import FIXED, NITI, circle, prism
from catheter_sim.robots.notched_tube.description import notches
from catheter_sim.robots.notched_tube.section import half_angle
from catheter_sim.robots.notched_tube.spec import NotchedSegment, NotchedTubeRobot

# ----------------------------------------------------------------------------------------------------
# What a notched tube looks like: rings of uncut tube, and in each notch the strip of wall that is left.
#
# In metres, in the frame of a link: origin on the tube's axis at the upper edge of its notch, +z toward the
# tip. Link 0 is the fixed base, its top at z = 0. Each link shows the half of a strip that is next to it.

TUBE_PREFIX, STRIP_PREFIX, STUB_PREFIX = "tube", "strip", "stub"
_SECTIONS = 32
_ARC_SECTIONS = 12
_BASE_LENGTH = 4.0  # over the outer radius
_WHOLE = 1e-6  # of half a turn: a cut that takes less is not drawn


def tube_meshes(robot: NotchedTubeRobot) -> dict[str, trimesh.Trimesh]:
    """Return every mesh that `tube_parts` names."""
    first, row = robot.segments[0], notches(robot)
    meshes = {"tube.base": _ring(first, -_BASE_LENGTH * first.outer_radius_m, 0.0)}
    for segment in robot.segments:
        half = 0.5 * segment.notch_height_m
        outline, holes = _strip(segment)
        meshes[f"strip_{segment.name}"] = prism(outline, holes, -half, 0.0)
        meshes[f"tube_{segment.name}"] = _ring(segment, 0.0, segment.spacing_m)
    meshes["tube.tip"] = _ring(row[-1].segment, 0.0, row[-1].uncut_m)
    return meshes


def tube_parts(robot: NotchedTubeRobot, element: int) -> tuple[Part, ...]:
    """Return what a link shows: 0 for the fixed base, 1 to n for the links from base to tip."""
    row = notches(robot)
    parts = []
    if element == 0:
        parts.append(Part("tube.base", TUBE_PREFIX, 0.0, 0.0, FIXED, "metal", True))
    else:
        notch = row[element - 1]
        key = "tube.tip" if element == len(row) else f"tube_{notch.segment.name}"
        parts.append(Part(key, TUBE_PREFIX, 0.0, 0.0, NITI, "metal", True))
        parts.append(Part(f"strip_{notch.segment.name}", STRIP_PREFIX, 0.0, 0.0, NITI, "metal", False))
    if element < len(row):  # the lower half of the next notch's strip
        after = row[element].segment
        top = (row[element - 1].uncut_m if element else 0.0) + 0.5 * after.notch_height_m
        parts.append(Part(f"strip_{after.name}", STUB_PREFIX, top, 0.0, NITI, "metal", False))
    return tuple(parts)


def base_bottom_m(robot: NotchedTubeRobot) -> float:
    """Return the height of the drawn base's lower end [m]."""
    return -_BASE_LENGTH * robot.segments[0].outer_radius_m


def tendon_width(robot: NotchedTubeRobot) -> float:
    """Return the drawn radius of the tendon [m]."""
    return 0.1 * min(segment.outer_radius_m for segment in robot.segments)


def _ring(segment: NotchedSegment, z_from: float, z_to: float) -> trimesh.Trimesh:
    outer = circle(segment.outer_radius_m, _SECTIONS)
    return prism(outer, [circle(segment.inner_radius_m, _SECTIONS)], z_from, z_to)


def _strip(segment: NotchedSegment) -> tuple[np.ndarray, list[np.ndarray]]:
    """Return outline and holes of what a notch leaves of the wall."""
    outer, inner = segment.outer_radius_m, segment.inner_radius_m
    wide, narrow = half_angle(segment, outer), half_angle(segment, inner)
    whole = math.pi * (1.0 - _WHOLE)
    arc = circle(outer, _SECTIONS) if wide >= whole else _arc(outer, wide)
    if narrow >= whole:
        return arc, [circle(inner * (1.0 - _WHOLE), _SECTIONS)]
    if narrow <= math.pi * _WHOLE:
        return arc, []
    return np.concatenate([arc, _arc(inner, narrow)[::-1]]), []


def _arc(radius: float, half: float) -> np.ndarray:
    """Return points of an arc about -x, counter-clockwise, shape (n, 2)."""
    angle = math.pi + np.linspace(-half, half, _ARC_SECTIONS + 1)
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


# ----------------------------------------------------------------------------------------------------
# What is drawn of a notched tube, and which parts lie about its axis.

CENTRELINE_PARTS: tuple[str, ...] = (TUBE_PREFIX,)


def meshes(robot: NotchedTubeRobot) -> Mapping[str, trimesh.Trimesh]:
    """Return every mesh that `parts` names, by its name."""
    return tube_meshes(robot)


def parts(robot: NotchedTubeRobot, element: int) -> tuple[Part, ...]:
    """Return what a link shows: 0 for the fixed base, 1 to n for the links from base to tip."""
    return tube_parts(robot, element)


def geom_places(robot: NotchedTubeRobot, model: mujoco.MjModel) -> Array:
    """Return where the model's geoms stand in their bodies, shape (ngeom, 3) [m]."""
    return model.geom_pos.copy()
