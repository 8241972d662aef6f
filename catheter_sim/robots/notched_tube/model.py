"""The MuJoCo model of a notched tube: links on hinges, its tendon and the actuator."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from catheter_sim.core.motion import IMPLICIT_SPRINGS, Integration
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
from catheter_sim.robots.notched_tube import description, laws, picture
from catheter_sim.robots.notched_tube.description import HINGES, Notch, notches, rest_angles
from catheter_sim.robots.notched_tube.laws import (
    bending_seen_from_tendon,
    notch_table,
    spring_stiffness,
    stop_stiffness,
)
from catheter_sim.robots.notched_tube.picture import tendon_width
from catheter_sim.robots.notched_tube.section import closing_angle
from catheter_sim.robots.notched_tube.spec import NotchedTubeRobot

# ----------------------------------------------------------------------------------------------------
# A notched tube as a chain of links in MJCF: link k is the uncut tube after notch k.
#
# A link hangs on its notch's hinges. In the file as it stands these lie where the unbent notch turns;
# before every step `catheter_sim.robots.notched_tube.laws` moves them with the bend. A viewer that
# does not shows small bends only, and a metal without a plateau.
#
# Names in the model (k counts from 1 at the base): bodies `link_<k>`, origin on the tube's axis at the
# notch's upper edge; joints `x<k>`, `y<k>`, `t<k>`; sites `face_<k>`, `tip`, and `hole_<tendon>_<i>`: at
# the lower edge of notch k for i = 2 k - 2, at its upper one for i = 2 k - 1, and in the tip.

# An inextensible tendon driven by displacement is a spring this many times stiffer than the tube's bending
# seen from it: its stretch stays below 0.1 % of the bending's share.
INEXTENSIBLE_RATIO = 1000.0
_FARTHEST_RAD = math.pi  # away from the notch: further than any bend


def add_chain(root: Element, robot: NotchedTubeRobot) -> list[Element]:
    """Add the links, joints and holes of `robot`; return the base and the links' bodies."""
    row = notches(robot)
    jnt_pos, jnt_axis, body_pos, body_quat = _places(robot, row)
    bodies = [add_mount(root, robot)]
    tendon = robot.tendons[0]
    add_feed(root, robot, tendon.name, (tendon.radius_m, 0.0))
    add_site(bodies[0], names.hole(tendon.name, 0), (tendon.radius_m, 0.0, 0.0))
    letters = HINGES if robot.bending_axes == "xy" else HINGES[:1]
    for k, notch in enumerate(row):
        body = bodies[-1].add("body", name=names.link(notch.index), pos=body_pos[k], quat=body_quat[k])
        for j, letter in enumerate(letters):
            _add_joint(body, robot, notch, letter, jnt_pos[k, j], jnt_axis[k, j])
        radius, uncut = notch.segment.outer_radius_m, notch.uncut_m
        transverse = notch.mass_kg * (radius**2 / 4.0 + uncut**2 / 12.0)
        body.add(
            "inertial",
            pos=(0, 0, 0.5 * uncut),
            mass=notch.mass_kg,
            diaginertia=(transverse, transverse, notch.mass_kg * radius**2 / 2.0),
        )
        add_site(body, names.face(notch.index), (0.0, 0.0, uncut))
        add_site(body, names.hole(tendon.name, 2 * k + 1), (tendon.radius_m, 0.0, 0.0))
        add_site(body, names.hole(tendon.name, 2 * k + 2), (tendon.radius_m, 0.0, uncut))
        bodies.append(body)
    add_site(bodies[-1], names.TIP, (0.0, 0.0, row[-1].uncut_m))
    return bodies


def add_tendon(root: Element, robot: NotchedTubeRobot, width_m: float) -> None:
    """Add the tendon, from edge to edge, drawn with the radius `width_m`."""
    tendon = robot.tendons[0]
    element = add_spatial(root, tendon.name, width_m, tendon_colour(0))
    pass_feed(element, robot, tendon.name)
    for k in range(2 * len(notches(robot)) + 1):
        element.add("site", site=names.hole(tendon.name, k))


def add_displacement_actuator(root: Element, robot: NotchedTubeRobot) -> None:
    """Add the actuator that takes the tendon's displacement; to be called when the tendon is there."""
    tendon = robot.tendons[0]
    name, stiffness = names.tendon(tendon.name), tendon.stiffness_N_per_m
    if not math.isfinite(stiffness):
        stiffness = INEXTENSIBLE_RATIO * bending_seen_from_tendon(robot)
    # force = -pretension - k (displacement + length - rest length), pulls only
    (length,) = rest_lengths(root, robot)
    add_puller(root, name, name, stiffness, stiffness * length - tendon.pretension_N)


