"""Tendons as every kind of robot has them: the sites that they pass, and the actuators that pull them.

Where the mount gives way, a tendon's straight run before the base is part of its path, so that its tension
presses on the mount.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from catheter_sim.core.robot import RobotSpec, has_mount_slide
from catheter_sim.mjcf.colours import Colour
from catheter_sim.mjcf.document import ALL_DIGITS, Element
from catheter_sim.mjcf.names import feed, tendon

FEED_LENGTH_M = 0.02
MAX_TENSION_N = 100.0  # control range of a tension actuator


def add_site(body: Element, name: str, pos: Sequence[float]) -> None:
    """Add a site that is not drawn: a hole, a face's middle."""
    body.add("site", name=name, pos=pos, size=1e-4, group=5)


def add_feed(root: Element, robot: RobotSpec, name: str, xy: tuple[float, float]) -> None:
    """Add the site `feed_<name>` in the world, below the first hole of a tendon at `xy` [m]."""
    if has_mount_slide(robot):
        add_site(root.part("worldbody"), feed(name), (*xy, -FEED_LENGTH_M))


def pass_feed(element: Element, robot: RobotSpec, name: str) -> None:
    """Let a tendon's path begin at its feed, where there is one."""
    if has_mount_slide(robot):
        element.add("site", site=feed(name))


def add_spatial(root: Element, name: str, width_m: float, colour: Colour) -> Element:
    """Add a tendon that passes no site yet, drawn with the radius `width_m`."""
    return root.part("tendon").add("spatial", name=tendon(name), width=width_m, rgba=colour)


def rest_lengths(root: Element, robot: RobotSpec) -> np.ndarray:
    """Return the tendons' lengths in the unloaded robot, in the robot's order [m]; they must be there."""
    model = mujoco.MjModel.from_xml_string(root.text(ALL_DIGITS))
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos_spring
    mujoco.mj_fwdPosition(model, data)
    return np.array([data.ten_length[model.tendon(tendon(item.name)).id] for item in robot.tendons])


def add_tension_actuators(root: Element, robot: RobotSpec) -> None:
    """Add an actuator for each tendon whose control is its tension [N]; the tendons must be there."""
    for name in (tendon(item.name) for item in robot.tendons):
        limits = (0, MAX_TENSION_N)
        root.part("actuator").add("motor", name=name, tendon=name, gear=-1, ctrlrange=limits)


def add_puller(root: Element, name: str, tendon_name: str, stiffness: float, at_rest_N: float) -> None:
    """Add an actuator that takes a displacement [m]: a spring [N/m] that pulls only.

    Its force is `at_rest_N` - stiffness (displacement + the tendon's length) where that is below zero.
    """
    root.part("actuator").add(
        "general",
        name=name,
        tendon=tendon_name,
        biastype="affine",
        gainprm=-stiffness,
        biasprm=(at_rest_N, -stiffness, 0.0),
        forcerange=(-1e9, 0.0),
    )
