"""The MuJoCo model of a continuum robot: a chain of hinged links with tendons, and its actuators."""

from __future__ import annotations

import math
from functools import partial

from catheter_sim.core.motion import IMPLICIT_SPRINGS, Integration, of_springs_and_masses
from catheter_sim.mjcf import names
from catheter_sim.mjcf.document import Element
from catheter_sim.mjcf.parts import (
    add_feed,
    add_mount,
    add_parts,
    add_puller,
    add_site,
    add_spatial,
    add_tension_actuators,
    pass_feed,
    rest_lengths,
)
from catheter_sim.mjcf.solids import tendon_colour
from catheter_sim.robots.continuum import picture
from catheter_sim.robots.continuum.defaults import BEND_RAD, tip_error_m
from catheter_sim.robots.continuum.description import (
    Link,
    Piece,
    axes_of,
    disk_heights,
    disks,
    hole_xy_m,
    last_disk,
    links,
    pieces,
)
from catheter_sim.robots.continuum.picture import tendon_width
from catheter_sim.robots.continuum.spec import ContinuumRobot, Tendon

# ----------------------------------------------------------------------------------------------------
# A continuum robot as a chain of hinged links with spatial tendons, in MJCF.
#
# Names in the model (i, k count from 1 at the base):
#
# - bodies `link_<i>`, origin at the link's hinge; `foot`, the fixed backbone below the first hinge, where
#   mass is spread along the robot; `mount` where the mount gives way;
# - joints `x<i>`, `y<i>`, `t<i>` (bending toward +x, toward +y, twist) and `mount`;
# - sites `face_<k>` (centre of disk k's distal face), `tip`, `hole_<tendon>_<k>` (k = 0: base);
# - tendons and actuators `tendon_<tendon>`.

# An inextensible tendon driven by displacement is a spring this many times stiffer than the
# robot's bending seen from that tendon: its stretch stays below 0.1 % of the bending's share.
INEXTENSIBLE_RATIO = 1000.0


def add_chain(root: Element, robot: ContinuumRobot) -> list[Element]:
    """Add the links, joints and holes of `robot`; return the base and the links' bodies."""
    bodies = _add_bodies(root, robot)
    _add_holes(root, robot, bodies)
    return bodies


def add_tendons(root: Element, robot: ContinuumRobot) -> None:
    """Add the tendons of `robot` through their holes."""
    for index, tendon in enumerate(robot.tendons):
        element = add_spatial(root, tendon.name, tendon_width(robot), tendon_colour(index))
        pass_feed(element, robot, tendon.name)
        for k in range(last_disk(robot, tendon) + 1):
            element.add("site", site=names.hole(tendon.name, k))


def _add_bodies(root: Element, robot: ContinuumRobot) -> list[Element]:
    """Add the bodies and joints; return the base and the links' bodies."""
    base = add_mount(root, robot)
    chain = links(robot)
    foot, *carried = pieces(robot)
    bodies = [base]
    hinge_z = 0.0
    for link, piece in zip(chain, carried, strict=True):
        body = bodies[-1].add("body", name=names.link(link.index), pos=(0, 0, link.hinge_z_m - hinge_z))
        hinge_z = link.hinge_z_m
        _add_joints(body, robot, link)
        _add_mass(body, piece, hinge_z)
        face = link.face_z_m - link.hinge_z_m
        if link.disk:
            add_site(body, names.face(link.disk), (0, 0, face))
        bodies.append(body)
    if foot.mass_kg > 0.0:
        _add_mass(base.add("body", name="foot"), foot, 0.0)
    last = chain[-1]
    add_site(bodies[-1], names.TIP, (0, 0, last.face_z_m - last.hinge_z_m))
    return bodies


def _add_mass(body: Element, piece: Piece, origin_z: float) -> None:
    """Give a body whose origin is at a height of the straight robot [m] its mass."""
    body.add(
        "inertial",
        pos=(0, 0, piece.centre_z_m - origin_z),
        mass=piece.mass_kg,
        diaginertia=(piece.transverse_kg_m2, piece.transverse_kg_m2, piece.axial_kg_m2),
    )


def _add_joints(body: Element, robot: ContinuumRobot, link: Link) -> None:
    segment, dynamics = link.segment, robot.dynamics

    def hinge(name: str, axis: tuple[int, int, int], rigidity: float, rest: float, cubic: float) -> None:
        stiffness = robot.stiffness_scale * rigidity / link.length_m
        body.add(
            "joint",
            name=name,
            type="hinge",
            axis=axis,
            # torque = -(k1 q + k2 q^2 + k3 q^3), q from springref
            stiffness=(stiffness, 0.0, stiffness * cubic / link.length_m**2) if cubic else stiffness,
            springref=rest,
            damping=stiffness * dynamics.relaxation_time_s,
            armature=stiffness * dynamics.inertia_time_s**2,
        )

    bending, cubic = segment.bending_stiffness_N_m2, segment.stiffness_cubic_m2
    both = {
        f"x{link.index}": ((0, 1, 0), segment.rest_curvature_x_per_m),
        f"y{link.index}": ((-1, 0, 0), segment.rest_curvature_y_per_m),
    }
    turns = [f"{axis}{link.index}" for axis in axes_of(segment)]
    # Two turns in a row, x before y, also twist by half of their product; every other link takes it back.
    for name in turns if link.index % 2 else reversed(turns):
        axis, curvature = both[name]
        hinge(name, axis, bending, curvature * link.length_m, cubic)
    if math.isfinite(segment.torsion_stiffness_N_m2):
        hinge(f"t{link.index}", (0, 0, 1), segment.torsion_stiffness_N_m2, 0.0, 0.0)


