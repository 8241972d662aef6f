"""What a catheter looks like: rings, modules and implant, what is drawn of it, and its axis."""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np
import trimesh

from catheter_sim.arrays import Array
from catheter_sim.mjcf.document import Element
from catheter_sim.mjcf.names import link
from catheter_sim.mjcf.parts import SEEN, Part, add_mesh, add_site
from catheter_sim.mjcf.solids import (
    FIXED,
    NITI,
    PEEK,
    PEEK_NEXT,
    Colour,
    across_y,
    box,
    circle,
    domed_rod,
    prism,
    tendon_colour,
    together,
)
from catheter_sim.robots.catheter.description import (
    elements,
    hinge_heights_m,
    ring_length_m,
)
from catheter_sim.robots.catheter.spec import CatheterRobot, CatheterSegment

# ----------------------------------------------------------------------------------------------------
# The rigid pieces of a catheter's model.


@dataclass(frozen=True)
class VisualPiece:
    """What one body of the model stands for.

    Attributes:
        name: the body's.
        segment: index of its segment.
        element: number of its element, from 1; 0 for what lies beyond a bending segment's last gap.
        gap: number of the gap below it, from 1; 0 where its segment does not bend.
        origin_m: height of the body's origin above its segment's base end at rest: of the hinge in the
            gap below it, or 0 [m].
    """

    name: str
    segment: int
    element: int
    gap: int
    origin_m: float


def pieces(robot: CatheterRobot) -> list[VisualPiece]:
    """Return the bodies of the robot's model, base to tip."""
    result: list[VisualPiece] = []
    parts = list(enumerate(elements(robot), 1))
    for index, segment in enumerate(robot.segments):
        numbers = [number for number, part in parts if part.segment == index]
        if segment.joint != "bending":
            result.append(VisualPiece(link(numbers[0]), index, numbers[0], 0, 0.0))
            continue
        heights = [float(height) for height in hinge_heights_m(segment)]
        for gap, number in enumerate(numbers, 1):
            result.append(VisualPiece(link(number), index, number, gap, heights[gap - 1]))
        result.append(VisualPiece(f"end_{segment.name}", index, 0, len(heights), heights[-1]))
    return result


# ----------------------------------------------------------------------------------------------------
# The implant at a catheter's tip: a clip of two arms that open, held by the last module.
#
# Both mitral papers open it with a tendon that is pulled by hand and print neither its shape nor how it
# moves. Assumed, as in clips for edge-to-edge repair: a post on a foot, two arms hinged at the post's far
# end that open backward, so that leaflets come to lie between arms and post; sizes, angle and stiffness.
# Its length is printed: 13 mm (Nayar 2022, Section I). The rigid end is 20 mm, of which the two modules of
# the torsion joint are 6 and 4.5 mm (abstract, Table I): 9.5 mm of the implant stand free, and 3.5 mm of it
# must lie inside the holder, where they are not drawn.
#
# In the model, where the last segment is a torsion joint: bodies and hinges `implant_pos` and `implant_neg`
# (toward the tool's +x and -x), the site `implant` in the middle of the clip, and the actuator `implant`,
# the last of all: 0 closed, 1 open. It turns the first arm; a passive spring, the tendon `implant_arms`,
# makes the other one its mirror image. The arms weigh next to nothing, so that they move no other joint.

ACTUATOR = "implant"
ARMS = {"implant_pos": 1.0, "implant_neg": -1.0}  # bodies and hinges, and the side of the post
IMPLANT_LENGTH_M = 13e-3  # Nayar 2022, Section I
IMPLANT_M = 9.5e-3  # free length: 20 mm less 6 and 4.5 mm (Nayar 2022, abstract and Table I)
OPEN_RAD = math.radians(60.0)  # of each arm from the post; assumed, of clips that open to 120 deg
SERVO_N_M_PER_RAD = 2e-2  # assumed: half a newton at an arm's end that a leaflet keeps 10 deg open
COUPLING_N_M_PER_RAD = 5.0 * SERVO_N_M_PER_RAD  # between the arms; assumed
COLOUR: Colour = (0.90, 0.70, 0.32, 1.0)
_WIDTH = 0.62  # half width of the arms along y, over the outer radius
_POST = 0.10  # half thickness of the post, over the outer radius
_HINGE = (0.13, 0.95)  # x over the outer radius, z over the implant's length
# An arm's outline, closed, toward +x, counter-clockwise; x over the outer radius, z over the length.
_OUTLINE = ((0.13, 0.17), (0.34, 0.14), (0.52, 0.32), (0.42, 0.90), (0.24, 1.0), (0.13, 1.0))
_NO_MASS_KG, _NO_INERTIA_KG_M2 = 1e-9, 1e-13  # as of the bodies of `robots.catheter.model`


def has_implant(robot: CatheterRobot) -> bool:
    """Return whether the robot's last module holds an implant: one that can turn it does."""
    return robot.segments[-1].joint == "torsion"


