"""A catheter in a heart as an environment drives it: the procedure's scene, seen from the sheath."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.envs.surroundings import Surroundings
from catheter_sim.mjcf.document import ALL_DIGITS, Element, read
from catheter_sim.modelling.surroundings import CARRIER, INSERTION, quaternion, text
from catheter_sim.procedure.case import Case
from catheter_sim.procedure.contact import WALL_N_PER_M
from catheter_sim.procedure.flow import Flow
from catheter_sim.procedure.frames import DOWN, transform
from catheter_sim.procedure.plan import tip_to_end_m
from catheter_sim.procedure.scene import REGIONS, WAITING_M, build_scene
from catheter_sim.robots.catheter.spec import CatheterRobot

LEAFLET_N_PER_M = WALL_N_PER_M  # assumed


def in_heart(case: Case, robot: CatheterRobot) -> Surroundings:
    """Return the robot's model in the heart, in the sheath's frame.

    That is the robot's base frame at an insertion of zero: origin in the puncture, +z along the sheath into
    the atrium, +x where the robot bends first.
    """
    root = read(build_scene(robot, case.plan, tissue=True).text)
    root.part("statistic").set(center=(0.0, 0.0, 0.03))
    world = root.part("worldbody")
    there = from_valve(case)
    heart = Element("body", name="heart", pos=text(there[:3, 3]), quat=quaternion(there[:3, :3]))
    for child in list(world.children):
        if child.get("name") == CARRIER:
            child.set(pos=text((0.0, 0.0, waiting_m(robot))), quat=quaternion(np.eye(3)))
        elif child.tag != "light":
            heart.append(child)
    world.append(heart)
    stiffness = {region: WALL_N_PER_M if region == "wall" else LEAFLET_N_PER_M for region in REGIONS}
    return Surroundings(root.text(ALL_DIGITS), stiffness, (INSERTION,), stream(case))


def waiting_m(robot: CatheterRobot) -> float:
    """Return the insertion of the base at which the robot waits before the septum, < 0 [m]."""
    return -sum(segment.length_m for segment in robot.segments) - tip_to_end_m(robot) - WAITING_M


def from_valve(case: Case) -> Array:
    """Return the valve's frame in the sheath's frame, shape (4, 4)."""
    sheath = case.plan.base(0.0)
    R = sheath[:3, :3].T
    return transform(R, -R @ sheath[:3, 3])


def stream(case: Case) -> Callable[[float, Array], Array]:
    """Return the flow's force on the tip, shape (3,) [N], by time [s] and place [m]; sheath's frame."""
    R = from_valve(case)[:3, :3]
    flow = replace(case.flow, direction=R @ case.flow.direction)
    return partial(_force_N, flow)  # which can be pickled, as a function made here cannot


def _force_N(flow: Flow, time_s: float, tip_m: Array) -> Array:
    return flow.force_N(time_s, float(tip_m[2]))


def implant_target(case: Case, mount: Array) -> Array:
    """Return where the implant is wanted under the leaflets, sheath's frame, shape (4, 4).

    Its origin is the tool frame's, its x the way in which the arms open, its z the tool's.

    Args:
        case: the heart and the way.
        mount: of the implant in the tool's frame, shape (4, 4): a turn about z (`plan.implant_turn_rad`).
    """
    tool = case.plan.target.copy()
    tool[:3, 3] += case.plan.below_m * DOWN
    return from_valve(case) @ tool @ mount


def implant_frame(side: Array, direction: Array, place: Array) -> Array:
    """Return the frame of which x and z were seen, not quite at right angles, shape (4, 4)."""
    z = direction / np.linalg.norm(direction)
    x = side - (side @ z) * z
    x /= np.linalg.norm(x)
    return transform(np.stack([x, np.cross(z, x), z], axis=1), place)


def turned(angle_rad: float) -> Array:
    """Return a turn about z, shape (4, 4)."""
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    return transform(np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]]), np.zeros(3))
