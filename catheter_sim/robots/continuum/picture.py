"""What a continuum robot looks like: the solids of its links, what is drawn of it, and its axis."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import mujoco
import numpy as np
import trimesh

from catheter_sim.arrays import Array
from catheter_sim.mjcf.parts import Part
from catheter_sim.mjcf.solids import (
    DISK,
    DISK_NEXT,
    FIXED,
    NITI,
    PEEK,
    PEEK_NEXT,
    across_y,
    box,
    circle,
    domed_rod,
    prism,
    raised,
    together,
)
from catheter_sim.robots.continuum.description import disks, hinge_places, winds_or_converges
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment

# ----------------------------------------------------------------------------------------------------
# The solids of one link: wire guide and backbone cell, or spacer disk and rod.
#
# All are in metres, in the frame of a link: origin at its hinge, +z toward the tip, the hinge axis along y.
# A link is rigid from its own hinge to the next one, one link length above.
#
# Shapes follow the description of Kato 2016, Fig. 1 (doi 10.1007/s11548-015-1310-2): rings with a tool
# channel and eyelets, stacked along a laser-cut tube; a flat-topped (trapezoidal) projection on one face
# touches a curved projection of the neighbour along a line at the bending centre of the flexure. Sizes that
# the paper does not print (wall, flexure, projections) are chosen for the eye; no physics depends on them,
# for masses and stiffnesses are those of the robot's specification.

_OUTER_SECTIONS = 32
_INNER_SECTIONS = 20
_EYELET_SECTIONS = 8
_ARC_SECTIONS = 8  # of a curved projection; even, so that one vertex is the lowest point
_ROD_SECTIONS = 16
# Shares of the cell length: ring face to hinge, rigid tube to hinge, how deep joined solids overlap.
_RING_GAP = 0.22
_TUBE_GAP = 0.25
_OVERLAP = 0.03
# Shares of the outer radius: half widths and arc radius of the projections; the smallest thing drawn.
_FOOT, _FLAT, _ARC = 0.30, 0.15, 0.35
_VISIBLE = 0.02


@dataclass(frozen=True)
class CellShape:
    """The sizes of one link that its meshes need.

    Attributes:
        length: of the link, hinge to hinge [m].
        outer_radius: of the guides or disks [m].
        channel_radius: of the free inner channel; 0: none [m].
        eyelets: (x, y) of the tendon holes [m].
        eyelet_radius: of the holes [m].
        bore_radius: of a guide's hole for the backbone [m].
        tube_radius: outer radius of the backbone [m].
        pivots: whether the guides carry rolling projections.
        two_axes: whether the link bends about x and y.
    """

    length: float
    outer_radius: float
    channel_radius: float
    eyelets: tuple[tuple[float, float], ...]
    eyelet_radius: float
    bore_radius: float
    tube_radius: float
    pivots: bool
    two_axes: bool


def cell_shape(robot: ContinuumRobot, index: int) -> CellShape:
    """Return the sizes of the links of segment `index`; free of tendons that end below it."""
    segment = robot.segments[index]
    names = [item.name for item in robot.segments]
    passing = [item for item in robot.tendons if names.index(item.ends_at) >= index]
    outer = segment.outer_radius_m
    visible = _VISIBLE * outer  # what is smaller than this is left out
    channel = robot.channel_radius_m if robot.channel_radius_m > visible else 0.0
    eyelets: tuple[tuple[float, float], ...] = ()
    for tendon in passing if not winds_or_converges(robot) else ():  # all cells of a segment share a shape
        place = (
            tendon.radius_m * math.cos(tendon.angle_rad),
            tendon.radius_m * math.sin(tendon.angle_rad),
        )
        beside = all(math.dist(place, other) > 6.0 * visible for other in eyelets)
        if beside and tendon.radius_m > channel + 6.0 * visible and outer - tendon.radius_m > 2.0 * visible:
            eyelets += (place,)
    innermost = min((math.hypot(*place) for place in eyelets), default=outer)
    apart = min((math.dist(a, b) for a in eyelets for b in eyelets if a != b), default=outer)
    rim = min((outer - math.hypot(*place) for place in eyelets), default=outer)
    eyelet = min(0.1 * outer, 0.45 * apart, 0.6 * rim, 0.3 * (innermost - channel))
    room = innermost - eyelet - channel  # between channel and eyelets, for tube and bore
    if robot.appearance == "wire_guides":
        bore, tube = channel + 0.4 * room, channel + 0.3 * room
    else:
        tube = channel + min(0.05 * outer, 0.3 * room)
        bore = tube
    foot = _FOOT * outer
    clear = all(abs(x) > foot + eyelet or abs(y) < bore for x, y in eyelets)
    return CellShape(
        length=segment.length_m / links_of(robot, segment),
        outer_radius=outer,
        channel_radius=channel,
        eyelets=eyelets,
        eyelet_radius=eyelet,
        bore_radius=bore,
        tube_radius=tube,
        # A rolling pair turns about one axis, and an eyelet in its way would be blocked.
        pivots=segment.bending_axes == "x" and clear,
        two_axes=segment.bending_axes == "xy",
    )


def links_of(robot: ContinuumRobot, segment: Segment) -> int:
    """Return how many links, each with one hinge, `segment` has."""
    return disks(robot, segment) * robot.links_per_subsegment


def wire_guide(shape: CellShape, beyond: CellShape | None) -> trimesh.Trimesh:
    """Return the guide of a link: curved projection at its hinge, trapezoidal one at the next hinge.

    Args:
        shape: of the link that the guide belongs to.
        beyond: of the next link; None for the last one, which ends in a cap over its eyelets.
    """
    bottom = _ring_gap(shape)
    end = shape.length / 2.0 if beyond is None else (shape.length + beyond.length) / 2.0
    top = end if beyond is None else end - _ring_gap(beyond)
    solids = []
    if beyond is None:
        cap = 0.3 * (top - bottom)
        bore = circle(shape.bore_radius, _INNER_SECTIONS)
        solids.append(prism(circle(shape.outer_radius, _OUTER_SECTIONS), [bore], top - cap, top))
        top -= cap
    solids.append(_ring(shape, bottom, top))
    if shape.pivots:
        solids += _curved_projections(shape, bottom)
    if beyond is not None and beyond.pivots:
        solids += [raised(solid, end) for solid in _trapezoidal_projections(beyond, _ring_gap(beyond))]
    return together(solids)


def base_guide(shape: CellShape) -> trimesh.Trimesh:
    """Return the fixed guide under the first hinge (at z = 0), with a collar that is clamped."""
    bottom = -shape.length / 2.0
    collar = prism(
        circle(1.25 * shape.outer_radius, _OUTER_SECTIONS),
        [circle(shape.bore_radius, _INNER_SECTIONS)],
        bottom - 2.0 * shape.outer_radius,
        bottom,
    )
    solids = [collar, _ring(shape, bottom, -_ring_gap(shape))]
    if shape.pivots:
        solids += _trapezoidal_projections(shape, _ring_gap(shape))
    return together(solids)


def backbone_cell(shape: CellShape, beyond: CellShape | None) -> trimesh.Trimesh:
    """Return a link's stretch of laser-cut tube, with half a flexure at each hinge.

    Args:
        shape: of the link.
        beyond: of the next link; None for the last one, which ends at its distal face.
    """
    end = shape.length / 2.0 if beyond is None else (shape.length + beyond.length) / 2.0
    top = end if beyond is None else end - _TUBE_GAP * beyond.length
    solids = [tube(shape, _TUBE_GAP * shape.length, top)]
    solids += _flexures(shape, 0.0, (_TUBE_GAP + _OVERLAP) * shape.length)
    if beyond is not None:
        solids += _flexures(beyond, end - (_TUBE_GAP + _OVERLAP) * beyond.length, end)
    return together(solids)


def base_backbone_cell(shape: CellShape) -> trimesh.Trimesh:
    """Return the fixed stretch of tube under the first hinge (at z = 0), from the base face on."""
    solids = [tube(shape, -shape.length / 2.0, -_TUBE_GAP * shape.length)]
    return together(solids + _flexures(shape, -(_TUBE_GAP + _OVERLAP) * shape.length, 0.0))


def spacer_disk(shape: CellShape, thickness: float) -> trimesh.Trimesh:
    """Return a disk with tendon holes, centred at z = 0."""
    return _ring(shape, -thickness / 2.0, thickness / 2.0)


def backbone_rod(shape: CellShape, length: float) -> trimesh.Trimesh:
    """Return a link's stretch of plain backbone from z = 0 to `length` [m]: a rod, or a tube."""
    if shape.channel_radius > 0:
        return tube(shape, 0.0, length)
    return domed_rod(shape.tube_radius, length, _ROD_SECTIONS)


