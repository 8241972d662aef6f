"""What the pieces of a catheter look like: rings on wires, modules, the holder with its implant, as meshes.

All are in metres, in the frame of a piece's body (`catheter_sim.kinds.catheter.mjcf.pieces`): +z toward the
tip, z = 0 at the hinge of a ring, at the base end of a module. Rings have their lumen, two tendons'
holes in the bending plane and two wires' holes across it. The wires run from hinge to hinge.

Assumed, as no paper gives them: the piece under the base, the plate that ends a guide, grooves and flats.
The strips that show a torsion joint's wrapped pair turn with the module. Of the implant only foot and
post are here; its arms move (`catheter_sim.kinds.catheter.mjcf.implant`).
"""

from __future__ import annotations

import math

import numpy as np
import trimesh

from catheter_sim.arrays import Array
from catheter_sim.kinds.catheter.layout import elements, hinge_heights_m, ring_length_m
from catheter_sim.kinds.catheter.mjcf.implant import COLOUR as IMPLANT_COLOUR
from catheter_sim.kinds.catheter.mjcf.implant import has_implant, holder_length_m, post_mesh
from catheter_sim.kinds.catheter.mjcf.pieces import Piece, pieces
from catheter_sim.kinds.catheter.spec import CatheterRobot, CatheterSegment
from catheter_sim.mjcf.colours import FIXED, NITI, PEEK, PEEK_NEXT, Colour, tendon_colour
from catheter_sim.mjcf.parts import Part
from catheter_sim.mjcf.solids import circle, domed_rod, prism, together

RING_PREFIX, MODULE_PREFIX, BASE_PREFIX = "ring", "module", "base"
_STEEL: Colour = (0.50, 0.58, 0.67, 1.0)
_TUBE_MODULE: Colour = (0.72, 0.78, 0.84, 1.0)
_SLEEVE: Colour = (0.90, 0.91, 0.92, 1.0)
_OUTER_SECTIONS, _LUMEN_SECTIONS, _HOLE_SECTIONS, _WIRE_SECTIONS = 48, 24, 10, 8
_WIRE, _HOLE = 0.045, 0.085  # drawn radii over the outer radius
_PLATE = 0.12  # thickness of the plate that ends a guide, over the outer radius
_GROOVES, _GROOVE_DEPTH = 4, 0.05  # along a torsion module: they show its turn
_BASE_MODULE, _SLEEVE_LENGTH, _SLEEVE_WIDTH = 1.75, 5.0, 0.88  # over the outer radius: 5 mm, 14 mm, 5 mm


def body_meshes(robot: CatheterRobot) -> dict[str, trimesh.Trimesh]:
    """Return every mesh that `body_parts` names, by its key; a segment's name has no dot."""
    first = robot.segments[0].outer_radius_m
    meshes = {
        "module.base": _round(robot, first, base_bottom_m(robot), 0.0),
        "sleeve": _round(
            robot,
            _SLEEVE_WIDTH * first,
            base_bottom_m(robot) - _SLEEVE_LENGTH * first,
            base_bottom_m(robot),
        ),
    }
    for index, segment in enumerate(robot.segments):
        name = segment.name
        if segment.joint == "bending":
            heights = hinge_heights_m(segment)
            meshes[f"ring_{name}"] = _ring(robot, segment)
            meshes[f"wires_{name}.start"] = _wires(segment, float(heights[0]))
            meshes[f"wires_{name}"] = _wires(segment, float(heights[1] - heights[0]))
            meshes[f"wires_{name}.end"] = _wires(segment, segment.length_m - float(heights[-1]))
            if _ends_guide(robot, index):
                thin = _PLATE * segment.outer_radius_m
                meshes[f"ring_{name}.end"] = _round(robot, segment.outer_radius_m, -thin, 0.0)
            continue
        solid = solid_length(robot, index)
        grooves = segment.joint == "torsion"
        meshes[f"module_{name}"] = _round(robot, segment.outer_radius_m, 0.0, solid, grooves)
        if grooves:
            for sign, side in ((1.0, "pos"), (-1.0, "neg")):
                meshes[f"wrap_{name}.{side}"] = _wrapped(segment, sign, solid)
    if has_implant(robot):
        meshes["implant"] = post_mesh(robot.segments[-1].outer_radius_m)
    return meshes


