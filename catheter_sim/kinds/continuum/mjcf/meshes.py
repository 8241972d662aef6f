"""What a robot looks like: which meshes its model needs, and which of them each link shows.

Meshes are in metres, in the frame of a link (`catheter_sim.kinds.continuum.mjcf.cells`). Link 0 is the fixed
base; its parts are placed in the base frame.
"""

from __future__ import annotations

from itertools import pairwise

import trimesh

from catheter_sim.kinds.continuum.layout import hinge_places
from catheter_sim.kinds.continuum.mjcf.cells import (
    backbone_cell,
    backbone_rod,
    base_backbone_cell,
    base_guide,
    cell_shape,
    disk_thickness,
    links_of,
    spacer_disk,
    tube,
    wire_guide,
)
from catheter_sim.kinds.continuum.spec import ContinuumRobot, Segment
from catheter_sim.mjcf.colours import DISK, DISK_NEXT, FIXED, NITI, PEEK, PEEK_NEXT
from catheter_sim.mjcf.parts import Part

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
