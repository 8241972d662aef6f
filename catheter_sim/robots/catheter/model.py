"""The MuJoCo model of a catheter: its chain of pieces, exposed tubes and drives."""

from __future__ import annotations

import math
from functools import partial

from catheter_sim.core.motion import IMPLICIT_SPRINGS, Integration
from catheter_sim.core.robot import has_mount_slide
from catheter_sim.errors import InputError
from catheter_sim.mjcf import names
from catheter_sim.mjcf.document import Element
from catheter_sim.mjcf.names import tendon
from catheter_sim.mjcf.parts import (
    FEED_LENGTH_M,
    add_feed,
    add_mount,
    add_parts,
    add_puller,
    add_site,
    add_spatial,
    pass_feed,
)
from catheter_sim.mjcf.solids import NITI, tendon_colour
from catheter_sim.robots.catheter import picture
from catheter_sim.robots.catheter.description import (
    ACTUATIONS,
    base_heights_m,
    bending_tubes,
    closing_angle_rad,
    elements,
    joint_stiffness,
    moved_segment,
    moved_segments,
    ring_length_m,
    tube_stiffness_N_m2,
)
from catheter_sim.robots.catheter.kinematics import SKEW_STIFFNESS, arm_m, drawn_at_rest_m
from catheter_sim.robots.catheter.measured import PRINTED
from catheter_sim.robots.catheter.picture import add_implant, pieces
from catheter_sim.robots.catheter.spec import CatheterRobot, CatheterSegment, TendonPair

# ----------------------------------------------------------------------------------------------------
# What moves a catheter's joints in its MJCF: an actuator for each pair, and one for each antagonist.
#
# Actuators `tendon_<pair>` stand first, in the robot's order, then `antagonist_<pair>` of the bending
# joints' pairs; a common pulley gives an antagonist the opposite control. Controls are in m.
#
# Torsion. Its pair is in no spatial tendon: MuJoCo wraps one by less than half a turn, and the paper's
# antagonist is too short (`robots.catheter.kinematics`). Its actuator turns the joint; what
# `catheter_sim.robots.catheter.laws` does to it before every step makes it Eq. 6. In the file as
# it stands it is Eq. 6 in the linear range about zero.

# An inextensible tendon is a spring this many times stiffer than its joint's bending seen from it; the
# angle then lags by less than 0.02 % of itself. Ten times that of a continuum robot: what is beyond the
# joint is long.
INEXTENSIBLE_RATIO = 1e4
# Joints without a stiffness of their own take their damping, armature and drive from these. Of the order
# of the bending joints'; no equilibrium depends on them but by the drive's yield under a load.
TURNING_SCALE_N_M_PER_RAD = 5e-3
SLIDING_SCALE_N_PER_M = 1e3


def tendon_stiffness(robot: CatheterRobot, pair: TendonPair) -> float:
    """Return the stiffness of each tendon of a pair, or of an advanced tube; finite [N/m].

    Of a tendon with a law of its own: that at no strain, in series with its stiffness.
    """
    if pair.law == "uhmwpe":
        return 1.0 / (pair.length_m / PRINTED.envelope_N[2] + 1.0 / pair.stiffness_N_per_m)
    if math.isfinite(pair.stiffness_N_per_m):
        return pair.stiffness_N_per_m
    segment = next(item for item in robot.segments if item.name == pair.moves)
    if segment.joint == "prismatic":
        return INEXTENSIBLE_RATIO * SLIDING_SCALE_N_PER_M
    if segment.joint == "torsion":
        return INEXTENSIBLE_RATIO * TURNING_SCALE_N_M_PER_RAD / segment.tendon_radius_m**2
    joint = joint_stiffness(robot, segment)
    return INEXTENSIBLE_RATIO * joint / segment.arm_m**2


def add_catheter_actuators(root: Element, robot: CatheterRobot) -> None:
    """Add the actuators; to be called when the tendons are there."""
    moved = moved_segments(robot)
    for pair, segment in zip(robot.tendons, moved, strict=True):
        if segment.joint == "bending":
            _add_puller(root, robot, pair, segment, tendon(pair.name), "pos")
            continue
        stiffness = tendon_stiffness(robot, pair)
        arm = float(arm_m(segment, 0.0)) if segment.joint == "torsion" else 1.0
        root.part("actuator").add(
            "general",
            name=tendon(pair.name),
            joint=segment.name,
            biastype="affine",
            gainprm=(stiffness * arm,),
            biasprm=(0.0, -stiffness * arm**2, 0.0),
        )
    for pair, segment in zip(robot.tendons, moved, strict=True):
        if segment.joint == "bending":
            _add_puller(root, robot, pair, segment, f"antagonist_{pair.name}", "neg")


