"""The camera is put where everything that is to be seen just fits."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from catheter_sim.modelling.build import FOVY_DEG, View
from catheter_sim.pictures.images import PinholeCamera, project, projection_matrix
from catheter_sim.pictures.offscreen import fitted_view, free_camera

OBLIQUE = np.array([0.48, -0.8, 0.36])
FROM_AFAR = View("any", np.zeros(3), OBLIQUE, 1.0)


def in_picture(view: View, points: np.ndarray, width: int, height: int) -> np.ndarray:
    right, up = view.axes
    axes = np.column_stack([right, up, view.backward])
    camera = PinholeCamera(view.position, axes, math.radians(FOVY_DEG), width, height)
    return project(projection_matrix(camera), points)


@pytest.mark.parametrize("size", [(1280, 720), (480, 640)])
def test_fitted_view_holds_all_points_and_wastes_little(size: tuple[int, int]) -> None:
    """Random clouds lie inside of the picture, and reach over two thirds of it in one direction."""
    print("seed 11")
    rng = np.random.default_rng(11)
    for _ in range(20):
        points = rng.normal(size=(40, 3)) * rng.uniform(0.01, 0.2, size=3) + rng.normal(size=3)
        image = in_picture(fitted_view(FROM_AFAR, points, *size), points, *size)
        assert (image > 0).all()
        assert (image < size).all()
        assert max(np.ptp(image, axis=0) / size) > 2 / 3


def test_free_camera_stands_where_the_view_says() -> None:
    """MuJoCo's own scene reports the view's place, direction and upward direction."""
    view = View("any", np.array([0.01, -0.02, 0.05]), OBLIQUE, 0.2)
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    model.vis.global_.fovy = FOVY_DEG
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    scene = mujoco.MjvScene(model, maxgeom=10)
    mujoco.mjv_updateScene(
        model, data, mujoco.MjvOption(), None, free_camera(view), mujoco.mjtCatBit.mjCAT_ALL, scene
    )
    eyes = [scene.camera[side] for side in (0, 1)]  # left and right eye, a little apart
    assert np.mean([eye.pos for eye in eyes], axis=0) == pytest.approx(view.position, abs=1e-6)
    assert eyes[0].forward == pytest.approx(-view.backward, abs=1e-6)
    assert eyes[0].up == pytest.approx(view.axes[1], abs=1e-6)