def disk_thickness(robot: ContinuumRobot, index: int) -> float:
    """Return how thick the disks of segment `index` are drawn [m]."""
    segment = robot.segments[index]
    return min(0.15 * segment.length_m / disks(robot, segment), 0.2 * segment.outer_radius_m)


def _ring_gap(shape: CellShape) -> float:
    """Return the distance of a guide's ring from the hinge [m]; the rims clear one another to 8 deg."""
    clear = 0.6 * shape.outer_radius * math.sin(math.radians(8.0))
    return min(max(_RING_GAP * shape.length, clear), 0.45 * shape.length)


def _channel(shape: CellShape) -> list[np.ndarray]:
    return [circle(shape.channel_radius, _INNER_SECTIONS)] if shape.channel_radius > 0 else []


def _ring(shape: CellShape, z_from: float, z_to: float) -> trimesh.Trimesh:
    holes = [circle(shape.eyelet_radius, _EYELET_SECTIONS, place) for place in shape.eyelets]
    bore = circle(shape.bore_radius, _INNER_SECTIONS)
    return prism(circle(shape.outer_radius, _OUTER_SECTIONS), [bore, *holes], z_from, z_to)


def tube(shape: CellShape, z_from: float, z_to: float) -> trimesh.Trimesh:
    """Return a straight stretch of backbone, hollow where the robot has a channel."""
    return prism(circle(shape.tube_radius, _INNER_SECTIONS), _channel(shape), z_from, z_to)


