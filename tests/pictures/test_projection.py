"""The projection matrix says where a point is drawn."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from catheter_sim.pictures.images import (
    PinholeCamera,
    open_renderer,
    project,
    projection_matrix,
)
from tests.cameras import model_camera

POINTS = np.array(
    [(0.0, 0.0, 0.0), (0.3, 0.1, -0.2), (-0.35, 0.4, 0.25), (0.2, -0.5, 0.3), (-0.1, 0.6, -0.33)]
)


def test_spheres_are_drawn_where_the_matrix_says() -> None:
    """Small spheres in front of an oblique camera, near and far: drawn within 0.3 px of the point."""
    spheres = "".join(f'<geom type="sphere" size="0.02" pos="{x} {y} {z}"/>' for x, y, z in POINTS)
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><statistic extent="1"/><worldbody>{spheres}
        <camera name="eye" pos="0.4 -3 0.7" xyaxes="1 0.15 0 -0.03 0.2 1" fovy="27"/>
        </worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    width, height = 640, 480
    with open_renderer(model, width, height) as renderer:
        renderer.enable_segmentation_rendering()
        renderer.update_scene(data, camera="eye")
        drawn = renderer.render()[:, :, 0]
    expected = project(projection_matrix(model_camera(model, data, "eye", width, height)), POINTS)
    for index, point in enumerate(expected):
        row, column = np.nonzero(drawn == index)
        assert len(row) > 20
        assert (column.mean() + 0.5, row.mean() + 0.5) == pytest.approx(tuple(point), abs=0.3)


def test_field_of_view_spans_the_height() -> None:
    """Points at half the field of view up and down fall on the picture's upper and lower edge."""
    camera = PinholeCamera(np.zeros(3), np.eye(3), math.radians(40.0), 200, 100)
    edge = math.tan(math.radians(20.0))
    image = project(projection_matrix(camera), np.array([(0, 0, -1), (0, edge, -1), (0, -2 * edge, -2)]))
    assert image == pytest.approx(np.array([(100, 50), (100, 0), (100, 100)]))
