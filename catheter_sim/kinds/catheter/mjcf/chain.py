"""A catheter of torsion, bending and prismatic joints as MJCF.

Names in the model, beside `mount` and `tip` as in `catheter_sim.kinds.continuum.mjcf.chain`:

- bodies `link_<k>`, one for each element; `end_<segment>`, what lies beyond a bending segment's last gap;
- joints: those of `channels.joint_names`, and a prismatic segment's own name; of a tube that bends also
  those of `catheter_tube`;
- sites `face_<k>`; `entry`, the base's middle; `exit_<segment>` and `inlet_<segment>`, the two ends of
  a prismatic segment's exposed tube; `hole_<pair>_<sign>_<gap>_<a|b>`, a tendon on both sides of a gap
  (`_start`, `_end`: at the joint's ends);
- tendons `tendon_<pair>_pos` and `_neg` of a bending joint's pair; `tube_<segment>` and
  `coupling_<segment>`, only to be seen;
- actuators: `catheter_sim.kinds.catheter.mjcf.drive`.

Hinges. One stands for each gap of a bending joint, and the pair runs straight between two points at
its arm, half a gap below and above the hinge: Nayar 2022, Eqs 1-2, exactly. The hinges lie evenly
spaced, but not in the middles of the gaps: that would be rigid rings, with a chord up to 0.6 mm (2022
robot at 120 deg) longer than that of the arc that both papers take the joint for.
`kinds.catheter.layout.hinge_heights_m` places them so that the chords agree but for the bend's fourth power.
"""

from __future__ import annotations

from catheter_sim.core.robot import has_mount_slide
from catheter_sim.errors import InputError
from catheter_sim.kinds.catheter.layout import (
    closing_angle_rad,
    elements,
    joint_stiffness,
    moved_segment,
    ring_length_m,
)
from catheter_sim.kinds.catheter.mjcf.drive import SLIDING_SCALE_N_PER_M, TURNING_SCALE_N_M_PER_RAD
from catheter_sim.kinds.catheter.mjcf.pieces import pieces
from catheter_sim.kinds.catheter.mjcf.tube import BEND_AXIS, add_tube_end, add_tube_springs
from catheter_sim.kinds.catheter.spec import CatheterRobot, CatheterSegment, TendonPair
from catheter_sim.mjcf import names
from catheter_sim.mjcf.colours import NITI, tendon_colour
from catheter_sim.mjcf.document import Element
from catheter_sim.mjcf.mount import add_mount
from catheter_sim.mjcf.tendons import add_feed, add_site, add_spatial, pass_feed

SIGNS = {"pos": 1.0, "neg": -1.0}
# MuJoCo refuses bodies without mass. These weigh a hundred millionth of a newton, which moves no tip by a
# nanometre, and their inertia is a millionth of the joints' armature.
_NO_MASS_KG, _NO_INERTIA_KG_M2 = 1e-9, 1e-13
# Rings that touch are hard: MuJoCo's default lets them sink into each other by 3 % at 20 N, this by 0.2 %.
_CLOSED_GAP = (0.99, 0.999, 0.001, 0.5, 2.0)
_TUBE = (0.93, 0.93, 0.90, 1.0)


def gap_stiffness(robot: CatheterRobot, segment: CatheterSegment) -> float:
    """Return the stiffness of one gap of a bending segment, `rings` + 1 of them in series [N m/rad]."""
    return joint_stiffness(robot, segment) * (segment.rings + 1)