def _add_puller(
    root: Element,
    robot: CatheterRobot,
    pair: TendonPair,
    segment: CatheterSegment,
    name: str,
    sign: str,
) -> None:
    """Add the actuator of one tendon of a bending joint: a spring that pulls only."""
    stiffness = tendon_stiffness(robot, pair)
    length = segment.length_m + pair.slack_m + (FEED_LENGTH_M if has_mount_slide(robot) else 0.0)
    length -= drawn_at_rest_m(segment, sign)
    add_puller(root, name, tendon(f"{pair.name}_{sign}"), stiffness, stiffness * length)


# ----------------------------------------------------------------------------------------------------
# The exposed tube of a prismatic segment as MJCF, where it bends: by its own curvature or under load.
#
# The tube is its chord, a slide, with a universal joint at either end (`robots.catheter.kinematics`). In
# the body of the segment's element, from the guide outward, stand the hinges `exit_<segment>_x` and `_y`,
# the slide, `twist_<segment>`, `inlet_<segment>_y` and `_x`; `x` bends toward +x. The inlet mirrors the
# exit, so that an arc in any plane is without twist; what bends unlike an arc twists by what the hinges'
# order makes of it, and the hinge `twist` takes that back. Either end turns by 80 deg at most: arcs up to
# 160 deg, and less where an end alone is bent.
#
# The beam's law is in springs over both ends: fixed tendons `bend_<segment>_<axis>`, the sum of the two
# hinges, and `skew_<segment>_<axis>`, their difference. `catheter_sim.robots.catheter.laws` makes
# them those of the present length before every step. In the file as it stands the stiffness is that of half
# the stroke, the rest bend is right, and the slide is the chord.

BEND_AXIS = {"x": (0, 1, 0), "y": (-1, 0, 0)}
RIGID_N_M_PER_RAD = INEXTENSIBLE_RATIO * TURNING_SCALE_N_M_PER_RAD  # of the ends of a rigid curved tube
FURTHEST_RAD = math.radians(80.0)  # at 90 deg the two hinges of an end would stand in one plane
_ORDER = {"exit": "xy", "inlet": "yx"}


def tube_joint_names(segment: CatheterSegment) -> list[str]:
    """Return the names of the hinges of a prismatic segment's bending tube, from the guide outward."""
    ends = {end: [f"{end}_{segment.name}_{axis}" for axis in order] for end, order in _ORDER.items()}
    return [*ends["exit"], f"twist_{segment.name}", *ends["inlet"]]


def add_tube_end(body: Element, robot: CatheterRobot, segment: CatheterSegment, end: str) -> None:
    """Add the hinges of one end, "exit" (before the slide) or "inlet"; none to a rigid straight tube."""
    if segment not in bending_tubes(robot):
        return
    times = robot.dynamics
    if end == "inlet":
        body.add(
            "joint",
            name=f"twist_{segment.name}",
            type="hinge",
            axis=(0, 0, 1),
            stiffness=RIGID_N_M_PER_RAD,
            damping=TURNING_SCALE_N_M_PER_RAD * times.relaxation_time_s,
            armature=TURNING_SCALE_N_M_PER_RAD * times.inertia_time_s**2,
        )
    for axis in _ORDER[end]:
        body.add(
            "joint",
            name=f"{end}_{segment.name}_{axis}",
            type="hinge",
            axis=BEND_AXIS[axis],
            range=(-FURTHEST_RAD, FURTHEST_RAD),
            limited=True,
            armature=_scale(robot, segment) * times.inertia_time_s**2,
        )


def add_tube_springs(root: Element, robot: CatheterRobot) -> None:
    """Add the springs over both ends of every tube that bends; to be called after the other tendons."""
    for segment in bending_tubes(robot):
        curvature = {"x": segment.tube_curvature_x_per_m, "y": segment.tube_curvature_y_per_m}
        for axis in "xy":
            for kind, sign, factor in (("bend", 1.0, 1.0), ("skew", -1.0, SKEW_STIFFNESS)):
                spring = root.part("tendon").add(
                    "fixed",
                    name=f"{kind}_{segment.name}_{axis}",
                    stiffness=factor * tube_spring(robot, segment, 0.5 * segment.stroke_m),
                    damping=factor * _scale(robot, segment) * robot.dynamics.relaxation_time_s,
                )
                spring.add("joint", joint=f"exit_{segment.name}_{axis}", coef=1.0)
                spring.add("joint", joint=f"inlet_{segment.name}_{axis}", coef=sign)
                if kind == "bend" and curvature[axis] != 0.0:
                    spring.add("joint", joint=segment.name, coef=-curvature[axis])


