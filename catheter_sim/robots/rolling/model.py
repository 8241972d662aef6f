"""The MuJoCo model of a robot of rolling joints: a chain of hinges, its rods and actuators."""

from __future__ import annotations

from functools import partial

import numpy as np

from catheter_sim.core.motion import IMPLICIT_SPRINGS, Integration
from catheter_sim.errors import InputError
from catheter_sim.mjcf import names
from catheter_sim.mjcf.document import Element
from catheter_sim.mjcf.parts import (
    add_feed,
    add_mount,
    add_parts,
    add_site,
    add_spatial,
    add_tension_actuators,
    pass_feed,
)
from catheter_sim.mjcf.solids import tendon_colour
from catheter_sim.robots.rolling import picture
from catheter_sim.robots.rolling.description import (
    ACTUATIONS,
    RollingChain,
    RollingJoint,
    hole_position,
    last_joint,
    rest_angle,
    rods,
    rolling_chain,
    rolling_joints,
)
from catheter_sim.robots.rolling.spec import Rod, RollingRobot

# ----------------------------------------------------------------------------------------------------
# A robot of rolling joints as a chain of hinges in MJCF.
#
# A joint that rolls turns, at each instant, about its contact. So each link hangs on one hinge, and before
# every step `catheter_sim.robots.rolling.laws` moves the hinge to the contact and the link to
# where pure rolling takes it: position and velocity of the joint are then exact, for both arcs, with one
# degree of freedom and no constraint. In the file as it stands, the links are at rest and the hinges at
# their first contacts: a viewer that does not move them shows small bends only.
#
# Names in the model are those of `catheter_sim.robots.continuum.model`; the holes' mouths are sites
# `mouth_<rod>_<k>` (lower face of link k) and `hole_<rod>_<k>` (its flat top; k = 0: the base).

_PASSIVE = (0.10, 0.11, 0.13, 1.0)  # colour of a rod that nobody pulls
_HINGE_AXIS = ((0, 1, 0), (-1, 0, 0))  # bends toward +x, toward +y


def add_rolling_chain(root: Element, robot: RollingRobot) -> list[Element]:
    """Add the links, joints and holes of `robot`; return the base and the links' bodies."""
    chain = rolling_chain(robot)
    stiffness = chain.rest_stiffness  # the scale of damping and armature
    bodies = [add_mount(root, robot)]
    height = 0.0
    for joint in rolling_joints(robot):
        body = bodies[-1].add("body", name=names.link(joint.index), pos=(0, 0, height))
        height = joint.link_length_m
        _add_joint(body, robot, joint, chain, float(stiffness[joint.index - 1]))
        segment = joint.segment
        mass = segment.mass_kg / segment.joints
        transverse = mass * (segment.outer_radius_m**2 / 4.0 + joint.link_length_m**2 / 12.0)
        body.add(
            "inertial",
            pos=(0, 0, joint.link_length_m - segment.centre_of_mass_depth_m),
            mass=mass,
            diaginertia=(transverse, transverse, mass * segment.outer_radius_m**2 / 2.0),
        )
        add_site(body, names.face(joint.index), (0.0, 0.0, joint.link_length_m))
        bodies.append(body)
    add_site(bodies[-1], names.TIP, (0.0, 0.0, height))
    for index, rod in enumerate(rods(robot)):
        if index < chain.pulled:
            first = hole_position(rod, robot.segments[0])
            add_feed(root, robot, rod.name, (float(first[0]), float(first[1])))
        _add_holes(bodies, robot, rod, chain.mouth[index])
    return bodies


def add_rods(root: Element, robot: RollingRobot) -> None:
    """Add the rods as spatial tendons: the pulled ones in the tendons' colours, passive ones dark grey."""
    for index, rod in enumerate(rods(robot)):
        colour = tendon_colour(index) if index < len(robot.tendons) else _PASSIVE
        element = add_spatial(root, rod.name, rod.rod_radius_m, colour)
        if index < len(robot.tendons):
            pass_feed(element, robot, rod.name)
        element.add("site", site=names.hole(rod.name, 0))
        for k in range(1, last_joint(robot, rod) + 1):
            element.add("site", site=f"mouth_{rod.name}_{k}")
            element.add("site", site=names.hole(rod.name, k))


def _add_joint(
    body: Element, robot: RollingRobot, joint: RollingJoint, chain: RollingChain, stiffness: float
) -> None:
    k = joint.index - 1
    contact = [0.0, 0.0, 0.0]
    contact[joint.axis] = joint.line_m
    body.add(
        "joint",
        name=joint.name,
        type="hinge",
        axis=_HINGE_AXIS[joint.axis],
        pos=contact,
        springref=rest_angle(joint),
        range=(float(chain.low[k]), float(chain.high[k])),
        limited=True,
        damping=stiffness * robot.dynamics.relaxation_time_s,
        armature=stiffness * robot.dynamics.inertia_time_s**2,
    )


def _add_holes(bodies: list[Element], robot: RollingRobot, rod: Rod, mouth: np.ndarray) -> None:
    joints = rolling_joints(robot)
    position = hole_position(rod, joints[0].segment)
    add_site(bodies[0], names.hole(rod.name, 0), (*position, -rod.countersink_m))
    for joint in joints[: last_joint(robot, rod)]:
        x, y = hole_position(rod, joint.segment)
        body = bodies[joint.index]
        add_site(body, f"mouth_{rod.name}_{joint.index}", (x, y, float(mouth[joint.index - 1])))
        add_site(body, names.hole(rod.name, joint.index), (x, y, joint.link_length_m - rod.countersink_m))


# ----------------------------------------------------------------------------------------------------
# The MuJoCo model of a robot of rolling joints: a chain of hinges (`mjcf.chain`), its rods and actuators.

_STIFFER = 10.0  # than unbent: a joint whose gap nearly closes, by the table of its rods' lengths
_CLOSE_UP = 2.5  # joints that the close-up shows


def add(root: Element, robot: RollingRobot, actuation: str) -> None:
    """Add `robot` to the model `root`: links, what they show, rods, actuators.

    Raises:
        InputError: another actuation than tension.
    """
    if actuation not in ACTUATIONS:
        raise InputError(f"{robot.name}: its rods are pulled by tension; choices: tension")
    bodies = add_rolling_chain(root, robot)
    add_parts(root, bodies, picture.meshes(robot), partial(picture.parts, robot))
    add_rods(root, robot)
    add_tension_actuators(root, robot)


def integration(robot: RollingRobot, actuation: str) -> Integration:
    """Return how it is stepped in motion: rods resist beside the step, up to `_STIFFER` times as unbent."""
    return Integration(IMPLICIT_SPRINGS, _STIFFER, own_springs=False)


def length_m(robot: RollingRobot) -> float:
    """Return the length of the straight robot [m]."""
    return sum(segment.length_m for segment in robot.segments)


def close_up(robot: RollingRobot) -> tuple[float, float]:
    """Return the height of the close-up's middle, and how much of the base it shows [m]."""
    size = _CLOSE_UP * robot.segments[0].length_m / robot.segments[0].joints
    return 0.45 * size, size


def remarks(robot: RollingRobot) -> tuple[str, ...]:
    """Return what to say of the model: nothing."""
    return ()