def add_catheter(root: Element, robot: CatheterRobot) -> list[Element]:
    """Add the bodies, joints and sites of `robot`; return the base and all bodies, in the order of `pieces`.

    Raises:
        InputError: a bending joint without stiffness; its rings' places would not be determined.
    """
    bodies = [add_mount(root, robot)]
    add_site(bodies[0], "entry", (0, 0, 0))
    parts = elements(robot)
    rise = 0.0  # of the segment's base end above the origin of the last body
    for piece in pieces(robot):
        segment = robot.segments[piece.segment]
        if piece.gap == 1:
            _start_bending(root, bodies, robot, segment, rise)
        if piece.gap:
            _add_holes(
                bodies[-1], robot, segment, f"{piece.gap}_a", rise + piece.origin_m - segment.half_gap_m
            )
        elif segment.joint == "prismatic":
            _add_tube_ends(bodies[-1], robot, segment, "exit", rise)
        body = bodies[-1].add("body", name=piece.name, pos=(0, 0, rise + piece.origin_m))
        bodies.append(body)
        rise = -piece.origin_m
        if piece.gap:
            _add_hinge(body, robot, segment, piece.gap)
            _add_holes(body, robot, segment, f"{piece.gap}_b", segment.half_gap_m)
        else:
            add_tube_end(body, robot, segment, "exit")
            _add_joint(body, robot, segment)
            add_tube_end(body, robot, segment, "inlet")
        if segment.joint == "prismatic":
            _add_tube_ends(body, robot, segment, "inlet", 0.0)
        if piece.element:
            face = parts[piece.element - 1].face_m + rise
            length = ring_length_m(segment) if piece.gap else segment.length_m
            share = segment.rings if piece.gap else 1
            _add_mass(body, segment, segment.mass_kg / share, face - length / 2.0, length)
            add_site(body, names.face(piece.element), (0, 0, face))
            if piece.element == len(parts):
                add_site(body, names.TIP, (0, 0, face))
        else:
            _add_mass(body, segment, 0.0, 0.0, 0.0)
            _add_holes(body, robot, segment, "end", segment.length_m + rise)
        if not piece.gap or not piece.element:
            rise += segment.length_m
    return bodies


def add_catheter_tendons(root: Element, robot: CatheterRobot) -> None:
    """Add the bending joints' pairs through their holes, and the tubes as they are seen."""
    tendons = root.part("tendon")
    for index, pair in enumerate(robot.tendons):
        segment = robot.segments[moved_segment(robot, index)]
        if segment.joint == "prismatic":
            for kind, ends, radius, colour in (
                ("tube", segment.name, tube_radius_m(robot), _TUBE),
                ("coupling", f"coupling_{segment.name}", tendon_radius_m(robot), NITI),
            ):
                tube = tendons.add("spatial", name=f"{kind}_{segment.name}", width=radius, rgba=colour)
                if kind == "tube":  # through the guide, to be seen in the gaps
                    tube.add("site", site="entry")
                    for number, part in enumerate(elements(robot), 1):
                        if part.segment < robot.segments.index(segment):
                            tube.add("site", site=names.face(number))
                tube.add("site", site=f"exit_{ends}")
                tube.add("site", site=f"inlet_{ends}")
        if segment.joint != "bending":
            continue
        for number, sign in enumerate(SIGNS):
            name = f"{pair.name}_{sign}"
            element = add_spatial(root, name, tendon_radius_m(robot), tendon_colour(2 * index + number))
            if has_mount_slide(robot):
                # The run before the base, of which the way to the joint is another branch.
                pass_feed(element, robot, name)
                element.add("site", site=names.hole(name, "base"))
                element.add("pulley", divisor=1)
            gaps = [f"{gap}_{side}" for gap in range(1, segment.rings + 2) for side in "ab"]
            for where in ("start", *gaps, "end"):
                element.add("site", site=names.hole(name, where))
    add_tube_springs(root, robot)


def tendon_radius_m(robot: CatheterRobot) -> float:
    """Return the drawn radius of the tendons and wires [m]; a real one would be too thin to see."""
    return 0.045 * max(segment.outer_radius_m for segment in robot.segments)


def tube_radius_m(robot: CatheterRobot) -> float:
    """Return the drawn radius of the tube that is advanced [m]: it fits into the free lumen."""
    return 0.88 * robot.channel_radius_m or 0.3 * min(segment.outer_radius_m for segment in robot.segments)