def tube_spring(robot: CatheterRobot, segment: CatheterSegment, length_m: float) -> float:
    """Return the stiffness of a length of tube against its whole bend: EI / length, or rigid [N m/rad]."""
    stiffness = tube_stiffness_N_m2(robot, segment)
    return stiffness / length_m if math.isfinite(stiffness) else RIGID_N_M_PER_RAD


def _scale(robot: CatheterRobot, segment: CatheterSegment) -> float:
    """Return the stiffness from which the hinges take their damping and armature [N m/rad]."""
    if math.isfinite(segment.tube_stiffness_N_m2):
        return tube_spring(robot, segment, 0.5 * segment.stroke_m)
    return TURNING_SCALE_N_M_PER_RAD


# ----------------------------------------------------------------------------------------------------
# A catheter of torsion, bending and prismatic joints as MJCF.
#
# Names in the model, beside `mount` and `tip` as in `catheter_sim.robots.continuum.model`:
#
# - bodies `link_<k>`, one for each element; `end_<segment>`, what lies beyond a bending segment's last gap;
# - joints: those of `channels.joint_names`, and a prismatic segment's own name; of a tube that bends also
#   those of the tubes above;
# - sites `face_<k>`; `entry`, the base's middle; `exit_<segment>` and `inlet_<segment>`, the two ends of
#   a prismatic segment's exposed tube; `hole_<pair>_<sign>_<gap>_<a|b>`, a tendon on both sides of a gap
#   (`_start`, `_end`: at the joint's ends);
# - tendons `tendon_<pair>_pos` and `_neg` of a bending joint's pair; `tube_<segment>` and
#   `coupling_<segment>`, only to be seen;
# - actuators: `catheter_sim.robots.catheter.model`.
#
# Hinges. One stands for each gap of a bending joint, and the pair runs straight between two points at its
# arm, half a gap below and above the hinge: Nayar 2022, Eqs 1-2, exactly. The hinges lie evenly spaced, but
# not in the middles of the gaps: that would be rigid rings, with a chord up to 0.6 mm (2022 robot at 120
# deg) longer than that of the arc that both papers take the joint for.
# `robots.catheter.description.hinge_heights_m` places them so that the chords agree but for the bend's fourth
# power.

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


# ----------------------------------------------------------------------------------------------------
# The MuJoCo model of a catheter: its pieces (`mjcf.chain`), pairs, tubes, actuators and implant.

_CLOSE_UP = 6.0  # rings of the first bending joint that the close-up shows, or outer radii


def add(root: Element, robot: CatheterRobot, actuation: str) -> None:
    """Add `robot` to the model `root`: pieces, what they show, pairs and tubes, actuators, implant.

    Raises:
        InputError: another actuation than displacement, or a bending joint without stiffness.
    """
    if actuation not in ACTUATIONS:
        raise InputError(f"{robot.name}: its pulleys are turned by a displacement; choices: displacement")
    bodies = add_catheter(root, robot)
    add_parts(root, bodies, picture.meshes(robot), partial(picture.parts, robot))
    add_catheter_tendons(root, robot)
    add_catheter_actuators(root, robot)
    add_implant(root, robot, bodies[-1])


def integration(robot: CatheterRobot, actuation: str) -> Integration:
    """Return how it is stepped in motion: pulleys and wires are stiff springs.

    A tube that passes through a joint, and a resistance that was measured, act by laws between two steps.
    There the joint itself may have no spring and, no mass being printed, no inertia: they are taken for as
    stiff as the scale of its damping. Without that the inertia of `mitral_transseptal@tube` is singular.
    """
    return Integration(IMPLICIT_SPRINGS, stiffening=1.0)


def length_m(robot: CatheterRobot) -> float:
    """Return the length of the straight robot, its tubes fully advanced [m]."""
    length = sum(segment.length_m for segment in robot.segments)
    return length + sum(segment.stroke_m for segment in robot.segments)


def close_up(robot: CatheterRobot) -> tuple[float, float]:
    """Return the height of the close-up's middle, and how much it shows of the first bending joint [m]."""
    for start, segment in zip(base_heights_m(robot), robot.segments, strict=False):
        if segment.joint == "bending":
            size = _CLOSE_UP * segment.length_m / segment.rings
            return start + 0.3 * size, size
    size = _CLOSE_UP * robot.segments[0].outer_radius_m
    return 0.45 * size, size


def remarks(robot: CatheterRobot) -> tuple[str, ...]:
    """Return what to say of the model: nothing."""
    return ()
