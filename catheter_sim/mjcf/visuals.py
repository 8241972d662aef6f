"""The meshes that a robot's links show in its model: without mass, and touching nothing."""

from __future__ import annotations

import math
from collections.abc import Sequence

from catheter_sim.mjcf import catheter_visuals, meshes, rolling_links
from catheter_sim.mjcf._backend import mjcf
from catheter_sim.mjcf.meshes import Part
from catheter_sim.robots.catheter import CatheterRobot
from catheter_sim.robots.kinds import Robot, require_continuum
from catheter_sim.robots.rolling import RollingRobot

GROUP = 2  # MuJoCo's habit for what is only to be seen


def add_visuals(root: mjcf.RootElement, robot: Robot, bodies: Sequence[mjcf.Element]) -> None:
    """Add the meshes of `robot` to the model `root`, and geoms `<part>_<link>` (`Part.name_prefix`).

    Args:
        root: the model; its materials are those of `scene.add_scene`.
        robot: the robot.
        bodies: what carries the base (link 0), then the links' bodies from base to tip.
    """
    if isinstance(robot, RollingRobot):
        solids = rolling_links.link_meshes(robot)
    elif isinstance(robot, CatheterRobot):
        solids = catheter_visuals.body_meshes(robot)
    else:
        solids = meshes.element_meshes(require_continuum(robot, "the scene"))
    for key, mesh in solids.items():
        vertex, face = meshes.inline(mesh)
        root.asset.add("mesh", name=key, vertex=vertex, face=face)
    for index, body in enumerate(bodies):
        for part in _parts(robot, index):
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


def _parts(robot: Robot, index: int) -> tuple[Part, ...]:
    if isinstance(robot, RollingRobot):
        return rolling_links.link_parts(robot, index)
    if isinstance(robot, CatheterRobot):
        return catheter_visuals.body_parts(robot, index)
    return meshes.element_parts(require_continuum(robot, "the scene"), index)
