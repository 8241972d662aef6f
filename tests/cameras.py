"""A model's own camera as a pinhole camera, to say where it sees a point."""

from __future__ import annotations

import math

import mujoco

from catheter_sim.pictures.images import PinholeCamera


def model_camera(
    model: mujoco.MjModel, data: mujoco.MjData, name: str, width: int, height: int
) -> PinholeCamera:
    """Return the model's camera `name` as it stands in `data` (its kinematics up to date).

    The camera must be one that its field of view alone describes: no sensor size, not orthographic.
    """
    index = model.camera(name).id
    return PinholeCamera(
        p_w=data.cam_xpos[index].copy(),
        R_wc=data.cam_xmat[index].reshape(3, 3).copy(),
        fovy_rad=math.radians(float(model.cam_fovy[index])),
        width=width,
        height=height,
    )
