"""What carries a robot's base, where it gives way along the axis: a body `mount` on a slide `mount`."""

from __future__ import annotations

from catheter_sim.core.robot import RobotSpec, has_mount_slide
from catheter_sim.mjcf.document import Element
from catheter_sim.mjcf.names import MOUNT


def add_mount(root: Element, robot: RobotSpec) -> Element:
    """Return the body that carries the base: a new one where the mount gives way, or the world."""
    if not has_mount_slide(robot):
        return root.part("worldbody")
    mount = root.part("worldbody").add("body", name=MOUNT, gravcomp=1.0)
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