def body_parts(robot: CatheterRobot, index: int) -> tuple[Part, ...]:
    """Return what body `index` shows: 0 for what carries the base, then `pieces` from base to tip."""
    every = pieces(robot)
    parts = [_wire_start(robot, every[index], 0.0)] if _starts_bending(every, index, first=True) else []
    if index == 0:
        base = Part("module.base", BASE_PREFIX, 0.0, 0.0, FIXED, "plastic", False)
        return (base, Part("sleeve", "sleeve", 0.0, 0.0, _SLEEVE, "plastic", False), *parts)
    piece = every[index - 1]
    segment = robot.segments[piece.segment]
    if not piece.gap:
        parts += _module_parts(robot, piece)
    elif piece.element:
        bottom = elements(robot)[piece.element - 1].face_m - ring_length_m(segment) - piece.origin_m
        turn = _turn(segment)
        colour = _ring_colour(robot, segment)
        parts.append(Part(f"ring_{segment.name}", RING_PREFIX, bottom, turn, colour, "plastic", True))
        parts.append(Part(f"wires_{segment.name}", "wires", 0.0, turn, NITI, "metal", False))
    else:
        parts.append(Part(f"wires_{segment.name}.end", "wires", 0.0, _turn(segment), NITI, "metal", False))
        if _ends_guide(robot, piece.segment):
            top = segment.length_m - piece.origin_m
            colour = _ring_colour(robot, segment)
            parts.append(Part(f"ring_{segment.name}.end", RING_PREFIX, top, 0.0, colour, "plastic", True))
    if _starts_bending(every, index):
        parts.append(
            _wire_start(robot, every[index], robot.segments[piece.segment].length_m - piece.origin_m)
        )
    return tuple(parts)


def base_bottom_m(robot: CatheterRobot) -> float:
    """Return where the fixed module under the base begins, below z = 0 [m]."""
    return -_BASE_MODULE * robot.segments[0].outer_radius_m


def _starts_bending(every: list[Piece], index: int, first: bool = False) -> bool:
    """Return whether the piece beyond body `index` is a bending segment's first ring."""
    return (index == 0) == first and index < len(every) and every[index].gap == 1


def _ends_guide(robot: CatheterRobot, index: int) -> bool:
    """Return whether nothing stays beyond a bending segment's last gap: its wires need a plate to end in."""
    return index == len(robot.segments) - 1 or robot.segments[index + 1].joint == "prismatic"


def _wire_start(robot: CatheterRobot, piece: Piece, height: float) -> Part:
    """Return the wires below a bending segment's first hinge, which the piece before it carries."""
    segment = robot.segments[piece.segment]
    return Part(f"wires_{segment.name}.start", "wire_start", height, _turn(segment), NITI, "metal", False)


def _module_parts(robot: CatheterRobot, piece: Piece) -> list[Part]:
    segment = robot.segments[piece.segment]
    colour = {"prismatic": _TUBE_MODULE, "rigid": PEEK_NEXT}.get(segment.joint, _STEEL)
    parts = [Part(f"module_{segment.name}", MODULE_PREFIX, 0.0, 0.0, colour, "plastic", True)]
    if segment.joint == "torsion":
        pair = [pair.moves for pair in robot.tendons].index(segment.name)
        for number, side in enumerate(("pos", "neg")):
            shown = tendon_colour(2 * pair + number)
            parts.append(
                Part(f"wrap_{segment.name}.{side}", f"wrap_{side}", 0.0, 0.0, shown, "plastic", False)
            )
    if has_implant(robot) and piece.segment == len(robot.segments) - 1:
        top = solid_length(robot, piece.segment)
        parts.append(Part("implant", "implant", top, 0.0, IMPLANT_COLOUR, "metal", False))
    return parts