def _flexures(shape: CellShape, z_from: float, z_to: float) -> list[trimesh.Trimesh]:
    """Return thin strips on the bending axis, on both sides of the channel."""
    inner, outer = shape.channel_radius, shape.tube_radius
    thin = 0.12 * outer
    if inner == 0:
        wide = (-outer, outer)
        return [box((-thin, thin), (-thin, thin) if shape.two_axes else wide, (z_from, z_to))]
    # A strip's far edge, not its middle, touches the tube's round wall: keep inside of it.
    reach = math.sqrt(outer**2 - thin**2) * math.cos(math.pi / _INNER_SECTIONS)
    spans = [(inner, reach), (-reach, -inner)]
    strips = [box((-thin, thin), span, (z_from, z_to)) for span in spans]
    if shape.two_axes:
        strips += [box(span, (-thin, thin), (z_from, z_to)) for span in spans]
    return strips


def _curved_projections(shape: CellShape, gap: float) -> list[trimesh.Trimesh]:
    """Return arcs that hang from a ring's face at z = `gap` and touch z = 0 in a line along y."""
    foot, radius = _FOOT * shape.outer_radius, _ARC * shape.outer_radius
    turn = math.asin(foot / radius)
    # A low ring leaves no room for the whole arc.
    turn = min(turn, math.acos(max(0.0, 1.0 - gap / radius)))
    angle = np.linspace(-turn, turn, _ARC_SECTIONS + 1)
    arc = np.stack([radius * np.sin(angle), radius * (1.0 - np.cos(angle))], axis=1)
    top = gap + _OVERLAP * shape.length
    half = arc[-1, 0]
    profile = np.concatenate([arc, [(half, top), (-half, top)]])
    return [across_y(profile, *span) for span in _projection_spans(shape)]


