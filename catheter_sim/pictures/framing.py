"""Where to put the camera so that a robot's whole motion fills the picture."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from itertools import product

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.modelling.scene import FOVY_DEG, View
from catheter_sim.pictures.state import State, put

_MARGIN = 1.06  # picture over what is to be seen
_VISIBLE_GROUPS = 3  # MuJoCo shows the geom groups 0 to 2


def swept_points(model: mujoco.MjModel, states: Iterable[State]) -> Array:
    """Return points that enclose what is drawn in all `states`, shape (n, 3) [m]: the corners of its boxes.

    Args:
        model: the robot; it is left in the last state.
        states: of its simulator.
    """
    data = mujoco.MjData(model)
    shown = model.geom_group < _VISIBLE_GROUPS
    middle, half = model.geom_aabb[shown, :3], model.geom_aabb[shown, 3:]
    clouds = []
    for state in states:
        put(state, model, data)
        turned = data.geom_xmat[shown].reshape(-1, 3, 3)
        for side in product((-1.0, 1.0), repeat=3):
            corner = middle + half * side
            clouds.append(data.geom_xpos[shown] + (turned @ corner[:, :, np.newaxis])[:, :, 0])
    return np.concatenate(clouds)


def fitted_view(view: View, points: Array, width: int, height: int) -> View:
    """Return a view along the same direction as `view` that just holds `points`.

    Args:
        view: whose direction is kept.
        points: to be seen, shape (n, 3) [m].
        width, height: of the picture [pixels].
    """
    right, up = view.axes
    half = math.tan(math.radians(FOVY_DEG / 2.0))
    across, along, toward = points @ right, points @ up, points @ view.backward
    middle = [(values.min() + values.max()) / 2.0 for values in (across, along, toward)]
    needed = np.maximum(np.abs(along - middle[1]), np.abs(across - middle[0]) * height / width)
    # A point nearer to the camera than the target needs more room.
    distance = float((_MARGIN * needed / half + toward - middle[2]).max())
    target = middle[0] * right + middle[1] * up + middle[2] * view.backward
    return View(view.name, target, view.backward, 2.0 * distance * half)


def free_camera(view: View) -> mujoco.MjvCamera:
    """Return MuJoCo's free camera, whose field of view is `FOVY_DEG`, standing at `view`."""
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat[:] = view.target
    camera.distance = float(np.linalg.norm(view.position - view.target))
    forward = -view.backward
    camera.azimuth = math.degrees(math.atan2(forward[1], forward[0]))
    camera.elevation = math.degrees(math.asin(forward[2]))
    return camera


def emptiest_corner(
    view: View,
    points: Array,
    width: int,
    height: int,
    size: tuple[int, int],
    taken: Collection[tuple[int, int]] = (),
) -> tuple[int, int]:
    """Return the corner (row, column: 0 first, 1 last) where a small rectangle hides the fewest points.

    Args:
        view: what the picture shows.
        points: shape (n, 3) [m].
        width, height: of the picture [pixels].
        size: width and height of the rectangle [pixels].
        taken: corners that are no choice.
    """
    right, up = view.axes
    scale = height / view.height
    u = (points - view.target) @ right * scale + width / 2.0
    v = -((points - view.target) @ up) * scale + height / 2.0
    hidden = {
        (row, column): int(
            (
                ((v > height - size[1]) if row else (v < size[1]))
                & ((u > width - size[0]) if column else (u < size[0]))
            ).sum()
        )
        for row in (0, 1)
        for column in (0, 1)
        if (row, column) not in taken
    }
    return min(hidden, key=lambda corner: hidden[corner])
