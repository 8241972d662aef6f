"""Render check: do the robot's pixels lie where an analytic model says that its centreline is?

The chain from a posture through the written model, the engine's kinematics and meshes to pixels is
closed independently: the analytic centreline is projected by the camera's known matrix
(`catheter_sim.pictures.projection`), and the pixels come from a segmentation render of the geoms that
show the centreline alone (`catheter_sim.pictures.centreline`).
"""

from __future__ import annotations

import copy
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import RobotSpec
from catheter_sim.pictures.backend import open_renderer
from catheter_sim.pictures.centreline import centreline, shows_centreline
from catheter_sim.pictures.projection import model_camera, project, projection_matrix

WIDTH, HEIGHT = 640, 480  # pixels
TOLERANCE_PX = 1.0  # largest mean distance of a right model
_BIN_PX = 8.0  # length of centreline over which pixels are averaged
_END_PX = 2.0  # an end face's pixels lie within this length


@dataclass(frozen=True)
class RenderCheck:
    """How far the rendered centreline lies from the analytic one.

    Attributes:
        mean_px: mean distance between points at the same share of both centrelines' lengths.
        largest_px: the largest such distance.
        length_ratio: rendered by analytic length in the picture.
        pixels: how many pixels show the centreline's geoms.
        rendered: its centreline in the picture, shape (m, 2) [pixels].
        expected: the analytic points that belong to it, shape (m, 2) [pixels].
    """

    mean_px: float
    largest_px: float
    length_ratio: float
    pixels: int
    rendered: Array
    expected: Array

    @property
    def passed(self) -> bool:
        """Whether the mean distance is within the tolerance; undefined is not."""
        return bool(self.mean_px <= TOLERANCE_PX)


def check_render(
    robot: RobotSpec,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    posture: Posture,
    camera: str = "side",
    width: int = WIDTH,
    height: int = HEIGHT,
) -> RenderCheck:
    """Return how far the model as it stands in `data` is drawn from the analytic `posture`.

    Args:
        robot: the robot.
        model, data: its simulation, kinematics up to date.
        posture: of the analytic model under the same inputs.
        camera: a camera of the model that sees the whole robot.
        width, height: of the picture [pixels].

    Raises:
        InputError: unknown camera, or nothing to draw with.
    """
    matrix = projection_matrix(model_camera(model, data, camera, width, height))
    mask = centreline_mask(robot, model, data, camera, width, height)
    return compare(mask, project(matrix, centreline(robot, posture)))


def centreline_mask(
    robot: RobotSpec, model: mujoco.MjModel, data: mujoco.MjData, camera: str, width: int, height: int
) -> NDArray:
    """Return which pixels show what the centreline is the middle of, shape (height, width), bool.

    Nothing else is drawn, so that nothing is hidden.
    """
    alone = copy.copy(model)
    names = [alone.geom(k).name for k in range(alone.ngeom)]
    alone.geom_group[:] = [0 if shows_centreline(robot, name) else 1 for name in names]
    options = mujoco.MjvOption()
    options.geomgroup[:] = [1, 0, 0, 0, 0, 0]
    for groups in (options.sitegroup, options.tendongroup, options.skingroup, options.actuatorgroup):
        groups[:] = 0
    with open_renderer(alone, width, height) as renderer:
        renderer.enable_segmentation_rendering()
        renderer.update_scene(data, camera=camera, scene_option=options)
        kinds = renderer.render()[:, :, 1]
    return kinds == int(mujoco.mjtObj.mjOBJ_GEOM)


def compare(mask: NDArray, curve: Array) -> RenderCheck:
    """Return the distance between the centreline of the pixels in `mask` and the polyline `curve`.

    The pixels are sorted along `curve`, prolonged straight at both ends, and averaged in short
    stretches: the rendered centreline. Each of its points is compared with the point of `curve` at the
    same share of the length, so that a robot drawn too short or too long counts like one bent wrongly.

    Args:
        mask: pixels whose middle is the centreline, shape (height, width), bool.
        curve: image coordinates, shape (n, 2) [pixels].
    """
    row, column = np.nonzero(mask)
    pixels = np.stack([column, row], axis=1).astype(np.float64) + 0.5
    if len(pixels) == 0:
        nothing = np.zeros((0, 2))
        return RenderCheck(np.nan, np.nan, 0.0, 0, nothing, nothing)
    curve = curve[np.concatenate([[True], np.linalg.norm(np.diff(curve, axis=0), axis=1) > 1e-9])]
    station, aside, length = _stations(pixels, curve)
    first, last = -_end(-station, aside), _end(station, aside)
    count = max(2, round((last - first) / _BIN_PX))
    index = np.clip(((station - first) / (last - first) * count).astype(int), 0, count - 1)
    number = np.bincount(index, minlength=count)
    shown = number > 0

    def mean(values: Array) -> Array:
        return np.bincount(index, values, minlength=count)[shown] / number[shown]

    rendered = np.stack([mean(pixels[:, 0]), mean(pixels[:, 1])], axis=1)
    share = (mean(station) - first) / (last - first)
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    expected = np.stack([np.interp(share * length, arc, curve[:, axis]) for axis in (0, 1)], axis=1)
    distance = np.linalg.norm(rendered - expected, axis=1)
    return RenderCheck(
        mean_px=float(distance.mean()),
        largest_px=float(distance.max()),
        length_ratio=float((last - first) / length),
        pixels=len(pixels),
        rendered=rendered,
        expected=expected,
    )


def _end(station: Array, aside: Array) -> float:
    """Return the station at which the pixels end, to a fraction of a pixel.

    In each pixel-wide line along the backbone the last pixel's centre lies half a pixel, on average,
    before the end; so averaging over the lines that reach the end finds a tilted end face too.
    """
    line = np.round(aside).astype(int)
    lasts = np.array([station[line == value].max() for value in np.unique(line)])
    return float(lasts[lasts > lasts.max() - _END_PX].mean()) + 0.5


def _stations(pixels: Array, curve: Array) -> tuple[Array, Array, float]:
    """Return each pixel's place along `curve` and beside it, and the curve's length [pixels].

    Beyond the ends the curve goes on straight: stations below 0 and above the length.
    """
    step = np.diff(curve, axis=0)
    size = np.linalg.norm(step, axis=1)
    along = step / size[:, np.newaxis]
    begin = np.concatenate([[0.0], np.cumsum(size)[:-1]])
    best = np.full(len(pixels), np.inf)
    station, aside = np.zeros(len(pixels)), np.zeros(len(pixels))
    for k in range(len(step)):
        offset = pixels - curve[k]
        t = offset @ along[k]
        t = np.clip(t, -np.inf if k == 0 else 0.0, np.inf if k == len(step) - 1 else size[k])
        squared = ((offset - t[:, np.newaxis] * along[k]) ** 2).sum(axis=1)
        closer = squared < best
        best[closer] = squared[closer]
        station[closer] = begin[k] + t[closer]
        aside[closer] = offset[closer] @ (-along[k, 1], along[k, 0])
    return station, aside, float(size.sum())