def solid_length(robot: CatheterRobot, index: int) -> float:
    """Return how much of a module is solid: of a holder that houses the implant only its base [m]."""
    holds = has_implant(robot) and index == len(robot.segments) - 1
    return holder_length_m(robot) if holds else robot.segments[index].length_m


def _turn(segment: CatheterSegment) -> float:
    return math.pi / 2.0 if segment.bends_toward == "y" else 0.0


def _ring_colour(robot: CatheterRobot, segment: CatheterSegment) -> Colour:
    bending = [part.name for part in robot.segments if part.joint == "bending"]
    return (PEEK, PEEK_NEXT)[bending.index(segment.name) % 2]


def _lumen(robot: CatheterRobot) -> list[Array]:
    radius = robot.channel_radius_m
    return [circle(radius, _LUMEN_SECTIONS)] if radius > 0.0 else []


def _round(
    robot: CatheterRobot, radius: float, z_from: float, z_to: float, grooves: bool = False
) -> trimesh.Trimesh:
    """Return a round piece with its lumen, with grooves along it where its turn is to be seen."""
    outline = circle(radius, _OUTER_SECTIONS)
    if grooves:
        outline[:: _OUTER_SECTIONS // _GROOVES] *= 1.0 - 2.0 * _GROOVE_DEPTH
    lumen = _lumen(robot) if robot.channel_radius_m < 0.9 * radius else []
    return prism(outline, lumen, z_from, z_to)


def _ring(robot: CatheterRobot, segment: CatheterSegment) -> trimesh.Trimesh:
    """Return a ring of a joint that bends toward x, from z = 0 to its length."""
    outer, arm = segment.outer_radius_m, segment.arm_m
    room = min(outer - arm, arm - robot.channel_radius_m)
    radius = min(_HOLE * outer, 0.8 * room)
    holes = _lumen(robot)
    if radius > 0.01 * outer:
        for place in ((arm, 0.0), (-arm, 0.0), (0.0, arm), (0.0, -arm)):
            holes.append(circle(radius, _HOLE_SECTIONS, place))
    return prism(circle(outer, _OUTER_SECTIONS), holes, 0.0, ring_length_m(segment))


def _wires(segment: CatheterSegment, length: float) -> trimesh.Trimesh:
    """Return the two wires of a joint that bends toward x, from a hinge at z = 0 to `length` [m]."""
    rod = domed_rod(_WIRE * segment.outer_radius_m, length, _WIRE_SECTIONS)
    return together(
        [
            trimesh.Trimesh(
                rod.vertices + np.array([0.0, side * segment.arm_m, 0.0]), rod.faces, process=False
            )
            for side in (1.0, -1.0)
        ]
    )


def _wrapped(segment: CatheterSegment, sign: float, solid: float) -> trimesh.Trimesh:
    """Return a tendon's strip around a torsion module, rising over the wrap's height [m]."""
    outer, thick = segment.outer_radius_m, _WIRE * segment.outer_radius_m
    # On a drum the two would lie in one another.
    low = (5.0 if sign < 0 and segment.wrap_height_m == 0.0 else 2.0) * thick
    high = min(low + segment.wrap_height_m, solid - 2.0 * thick)
    share = np.linspace(0.0, 1.0, 25)
    angle = sign * segment.wrap_rad * (share - 0.5) - math.pi / 2.0
    z = high + (low - high) * share
    corners = [
        (outer - thick, -thick),
        (outer + thick, -thick),
        (outer + thick, thick),
        (outer - thick, thick),
    ]
    if sign < 0:
        corners.reverse()
    rings = [
        np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z + rise])
        for radius, rise in corners
    ]
    vertices = np.stack(rings, axis=1).reshape(-1, 3)  # four corners at each angle
    faces = []
    for step in range(len(share) - 1):
        for k in range(4):
            a, b = 4 * step + k, 4 * step + (k + 1) % 4
            faces += [(a, a + 4, b + 4), (a, b + 4, b)]
    last = 4 * (len(share) - 1)
    faces += [(0, 1, 2), (0, 2, 3), (last, last + 2, last + 1), (last, last + 3, last + 2)]
    return trimesh.Trimesh(vertices, np.array(faces), process=False)
