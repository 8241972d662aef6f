"""Pictures of a simulated robot and its target, drawn without a screen."""

from __future__ import annotations

import copy
from typing import Any

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.envs.arguments import checked_whole
from catheter_sim.errors import InputError, shown
from catheter_sim.modelling.scene import View
from catheter_sim.pictures.backend import LARGEST_SIDE, SMALLEST_SIDE, open_renderer
from catheter_sim.pictures.framing import free_camera
from catheter_sim.pictures.images import Picture
from catheter_sim.pictures.state import State, put

_ROUND = 16  # corners of the target's outline: the model's thin tendons do with fewer
# Small pictures, as they are observed: without a graphics card it is the triangles that take time, and four
# samples of each more than thrice as many pixels a side, whose mean is smoother.
_SMALL = 128  # pixels a side
_FINER = 3
_SMALL_ROUND = 8
_TARGET_RGBA = (0.10, 0.62, 0.25, 0.75)


def checked_size(width: Any, height: Any, default: tuple[int, int]) -> tuple[int, int]:
    """Return width and height of a picture [pixels]; `default` for what is None.

    Raises:
        InputError: one is no whole number, or not a picture's.
    """
    sides = [
        given if side is None else checked_whole(name, side)
        for name, side, given in (("width", width, default[0]), ("height", height, default[1]))
    ]
    least = SMALLEST_SIDE if max(sides) > _SMALL else -(-SMALLEST_SIDE // _FINER)
    for name, side in zip(("width", "height"), sides, strict=True):
        if not least <= side <= LARGEST_SIDE:
            raise InputError(f"{name} = {shown(side)}: a picture has {least} to {LARGEST_SIDE} pixels a side")
    return sides[0], sides[1]


class TargetPicture:
    """An open renderer; model and state are its own, so that drawing leaves the simulation alone."""

    def __init__(self, model: mujoco.MjModel, view: View, width: int, height: int) -> None:
        """Open the renderer.

        Args:
            model: the robot; a copy of it is drawn.
            view: where to look from.
            width, height: [pixels].

        Raises:
            InputError: the size is no picture's, or no OpenGL context can be had.
        """
        model = copy.copy(model)
        quality = model.vis.quality
        if max(width, height) <= _SMALL:
            self._finer = _FINER
            quality.offsamples = 0
            quality.numslices, quality.numstacks = _SMALL_ROUND, _SMALL_ROUND // 2
        else:
            self._finer = 1
            quality.numslices = max(quality.numslices, _ROUND)
            quality.numstacks = max(quality.numstacks, _ROUND // 2)
        self._size = height, width
        self._renderer = open_renderer(model, self._finer * width, self._finer * height)
        self._model = model
        self._data = mujoco.MjData(model)
        self._camera = free_camera(view)
        self._options = mujoco.MjvOption()
        self._options.sitegroup[:] = 0

    def draw(self, state: State, target_m: Array, radius_m: float) -> Picture:
        """Return the robot in `state` with a sphere at `target_m`, shape (height, width, 3)."""
        put(state, self._model, self._data)
        self._renderer.update_scene(self._data, self._camera, self._options)
        scene = self._renderer.scene
        if scene.ngeom < scene.maxgeom:
            mujoco.mjv_initGeom(
                scene.geoms[scene.ngeom],
                mujoco.mjtGeom.mjGEOM_SPHERE,
                np.full(3, radius_m),
                target_m,
                np.eye(3).ravel(),
                np.array(_TARGET_RGBA, dtype=np.float32),
            )
            scene.ngeom += 1
        picture: Picture = self._renderer.render()
        if self._finer == 1:
            return picture
        height, width = self._size
        parts = picture.reshape(height, self._finer, width, self._finer, 3)
        return np.rint(parts.mean(axis=(1, 3))).astype(np.uint8)

    def close(self) -> None:
        """Free the renderer."""
        self._renderer.close()