def _start_bending(
    root: Element, bodies: list[Element], robot: CatheterRobot, segment: CatheterSegment, rise: float
) -> None:
    """Add where a pair enters its joint, and its run before the base where the mount gives way.

    Raises:
        InputError: the joint has no stiffness.
    """
    if joint_stiffness(robot, segment) == 0.0:
        raise InputError(
            f"{robot.name}: segments.{segment.name}.bending_stiffness_N_mm_per_rad = 0: "
            "the simulation needs wires that keep the rings apart"
        )
    _add_holes(bodies[-1], robot, segment, "start", rise)
    if not has_mount_slide(robot):
        return
    _add_holes(bodies[0], robot, segment, "base", 0.0)
    for sign in SIGNS:
        add_feed(root, robot, f"{_pair_of(robot, segment).name}_{sign}", _place(segment, sign))


def _add_hinge(body: Element, robot: CatheterRobot, segment: CatheterSegment, gap: int) -> None:
    stiffness = gap_stiffness(robot, segment)
    limit = closing_angle_rad(segment) / (segment.rings + 1)
    body.add(
        "joint",
        name=f"{segment.name}_{gap}",
        type="hinge",
        axis=BEND_AXIS[segment.bends_toward],
        stiffness=stiffness,
        springref=segment.rest_rad / (segment.rings + 1) or None,
        range=(-limit, limit),
        limited=True,
        solimplimit=_CLOSED_GAP,
        damping=stiffness * robot.dynamics.relaxation_time_s,
        armature=stiffness * robot.dynamics.inertia_time_s**2,
    )


def _add_joint(body: Element, robot: CatheterRobot, segment: CatheterSegment) -> None:
    """Add a torsion or prismatic segment's joint; a rigid one has none."""
    scales = {"torsion": TURNING_SCALE_N_M_PER_RAD, "prismatic": SLIDING_SCALE_N_PER_M}
    if segment.joint not in scales:
        return
    turns = segment.joint == "torsion"
    body.add(
        "joint",
        name=segment.name,
        type="hinge" if turns else "slide",
        axis=(0, 0, 1),
        range=(-segment.wrap_rad, segment.wrap_rad) if turns else None,
        limited=turns,
        damping=scales[segment.joint] * robot.dynamics.relaxation_time_s,
        armature=scales[segment.joint] * robot.dynamics.inertia_time_s**2,
    )


def _add_mass(body: Element, segment: CatheterSegment, mass_kg: float, height: float, length: float) -> None:
    radius = segment.outer_radius_m
    transverse = mass_kg * (radius**2 / 4.0 + length**2 / 12.0)
    about_axis = mass_kg * radius**2 / 2.0
    body.add(
        "inertial",
        pos=(0, 0, height),
        mass=max(mass_kg, _NO_MASS_KG),
        diaginertia=[max(value, _NO_INERTIA_KG_M2) for value in (transverse, transverse, about_axis)],
    )


def _pair_of(robot: CatheterRobot, segment: CatheterSegment) -> TendonPair:
    return next(pair for pair in robot.tendons if pair.moves == segment.name)


def _place(segment: CatheterSegment, sign: str) -> tuple[float, float]:
    offset = SIGNS[sign] * segment.arm_m
    return (offset, 0.0) if segment.bends_toward == "x" else (0.0, offset)


def _add_holes(
    body: Element, robot: CatheterRobot, segment: CatheterSegment, where: str, height: float
) -> None:
    """Add the sites `hole_<pair>_<sign>_<where>` of a bending segment's pair."""
    for sign in SIGNS:
        name = names.hole(f"{_pair_of(robot, segment).name}_{sign}", where)
        add_site(body, name, (*_place(segment, sign), height))


def _add_tube_ends(
    body: Element, robot: CatheterRobot, segment: CatheterSegment, where: str, height: float
) -> None:
    """Add one end of the exposed tube, and of the wire along it that keeps it from turning."""
    add_site(body, f"{where}_{segment.name}", (0, 0, height))
    beside = tube_radius_m(robot) + tendon_radius_m(robot)
    add_site(body, f"{where}_coupling_{segment.name}", (-beside, 0, height))