def _trapezoidal_projections(shape: CellShape, gap: float) -> list[trimesh.Trimesh]:
    """Return trapezoids that stand on a ring's face at z = -`gap`, their flat top at z = 0."""
    foot, flat = _FOOT * shape.outer_radius, _FLAT * shape.outer_radius
    bottom = -gap - _OVERLAP * shape.length
    profile = np.array(
        [(-foot, bottom), (foot, bottom), (foot, -gap), (flat, 0.0), (-flat, 0.0), (-foot, -gap)]
    )
    return [across_y(profile, *span) for span in _projection_spans(shape)]


def _projection_spans(shape: CellShape) -> list[tuple[float, float]]:
    foot = _FOOT * shape.outer_radius
    inner = shape.bore_radius * 1.03
    outer = math.sqrt(shape.outer_radius**2 - foot**2) * math.cos(math.pi / _OUTER_SECTIONS)
    return [(inner, outer), (-outer, -inner)]


# ----------------------------------------------------------------------------------------------------
# What a robot looks like: which meshes its model needs, and which of them each link shows.
#
# Meshes are in metres, in the frame of a link (`catheter_sim.robots.continuum.picture`). Link 0 is the
# fixed base; its parts are placed in the base frame.

_SHORTEST_ROD = 0.02  # of a link: the least that is drawn of a backbone


def tendon_width(robot: ContinuumRobot) -> float:
    """Return the drawn radius of the tendons [m]; a real one would be too thin to see."""
    shapes = [cell_shape(robot, index) for index in range(len(robot.segments))]
    return 0.5 * min(min(shape.eyelet_radius, shape.tube_radius) for shape in shapes)


def element_meshes(robot: ContinuumRobot) -> dict[str, trimesh.Trimesh]:
    """Return every mesh that `element_parts` names, by its key.

    `guide_<segment>` lies between two links of a segment, `guide_<segment>.end` on the border to the
    next one, `guide.base` and `guide.tip` at the ends; a segment's name has no dot. `backbone` alike; where
    hinges are moved toward the disks, `backbone_<segment>.within` lies between two of a subsegment.
    """
    shapes = [cell_shape(robot, index) for index in range(len(robot.segments))]
    names = [segment.name for segment in robot.segments]
    counts = [links_of(robot, segment) for segment in robot.segments]
    guides = robot.appearance == "wire_guides"
    # Between two links of one segment; across each border between segments; at the tip.
    stretches = [
        (name, shape, shape) for name, shape, count in zip(names, shapes, counts, strict=True) if count > 1
    ]
    stretches += [(f"{name}.end", *pair) for name, pair in zip(names[:-1], pairwise(shapes), strict=True)]
    meshes: dict[str, trimesh.Trimesh] = {}
    if guides:
        meshes["guide.base"] = base_guide(shapes[0])
        meshes["backbone.base"] = base_backbone_cell(shapes[0])
        for key, shape, beyond in stretches:
            meshes[f"guide_{key}"] = wire_guide(shape, beyond)
            meshes[f"backbone_{key}"] = backbone_cell(shape, beyond)
        meshes["guide.tip"] = wire_guide(shapes[-1], None)
        meshes["backbone.tip"] = backbone_cell(shapes[-1], None)
        return meshes
    near, far = zip(*(_disks_to_hinges(robot, segment) for segment in robot.segments), strict=True)
    before = {f"{name}.end": near[k + 1] for k, name in enumerate(names[:-1])}  # the hinge beyond a border
    after = dict(zip(names, far, strict=True))
    shortest = _SHORTEST_ROD * min(shape.length for shape in shapes)
    meshes["backbone.base"] = tube(shapes[0], -max(near[0] * shapes[0].length, shortest), 0.0)
    for key, shape, beyond in stretches:
        name = key.removesuffix(".end")
        to_hinge = before.get(key, near[names.index(name)]) * beyond.length
        meshes[f"backbone_{key}"] = backbone_rod(shape, max(after[name] * shape.length + to_hinge, shortest))
    if robot.hinges == "rod" and robot.links_per_subsegment > 1:
        links = robot.links_per_subsegment
        apart = (links - 2.0 * near[0]) / (links - 1)  # of the hinges between two disks, in links
        for name, shape in zip(names, shapes, strict=True):
            meshes[f"backbone_{name}.within"] = backbone_rod(shape, apart * shape.length)
    meshes["backbone.tip"] = backbone_rod(shapes[-1], max(far[-1] * shapes[-1].length, shortest))
    for index, (name, shape) in enumerate(zip(names, shapes, strict=True)):
        meshes[f"disk_{name}"] = spacer_disk(shape, disk_thickness(robot, index))
    return meshes


