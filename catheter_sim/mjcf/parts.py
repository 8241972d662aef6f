"""Parts that every robot's model has: mount, sites, tendons, actuators."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import trimesh

from catheter_sim.core.robot import RobotSpec, has_mount_slide
from catheter_sim.mjcf.document import ALL_DIGITS, Element
from catheter_sim.mjcf.names import MOUNT, feed, tendon
from catheter_sim.mjcf.solids import Colour

# ----------------------------------------------------------------------------------------------------
# What carries a robot's base, where it gives way along the axis: a body `mount` on a slide `mount`.


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


# ----------------------------------------------------------------------------------------------------
# The meshes that a robot's links show in its model: without mass, and touching nothing.

_LEAST_VOLUME_M3 = 2e-15  # MuJoCo takes no smaller mesh for a solid than half of it; as a shell it does
GROUP = 2  # MuJoCo's habit for what is only to be seen
SEEN: Mapping[str, Any] = {"type": "mesh", "group": GROUP, "contype": 0, "conaffinity": 0, "mass": 0}


@dataclass(frozen=True)
class Part:
    """One mesh that a link shows.

    Attributes:
        mesh_key: name of the mesh.
        name_prefix: what it is ("backbone"); the geom's name is `<prefix>_<link>`.
        z_offset: where the mesh's origin lies along the link's z [m].
        z_turn: by how much the mesh is turned about the link's z [rad]: the holes' rest twist.
        rgba: its colour.
        material: name of a material of `modelling.build.add_scene`.
        is_backbone: whether the render check looks at it.
    """

    mesh_key: str
    name_prefix: str
    z_offset: float
    z_turn: float
    rgba: Colour
    material: str
    is_backbone: bool


def inline(mesh: trimesh.Trimesh) -> tuple[str, str]:
    """Return the `vertex` and `face` texts of an MJCF mesh, vertices to a nanometre."""
    vertices = np.round(mesh.vertices, 9) + 0.0  # + 0.0 turns -0 into 0
    vertex = " ".join(f"{value:.9g}" for value in vertices.ravel())
    return vertex, " ".join(str(index) for index in mesh.faces.ravel())


def add_mesh(root: Element, name: str, mesh: trimesh.Trimesh, shell: bool | np.bool = False) -> None:
    """Add a mesh; as a shell it may be open, or too small for a solid."""
    vertex, face = inline(mesh)
    inertia = "shell" if shell else None
    root.part("asset").add("mesh", name=name, vertex=vertex, face=face, inertia=inertia)


def add_parts(
    root: Element,
    bodies: Sequence[Element],
    meshes: Mapping[str, trimesh.Trimesh],
    parts_of: Callable[[int], tuple[Part, ...]],
) -> None:
    """Add `meshes` to the model `root`, and geoms `<part>_<link>` (`Part.name_prefix`).

    Args:
        root: the model; its materials are those of `modelling.build.add_scene`.
        bodies: what carries the base (link 0), then the links' bodies from base to tip.
        meshes: every mesh that a part names.
        parts_of: what a link shows, by its number.
    """
    for key, mesh in meshes.items():
        add_mesh(root, key, mesh, abs(mesh.volume) < _LEAST_VOLUME_M3)
    for index, body in enumerate(bodies):
        for part in parts_of(index):
            body.add(
                "geom",
                name=f"{part.name_prefix}_{index}",
                mesh=part.mesh_key,
                pos=(0.0, 0.0, part.z_offset),
                quat=(math.cos(part.z_turn / 2.0), 0.0, 0.0, math.sin(part.z_turn / 2.0)),
                rgba=part.rgba,
                material=part.material,
                **SEEN,
            )


# ----------------------------------------------------------------------------------------------------
# Tendons as every kind of robot has them: the sites that they pass, and the actuators that pull them.
#
# Where the mount gives way, a tendon's straight run before the base is part of its path, so that its
# tension presses on the mount.

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
