"""What carries a robot's base, where it gives way along the axis: a body `mount` on a slide `mount`.

A tendon's straight run before the base is then part of its path, so that its tension presses on the
mount.
"""

from __future__ import annotations

from catheter_sim.core.robot import RobotSpec, has_mount_slide
from catheter_sim.mjcf.backend import mjcf
from catheter_sim.mjcf.names import MOUNT, feed

FEED_LENGTH_M = 0.02


def add_mount(root: mjcf.RootElement, robot: RobotSpec) -> mjcf.Element:
    """Return the body that carries the base: a new one where the mount gives way, or the world."""
    if not has_mount_slide(robot):
        return root.worldbody
    mount = root.worldbody.add("body", name=MOUNT, gravcomp=1.0)
    stiffness = robot.mount.axial_stiffness_N_per_m
    mount.add(
        "joint",
        name=MOUNT,
        type="slide",
        axis=(0, 0, 1),
        stiffness=stiffness,
        damping=stiffness * robot.dynamics.relaxation_time_s,
        armature=stiffness * robot.dynamics.inertia_time_s**2,
    )
    mount.add("inertial", pos=(0, 0, 0), mass=1e-3, diaginertia=(1e-9, 1e-9, 1e-9))
    return mount


def add_feed(root: mjcf.RootElement, robot: RobotSpec, name: str, xy: tuple[float, float]) -> None:
    """Add the site `feed_<name>` in the world, below the first hole of a tendon at `xy` [m]."""
    if has_mount_slide(robot):
        root.worldbody.add("site", name=feed(name), pos=(*xy, -FEED_LENGTH_M), size=(1e-4,), group=5)


def pass_feed(element: mjcf.Element, robot: RobotSpec, name: str) -> None:
    """Let a tendon's path begin at its feed, where there is one."""
    if has_mount_slide(robot):
        element.add("site", site=feed(name))