def element_parts(robot: ContinuumRobot, element_index: int) -> tuple[Part, ...]:
    """Return what link `element_index` shows.

    Args:
        robot: the robot.
        element_index: 0 for the fixed base, 1 to n for the links from base to tip.
    """
    guides = robot.appearance == "wire_guides"
    if element_index == 0:
        half = cell_shape(robot, 0).length * _disks_to_hinges(robot, robot.segments[0])[0]
        backbone = Part("backbone.base", "backbone", half, 0.0, NITI, "metal", True)
        if guides:
            return backbone, Part("guide.base", "guide", half, 0.0, FIXED, "plastic", False)
        first = robot.segments[0].name
        return backbone, Part(f"disk_{first}", "disk", 0.0, 0.0, FIXED, "plastic", False)
    index, within = _segment_of(robot, element_index)
    segment = robot.segments[index]
    length = segment.length_m / links_of(robot, segment)
    turn = within * length * segment.rest_twist_rad_per_m
    turn += sum(item.length_m * item.rest_twist_rad_per_m for item in robot.segments[:index])
    is_last = within == links_of(robot, segment)
    suffix = f"_{segment.name}.end" if is_last else f"_{segment.name}"
    if is_last and index == len(robot.segments) - 1:
        suffix = ".tip"
    other = index % 2 == 1
    backbone = Part(f"backbone{suffix}", "backbone", 0.0, 0.0, NITI, "metal", True)
    if guides:
        colour = PEEK_NEXT if other else PEEK
        return backbone, Part(f"guide{suffix}", "guide", 0.0, turn, colour, "plastic", False)
    if within % robot.links_per_subsegment:
        if robot.hinges == "rod":
            within_disks = f"backbone_{segment.name}.within"
            return (Part(within_disks, "backbone", 0.0, 0.0, NITI, "metal", True),)
        return (backbone,)
    colour = DISK_NEXT if other else DISK
    height = length * _disks_to_hinges(robot, segment)[1]
    return backbone, Part(f"disk_{segment.name}", "disk", height, turn, colour, "plastic", False)


def _disks_to_hinges(robot: ContinuumRobot, segment: Segment) -> tuple[float, float]:
    """Return how far a subsegment's first hinge is from the disk before it, and the last one from the disk
    beyond, in lengths of a link."""
    places = hinge_places(robot, segment)
    return places[0] * robot.links_per_subsegment, (1.0 - places[-1]) * robot.links_per_subsegment


def _segment_of(robot: ContinuumRobot, link: int) -> tuple[int, int]:
    """Return the segment's index and the link's number within it, both for link `link` from 1."""
    within = link
    for index, segment in enumerate(robot.segments):
        count = links_of(robot, segment)
        if within <= count:
            return index, within
        within -= count
    raise IndexError(f"link {link} of a robot with {link - within} links")


# ----------------------------------------------------------------------------------------------------
# What is drawn of a continuum robot, and which parts lie about its axis.

CENTRELINE_PARTS: tuple[str, ...] = ("backbone",)


def meshes(robot: ContinuumRobot) -> Mapping[str, trimesh.Trimesh]:
    """Return every mesh that `parts` names, by its name."""
    return element_meshes(robot)


def parts(robot: ContinuumRobot, element: int) -> tuple[Part, ...]:
    """Return what a link shows: 0 for the fixed base, 1 to n for the links from base to tip."""
    return element_parts(robot, element)


def geom_places(robot: ContinuumRobot, model: mujoco.MjModel) -> Array:
    """Return where the model's geoms stand in their bodies, shape (ngeom, 3) [m]."""
    return model.geom_pos.copy()
