"""A robot in surroundings, as an environment drives it: its base on a slide, and tissue around it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.mjcf.document import Element, read
from catheter_sim.modelling.attach import carry, text, touching
from catheter_sim.modelling.build import remembered_mjcf

_SHORT = 1.5  # outer radii: an element that is shorter touches with a ball at its far face


@dataclass(frozen=True)
class Surroundings:
    """A robot's model in surroundings."""

    text: str  # MJCF, with the names and the order of `build_mjcf` and with geoms `tissue_<region>_<k>`
    tissue_N_per_m: Mapping[str, float]  # stiffness of each region under one element of the robot
    carriage: tuple[str, ...]  # names of the joints, and of the actuators, that move the robot's base
    # Force of a moving fluid on the tip, shape (3,) [N], in the model's frame, from the time since the
    # episode's start [s] and the place of the tip, shape (3,) [m]; None: nothing moves.
    stream_N: Callable[[float, Array], Array] | None = None


def on_a_slide(robot: RobotSpec, actuation: str, tip_z_m: float) -> tuple[Element, float]:
    """Return the robot's own model, straight along z up to `tip_z_m`, and its length [m].

    Its base is carried by a slide and a roll, and every element of it touches.
    """
    root = read(remembered_mjcf(robot, actuation))
    length = sum(segment.length_m for segment in robot.segments)
    base = np.eye(4)
    base[2, 3] = tip_z_m - length
    carry(root, robot.dynamics, base, roll=True)
    let_touch(robot, root.part("worldbody"))
    return root, length


# From the robot, effects built in, and its actuation to its model in surroundings.
Surround = Callable[[RobotSpec, str], Surroundings]


def let_touch(robot: RobotSpec, world: Element) -> None:
    """Give every cell or link of a robot what touches: a ball at its far face, or a capsule along it."""
    ends, radii, lengths = [], [], []
    for segment in robot.segments:
        count = getattr(segment, "joints", 0) or getattr(segment, "disks", 0)
        radii += [segment.outer_radius_m] * count
        lengths += [segment.length_m / count] * count
    for site in world.every("site"):
        name = site.get("name", "")
        if name.startswith("face_"):
            ends.append((site.parent, int(name[len("face_") :]), site.numbers("pos")[2]))
    for body, number, face in ends:
        radius, length = radii[number - 1], lengths[number - 1]
        shape: dict[str, Any] = {"type": "sphere", "size": radius, "pos": text((0, 0, face))}
        if length > _SHORT * radius:
            ends_at = text((0, 0, face - length, 0, 0, face))
            shape = {"type": "capsule", "size": radius, "fromto": ends_at}
        touching(body, name=f"touch_{number}", **shape)
