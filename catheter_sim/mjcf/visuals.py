"""The meshes that a robot's links show in its model: without mass, and touching nothing."""

from __future__ import annotations

import math
from collections.abc import Sequence

from catheter_sim.mjcf._backend import mjcf
from catheter_sim.mjcf.meshes import element_meshes, element_parts, inline
from catheter_sim.robots.specification import ContinuumRobot

GROUP = 2  # MuJoCo's habit for what is only to be seen


def add_visuals(root: mjcf.RootElement, robot: ContinuumRobot, bodies: Sequence[mjcf.Element]) -> None:
    """Add the meshes of `robot` to the model `root`, and geoms `<guide|backbone|disk>_<link>`.

    Args:
        root: the model; its materials are those of `scene.add_scene`.
        robot: the robot.
        bodies: what carries the base (link 0), then the links' bodies from base to tip.
    """
    for key, mesh in element_meshes(robot).items():
        vertex, face = inline(mesh)
        root.asset.add("mesh", name=key, vertex=vertex, face=face)
    for index, body in enumerate(bodies):
        for part in element_parts(robot, index):
            body.add(
                "geom",
                name=f"{part.name_prefix}_{index}",
                type="mesh",
                mesh=part.mesh_key,
                pos=(0.0, 0.0, part.z_offset),
                quat=(math.cos(part.z_turn / 2.0), 0.0, 0.0, math.sin(part.z_turn / 2.0)),
                rgba=part.rgba,
                material=part.material,
                group=GROUP,
                contype=0,
                conaffinity=0,
                mass=0.0,
            )