def holder_length_m(robot: CatheterRobot) -> float:
    """Return how much of the last module is solid, below the implant's foot [m].

    A module that is longer than the free implant ends where the implant does.
    """
    length = robot.segments[-1].length_m
    return length - IMPLANT_M if length > IMPLANT_M else length


def hinge_place_m(robot: CatheterRobot, side: float) -> tuple[float, float, float]:
    """Return where an arm's hinge lies in the last module's frame, `side` +1 or -1 [m]."""
    outer = robot.segments[-1].outer_radius_m
    return (side * _HINGE[0] * outer, 0.0, holder_length_m(robot) + _HINGE[1] * IMPLANT_M)


def arm_width_m(robot: CatheterRobot) -> float:
    """Return the width of an arm, along the tool's y [m]."""
    return 2.0 * _WIDTH * robot.segments[-1].outer_radius_m


def post_mesh(outer_m: float) -> trimesh.Trimesh:
    """Return the implant's foot and post, from z = 0, for a module of this outer radius [m]."""
    foot = prism(circle(0.55 * outer_m, 24), [], 0.0, 0.12 * IMPLANT_M)
    half, width = _POST * outer_m, 0.5 * _WIDTH * outer_m
    return together([foot, box((-half, half), (-width, width), (0.10 * IMPLANT_M, 0.97 * IMPLANT_M))])


def arm_mesh(outer_m: float, side: float) -> trimesh.Trimesh:
    """Return an arm as it lies closed, in its hinge's frame, on the side +1 or -1."""
    outline = (np.array(_OUTLINE) - _HINGE) * (side * outer_m, IMPLANT_M)
    width = _WIDTH * outer_m
    return across_y(outline if side > 0 else outline[::-1], -width, width)


def add_implant(root: Element, robot: CatheterRobot, holder: Element) -> None:
    """Add the arms to the body `holder` of the last module, and their actuator; to be called last.

    The servo holds both arms at `OPEN_RAD` times its control exactly where nothing presses on them.
    """
    if not has_implant(robot):
        return
    outer = robot.segments[-1].outer_radius_m
    middle = holder_length_m(robot) + 0.5 * IMPLANT_M
    add_site(holder, "implant", (0, 0, middle))
    arms = root.part("tendon").add(
        "fixed", name="implant_arms", stiffness=COUPLING_N_M_PER_RAD, springlength=0.0
    )
    for name, side in ARMS.items():
        add_mesh(root, name, arm_mesh(outer, side))
        body = holder.add("body", name=name, pos=hinge_place_m(robot, side))
        body.add("inertial", pos=(0, 0, 0), mass=_NO_MASS_KG, diaginertia=[_NO_INERTIA_KG_M2] * 3)
        body.add(
            "joint",
            name=name,
            type="hinge",
            axis=(0, -side, 0),  # opening is positive
            damping=SERVO_N_M_PER_RAD * robot.dynamics.relaxation_time_s,
            armature=SERVO_N_M_PER_RAD * robot.dynamics.inertia_time_s**2,
        )
        body.add("geom", name=f"{name}_arm", mesh=name, rgba=COLOUR, material="metal", **SEEN)
        arms.add("joint", joint=name, coef=side)
    root.part("actuator").add(
        "general",
        name=ACTUATOR,
        joint=next(iter(ARMS)),
        biastype="affine",
        ctrlrange=(0.0, 1.0),
        gainprm=(SERVO_N_M_PER_RAD * OPEN_RAD,),
        biasprm=(0.0, -SERVO_N_M_PER_RAD, 0.0),
    )


# ----------------------------------------------------------------------------------------------------
# What the pieces of a catheter look like: rings on wires, modules, the holder with its implant, as meshes.
#
# All are in metres, in the frame of a piece's body (`catheter_sim.robots.catheter.picture`): +z toward
# the tip, z = 0 at the hinge of a ring, at the base end of a module. Rings have their lumen, two tendons'
# holes in the bending plane and two wires' holes across it. The wires run from hinge to hinge.
#
# Assumed, as no paper gives them: the piece under the base, the plate that ends a guide, grooves and flats.
# The strips that show a torsion joint's wrapped pair turn with the module. Of the implant only foot and
# post are here; its arms move (`catheter_sim.robots.catheter.picture`).

RING_PREFIX, MODULE_PREFIX, BASE_PREFIX = "ring", "module", "base"
_STEEL: Colour = (0.50, 0.58, 0.67, 1.0)
_TUBE_MODULE: Colour = (0.72, 0.78, 0.84, 1.0)
_SLEEVE: Colour = (0.90, 0.91, 0.92, 1.0)
_OUTER_SECTIONS, _LUMEN_SECTIONS, _HOLE_SECTIONS, _WIRE_SECTIONS = 48, 24, 10, 8
_WIRE, _HOLE = 0.045, 0.085  # drawn radii over the outer radius
_PLATE = 0.12  # thickness of the plate that ends a guide, over the outer radius
_GROOVES, _GROOVE_DEPTH = 4, 0.05  # along a torsion module: they show its turn
_BASE_MODULE, _SLEEVE_LENGTH, _SLEEVE_WIDTH = 1.75, 5.0, 0.88  # over the outer radius: 5 mm, 14 mm, 5 mm


