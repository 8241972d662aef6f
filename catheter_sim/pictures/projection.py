"""Where a camera of the model sees a point: MuJoCo's pinhole camera as a projection matrix.

Image coordinates: u to the right and v down, in pixels, from the picture's top left corner; the pixel
in column c and row r covers c <= u < c + 1 and r <= v < r + 1, so its centre is at (c + 0.5, r + 0.5).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.errors import unknown


@dataclass(frozen=True)
class PinholeCamera:
    """A camera that looks along its -z axis, +x to the right of the picture and +y up.

    Attributes:
        p_w: where it stands, shape (3,) [m].
        R_wc: its axes in the base frame as columns, shape (3, 3).
        fovy_rad: angle between the picture's top and bottom edge [rad].
        width, height: of the picture [pixels]; pixels are square.
    """

    p_w: Array
    R_wc: Array
    fovy_rad: float
    width: int
    height: int


def model_camera(
    model: mujoco.MjModel, data: mujoco.MjData, name: str, width: int, height: int
) -> PinholeCamera:
    """Return the model's camera `name` as it stands in `data` (its kinematics up to date).

    The camera must be one that its field of view alone describes: no sensor size, not orthographic.

    Raises:
        InputError: the model has no such camera.
    """
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_CAMERA, name)
    if index < 0:
        raise unknown("camera", name, [model.camera(k).name for k in range(model.ncam)])
    return PinholeCamera(
        p_w=data.cam_xpos[index].copy(),
        R_wc=data.cam_xmat[index].reshape(3, 3).copy(),
        fovy_rad=math.radians(float(model.cam_fovy[index])),
        width=width,
        height=height,
    )


def projection_matrix(camera: PinholeCamera) -> Array:
    """Return P, shape (3, 4), with P (x, y, z, 1) = w (u, v, 1) for a point in the base frame [m]."""
    focal = camera.height / 2.0 / math.tan(camera.fovy_rad / 2.0)
    intrinsic = np.array(
        [
            [focal, 0.0, -camera.width / 2.0],
            [0.0, -focal, -camera.height / 2.0],
            [0.0, 0.0, -1.0],  # depth is along -z
        ]
    )
    R_cw = camera.R_wc.T
    return intrinsic @ np.column_stack([R_cw, -R_cw @ camera.p_w])


def project(matrix: Array, points: Array) -> Array:
    """Return the image coordinates (u, v) of `points`, shape (n, 3) [m], as shape (n, 2) [pixels]."""
    image = np.asarray(points) @ matrix[:, :3].T + matrix[:, 3]
    return image[:, :2] / image[:, 2:]
