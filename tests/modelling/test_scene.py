"""Cameras see the robot."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.mjcf.document import Element
from catheter_sim.modelling.build import add_scene, robot_length, views
from catheter_sim.pictures.images import project, projection_matrix
from tests.cameras import model_camera


def scene_model(name: str) -> mujoco.MjModel:
    root = Element("mujoco")
    add_scene(root, load_robot(name))
    return mujoco.MjModel.from_xml_string(root.text())


@pytest.mark.parametrize(
    "name", ["neuroendoscope", "neuroendoscope_section", "spacer_disk", "chest_tube", "chest_tube_section"]
)
@pytest.mark.parametrize("camera", ["side", "overview"])
def test_cameras_hold_the_robot_up_to_a_half_circle(name: str, camera: str) -> None:
    """Straight, or bent evenly by up to 180 deg to either side, the centreline stays in a 4:3 picture."""
    model = scene_model(name)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    matrix = projection_matrix(model_camera(model, data, camera, 640, 480))
    share = np.linspace(0.0, 1.0, 50)
    for angle in np.radians((1e-6, 45.0, -90.0, 135.0, 180.0, -180.0)):
        radius = robot_length(load_robot(name)) / angle
        x, z = radius * (1.0 - np.cos(angle * share)), radius * np.sin(angle * share)
        u, v = project(matrix, np.column_stack([x, np.zeros(50), z])).T
        assert (u > 5).all()
        assert (u < 635).all()
        assert (v > 5).all()
        assert (v < 475).all()


def test_side_camera_looks_along_y_with_z_up() -> None:
    """In the side view +x is to the right, +z is up, and depth does not move a point on the axis of view."""
    model = scene_model("neuroendoscope_section")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    matrix = projection_matrix(model_camera(model, data, "side", 640, 480))
    middle = {view.name: view for view in views(load_robot("neuroendoscope_section"))}["side"].target
    points = middle + np.array([(0, 0, 0), (0.01, 0, 0), (0, 0, 0.01), (0, 0.01, 0)])
    centre, right, up, far = project(matrix, points)
    assert centre == pytest.approx((320, 240), abs=1e-6)
    assert right[0] > centre[0]
    assert right[1] == pytest.approx(centre[1])
    assert up[1] < centre[1]
    assert far == pytest.approx(centre)