def meshes(robot: CatheterRobot) -> dict[str, trimesh.Trimesh]:
    """Return every mesh that `parts` names, by its key; a segment's name has no dot."""
    first = robot.segments[0].outer_radius_m
    found = {
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
            found[f"ring_{name}"] = _ring(robot, segment)
            found[f"wires_{name}.start"] = _wires(segment, float(heights[0]))
            found[f"wires_{name}"] = _wires(segment, float(heights[1] - heights[0]))
            found[f"wires_{name}.end"] = _wires(segment, segment.length_m - float(heights[-1]))
            if _ends_guide(robot, index):
                thin = _PLATE * segment.outer_radius_m
                found[f"ring_{name}.end"] = _round(robot, segment.outer_radius_m, -thin, 0.0)
            continue
        solid = solid_length(robot, index)
        grooves = segment.joint == "torsion"
        found[f"module_{name}"] = _round(robot, segment.outer_radius_m, 0.0, solid, grooves)
        if grooves:
            for sign, side in ((1.0, "pos"), (-1.0, "neg")):
                found[f"wrap_{name}.{side}"] = _wrapped(segment, sign, solid)
    if has_implant(robot):
        found["implant"] = post_mesh(robot.segments[-1].outer_radius_m)
    return found


def parts(robot: CatheterRobot, element: int) -> tuple[Part, ...]:
    """Return what a body shows: 0 for what carries the base, then `pieces` from base to tip."""
    every = pieces(robot)
    shown = [_wire_start(robot, every[element], 0.0)] if _starts_bending(every, element, first=True) else []
    if element == 0:
        base = Part("module.base", BASE_PREFIX, 0.0, 0.0, FIXED, "plastic", False)
        return (base, Part("sleeve", "sleeve", 0.0, 0.0, _SLEEVE, "plastic", False), *shown)
    piece = every[element - 1]
    segment = robot.segments[piece.segment]
    if not piece.gap:
        shown += _module_parts(robot, piece)
    elif piece.element:
        bottom = elements(robot)[piece.element - 1].face_m - ring_length_m(segment) - piece.origin_m
        turn = _turn(segment)
        colour = _ring_colour(robot, segment)
        shown.append(Part(f"ring_{segment.name}", RING_PREFIX, bottom, turn, colour, "plastic", True))
        shown.append(Part(f"wires_{segment.name}", "wires", 0.0, turn, NITI, "metal", False))
    else:
        shown.append(Part(f"wires_{segment.name}.end", "wires", 0.0, _turn(segment), NITI, "metal", False))
        if _ends_guide(robot, piece.segment):
            top = segment.length_m - piece.origin_m
            colour = _ring_colour(robot, segment)
            shown.append(Part(f"ring_{segment.name}.end", RING_PREFIX, top, 0.0, colour, "plastic", True))
    if _starts_bending(every, element):
        shown.append(
            _wire_start(robot, every[element], robot.segments[piece.segment].length_m - piece.origin_m)
        )
    return tuple(shown)


def base_bottom_m(robot: CatheterRobot) -> float:
    """Return where the fixed module under the base begins, below z = 0 [m]."""
    return -_BASE_MODULE * robot.segments[0].outer_radius_m


def _starts_bending(every: list[VisualPiece], index: int, first: bool = False) -> bool:
    """Return whether the piece beyond body `index` is a bending segment's first ring."""
    return (index == 0) == first and index < len(every) and every[index].gap == 1


def _ends_guide(robot: CatheterRobot, index: int) -> bool:
    """Return whether nothing stays beyond a bending segment's last gap: its wires need a plate to end in."""
    return index == len(robot.segments) - 1 or robot.segments[index + 1].joint == "prismatic"


def _wire_start(robot: CatheterRobot, piece: VisualPiece, height: float) -> Part:
    """Return the wires below a bending segment's first hinge, which the piece before it carries."""
    segment = robot.segments[piece.segment]
    return Part(f"wires_{segment.name}.start", "wire_start", height, _turn(segment), NITI, "metal", False)


def _module_parts(robot: CatheterRobot, piece: VisualPiece) -> list[Part]:
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
        parts.append(Part("implant", "implant", top, 0.0, COLOUR, "metal", False))
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


# ----------------------------------------------------------------------------------------------------
# What is drawn of a catheter, and which parts lie about its axis.
#
# Its rings and modules are round about its axis; its exposed tube is no geom.

CENTRELINE_PARTS: tuple[str, ...] = (RING_PREFIX, MODULE_PREFIX, BASE_PREFIX)


def geom_places(robot: CatheterRobot, model: mujoco.MjModel) -> Array:
    """Return where the model's geoms stand in their bodies, shape (ngeom, 3) [m]."""
    return model.geom_pos.copy()