def _places(
    robot: NotchedTubeRobot, row: list[Notch]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return hinges' places and axes, (n, a, 3), and links' places and turns, (n, 3) and (n, 4), at rest."""
    axes = 3 if robot.bending_axes == "xy" else 1
    count = len(row)
    hinge = np.arange(count * axes).reshape(count, axes)
    angles = np.array([rest_angles(notch)[:axes] for notch in row]).reshape(1, -1)
    jnt_pos, jnt_axis = np.zeros((2, 1, count * axes, 3))
    body_pos, body_quat = np.zeros((1, count, 3)), np.zeros((1, count, 4))
    at, moved = (hinge, np.arange(count)), (jnt_pos, jnt_axis, body_pos, body_quat)
    stretch, scratch = np.zeros((1, count)), np.zeros(laws.SCRATCH)
    laws.place(laws.ALONE, angles, hinge, notch_table(robot), stretch, *at, *moved, scratch)
    shape = (count, axes, 3)
    found = jnt_pos.reshape(shape), jnt_axis.reshape(shape), body_pos[0], body_quat[0]
    return found[0] + 0.0, found[1] + 0.0, found[2] + 0.0, found[3] + 0.0


def _add_joint(
    body: Element, robot: NotchedTubeRobot, notch: Notch, letter: str, pos: np.ndarray, axis: np.ndarray
) -> None:
    j = HINGES.index(letter)
    stiffness, dynamics = spring_stiffness(robot, notch.segment)[j], robot.dynamics
    joint = body.add(
        "joint",
        name=f"{letter}{notch.index}",
        type="hinge",
        axis=axis,
        pos=pos,
        stiffness=stiffness,
        springref=rest_angles(notch)[j],
        damping=stiffness * dynamics.relaxation_time_s,
        armature=stiffness * dynamics.inertia_time_s**2,
    )
    if letter == "x":
        _close(joint, robot, notch)


def _close(joint: Element, robot: NotchedTubeRobot, notch: Notch) -> None:
    """Let the hinge stop where the notch is closed, as stiff as uncut tube.

    MuJoCo's limit resists by k d / (1 - d) times the hinge's inertia, here nearly all armature; k and the
    damping are those of a mass that comes to rest in two steps.
    """
    dynamics = robot.dynamics
    rate = 1.0 / (2.0 * dynamics.timestep_s)
    inertia = spring_stiffness(robot, notch.segment)[0] * dynamics.inertia_time_s**2
    ratio = stop_stiffness(robot, notch.segment) / (inertia * rate**2)
    hard = ratio / (1.0 + ratio)
    joint.set(
        limited=True,
        range=(-_FARTHEST_RAD, closing_angle(notch.segment)),
        solreflimit=(-(rate**2), -2.0 * rate),
        solimplimit=(hard, hard, 1e-3, 0.5, 2.0),
    )


# ----------------------------------------------------------------------------------------------------
# The MuJoCo model of a notched tube: links on hinges (`mjcf.chain`), its tendon and the actuator.

_CLOSE_UP = 3.0  # notches that the close-up shows


def add(root: Element, robot: NotchedTubeRobot, actuation: str) -> None:
    """Add `robot` to the model `root`: links, what they show, the tendon, its actuator."""
    bodies = add_chain(root, robot)
    add_parts(root, bodies, picture.meshes(robot), partial(picture.parts, robot))
    add_tendon(root, robot, tendon_width(robot))
    if actuation == "tension":
        add_tension_actuators(root, robot)
    else:
        add_displacement_actuator(root, robot)


def integration(robot: NotchedTubeRobot, actuation: str) -> Integration:
    """Return how it is stepped in motion: laws change the notches' springs between steps."""
    return Integration(IMPLICIT_SPRINGS, 1.0)


def length_m(robot: NotchedTubeRobot) -> float:
    """Return the length of the straight tube from its lowest notch to its tip [m]."""
    return description.length_m(robot)


def close_up(robot: NotchedTubeRobot) -> tuple[float, float]:
    """Return the height of the close-up's middle, and how much of the base it shows [m]."""
    size = min(_CLOSE_UP * description.notches(robot)[0].pitch_m, length_m(robot))
    return 0.45 * size, size


def remarks(robot: NotchedTubeRobot) -> tuple[str, ...]:
    """Return what to say of the model: nothing."""
    return ()
