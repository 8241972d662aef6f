"""A robot that is only seen: hinges that a test sets, no forces."""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np
import pytest

from catheter_sim.mjcf.parts import inline
from catheter_sim.modelling.build import View, views
from catheter_sim.robots.continuum import description
from catheter_sim.robots.continuum.picture import element_meshes, element_parts
from catheter_sim.robots.continuum.spec import ContinuumRobot

Pose = Callable[[ContinuumRobot, np.ndarray], tuple[mujoco.MjModel, mujoco.MjData]]


def camera_xml(view: View) -> str:
    numbers = " ".join(f"{value:.9g}" for value in view.axes.ravel())
    place = " ".join(f"{value:.9g}" for value in view.position)
    return f'<camera name="{view.name}" pos="{place}" xyaxes="{numbers}" fovy="{view.fovy_deg}"/>'


def planar_chain_xml(robot: ContinuumRobot) -> str:
    """Return a chain of the robot's links with one hinge each about y, not written by the package."""

    def geoms(link: int) -> str:
        return "".join(
            f'<geom name="{part.name_prefix}_{link}" type="mesh" mesh="{part.mesh_key}" '
            f'pos="0 0 {part.z_offset}" mass="0" contype="0" conaffinity="0"/>'
            for part in element_parts(robot, link)
        )

    assets = ""
    for key, mesh in element_meshes(robot).items():
        vertex, face = inline(mesh)
        assets += f'<mesh name="{key}" vertex="{vertex}" face="{face}"/>'
    opened, below = geoms(0), 0.0
    chain = description.links(robot)
    for link in chain:
        opened += (
            f'<body pos="0 0 {link.hinge_z_m - below}"><joint name="x{link.index}" axis="0 1 0"/>'
            f'<inertial pos="0 0 0" mass="1e-3" diaginertia="1e-6 1e-6 1e-6"/>{geoms(link.index)}'
        )
        below = link.hinge_z_m
    cameras = "".join(camera_xml(view) for view in views(robot))
    length = chain[-1].face_z_m
    return (
        f'<mujoco><statistic extent="{length}" center="0 0 {length / 2}"/><asset>{assets}</asset>'
        f"<worldbody>{cameras}{opened}{'</body>' * len(chain)}</worldbody></mujoco>"
    )


@pytest.fixture(scope="session")
def posed_chain() -> Pose:
    """Return a function from a planar robot and its hinge angles [rad] to a model posed so."""
    known: dict[str, mujoco.MjModel] = {}

    def pose(robot: ContinuumRobot, angles: np.ndarray) -> tuple[mujoco.MjModel, mujoco.MjData]:
        if robot.name not in known:
            known[robot.name] = mujoco.MjModel.from_xml_string(planar_chain_xml(robot))
        model = known[robot.name]
        data = mujoco.MjData(model)
        data.qpos[:] = angles
        mujoco.mj_forward(model, data)
        return model, data

    return pose