def _add_holes(root: Element, robot: ContinuumRobot, bodies: list[Element]) -> None:
    heights = disk_heights(robot)
    disk_links = [link for link in links(robot) if link.disk]

    for tendon in robot.tendons:
        add_feed(root, robot, tendon.name, hole_xy_m(robot, tendon, 0.0))
        add_site(bodies[0], names.hole(tendon.name, 0), (*hole_xy_m(robot, tendon, 0.0), 0.0))
        for link in disk_links[: last_disk(robot, tendon)]:
            x, y = hole_xy_m(robot, tendon, float(heights[link.disk]))
            position = (x, y, link.face_z_m - link.hinge_z_m)
            add_site(bodies[link.index], names.hole(tendon.name, link.disk), position)


def drive_stiffness(robot: ContinuumRobot, tendon: Tendon) -> float:
    """Return the stiffness of a displacement-driven tendon, a finite one for an inextensible [N/m]."""
    if math.isfinite(tendon.stiffness_N_per_m):
        return tendon.stiffness_N_per_m
    end = last_disk(robot, tendon)
    compliance = 0.0
    for link in links(robot):
        hinge_stiffness = robot.stiffness_scale * link.segment.bending_stiffness_N_m2 / link.length_m
        compliance += tendon.radius_m**2 / hinge_stiffness * bool(axes_of(link.segment))
        if link.disk == end:
            break
    return INEXTENSIBLE_RATIO / compliance


def add_displacement_actuators(root: Element, robot: ContinuumRobot) -> None:
    """Add actuators that take the tendons' displacements; to be called when the tendons are there."""
    lengths = rest_lengths(root, robot) + [tendon.slack_m for tendon in robot.tendons]
    for index, tendon in enumerate(robot.tendons):
        name = names.tendon(tendon.name)
        stiffness = drive_stiffness(robot, tendon)
        # force = -pretension - k (displacement + length - rest length), pulls only
        add_puller(root, name, name, stiffness, stiffness * lengths[index] - tendon.pretension_N)


# ----------------------------------------------------------------------------------------------------
# The MuJoCo model of a continuum robot: a chain of links (`mjcf.chain`), its tendons and their actuators.

_CLOSE_UP = 6.0  # cells that the close-up shows


def add(root: Element, robot: ContinuumRobot, actuation: str) -> None:
    """Add `robot` to the model `root`: links, what they show, tendons, actuators."""
    bodies = add_chain(root, robot)
    add_parts(root, bodies, picture.meshes(robot), partial(picture.parts, robot))
    add_tendons(root, robot)
    if actuation == "tension":
        add_tension_actuators(root, robot)
    else:
        add_displacement_actuators(root, robot)


def integration(robot: ContinuumRobot, actuation: str) -> Integration:
    """Return how it is stepped in motion: tendons that are driven are stiff springs, and so may a law be."""
    law = any(
        segment.stiffness_cubic_m2 or segment.stiffness_quintic_m4 or segment.plastic_share
        for segment in robot.segments
    )
    stiff = actuation != "tension" or law
    return Integration(IMPLICIT_SPRINGS) if stiff else of_springs_and_masses(robot)


def length_m(robot: ContinuumRobot) -> float:
    """Return the length of the straight robot [m]."""
    return sum(segment.length_m for segment in robot.segments)


def close_up(robot: ContinuumRobot) -> tuple[float, float]:
    """Return the height of the close-up's middle, and how much of the base it shows [m]."""
    size = _CLOSE_UP * robot.segments[0].length_m / disks(robot, robot.segments[0])
    return 0.45 * size, size


def remarks(robot: ContinuumRobot) -> tuple[str, ...]:
    """Return how well the chain of links stands for a rod."""
    error_m, by = tip_error_m(robot), "its tendons" if robot.tendons else "a moment"
    if not error_m > 0.0:
        return ()
    return (
        f"links: {robot.links_per_subsegment} per subsegment, {len(links(robot))} in all; with every segment "
        f"bent by {math.degrees(BEND_RAD):.0f} deg by {by} alone the tip is {error_m * 1e3:.2g} mm "
        f"({100.0 * error_m / length_m(robot):.1g} % of the length) off a rod's",
    )
