"""Pictures of a robot in given states, from one place that holds them all, with what they are read by."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass

import mujoco
import numpy as np

from catheter_sim.core.robot import RobotSpec
from catheter_sim.mjcf.names import TIP
from catheter_sim.modelling.scene import FOVY_DEG, View, views
from catheter_sim.pictures.backend import SMALLEST_SIDE, open_renderer
from catheter_sim.pictures.framing import emptiest_corner, fitted_view, free_camera, swept_points
from catheter_sim.pictures.images import Picture, caption_size, with_caption, with_inset, with_words
from catheter_sim.pictures.measures import legend_size, scale_size, with_scale, with_tension_legend
from catheter_sim.pictures.overlaid import overlaid
from catheter_sim.pictures.projection import PinholeCamera, project, projection_matrix
from catheter_sim.pictures.state import State, put
from catheter_sim.pictures.tendon_paint import PulledTendons, paint_tendons, pulled_tendons

_INSET = 0.42  # side of the close-up over the picture's height
_LEAST_TENSION_N = 1e-6  # less is no tension to paint

Corner = tuple[int, int]


@dataclass(frozen=True)
class _Layout:
    """From where a robot is seen, and what lies in which corner of its picture; None: nothing."""

    view: View
    pulled: PulledTendons
    full_N: float
    inset: Corner | None
    side: int
    caption: Corner
    legend: Corner | None
    scale: Corner | None


def draw(
    robot: RobotSpec,
    model: mujoco.MjModel,
    states: Sequence[State],
    captions: Sequence[Sequence[str]],
    width: int,
    height: int,
    camera: str = "overview",
    close_up: bool = True,
    measures: bool = True,
) -> Iterator[Picture]:
    """Yield one picture for each of `states`, all from one place that holds them all.

    Args:
        robot: the robot.
        model: its model; it is left in the last state.
        states: of its simulator; their tendons are painted where they have tensions.
        captions: lines of text for each state.
        width, height: [pixels].
        camera: a view of the robot (`modelling.scene.views`).
        close_up: show the cells at the base, in the corner that the robot leaves free.
        measures: show a scale bar, the base frame's axes, and what the tendons' colours mean.
    """
    layout = _layout(robot, model, states, captions[-1], (width, height), camera, close_up, measures)
    detail = next(view for view in views(robot) if view.name == "detail")
    data = mujoco.MjData(model)
    with ExitStack() as opened:
        large = opened.enter_context(open_renderer(model, width, height))
        small = None
        if layout.inset is not None:
            small = opened.enter_context(open_renderer(model, layout.side, layout.side))
        for state, lines in zip(states, captions, strict=True):
            put(state, model, data)
            _set_scene(large, layout.view, layout, state, model, data)
            image = large.render()
            if small is not None and layout.inset is not None:
                _set_scene(small, detail, layout, state, model, data)
                image = with_inset(image, small.render(), layout.inset)
            yield with_caption(_with_measures(image, layout), lines, layout.caption)


def draw_together(
    robot: RobotSpec,
    model: mujoco.MjModel,
    states: Sequence[State],
    labels: Sequence[str],
    caption: Sequence[str],
    width: int,
    height: int,
    camera: str = "overview",
) -> Picture:
    """Return one picture of all `states`, the last in full colours, each with its label at its tip.

    Arguments are those of `draw`; `caption` is the picture's.
    """
    layout = _layout(robot, model, states, caption, (width, height), camera, False, True)
    matrix = projection_matrix(_pinhole(layout.view, width, height))
    data = mujoco.MjData(model)
    images, depths, tips = [], [], []
    with open_renderer(model, width, height) as renderer:
        for state in states:
            put(state, model, data)
            _set_scene(renderer, layout.view, layout, state, model, data)
            images.append(renderer.render())
            renderer.enable_depth_rendering()
            depths.append(renderer.render().copy())
            renderer.disable_depth_rendering()
            tips.append(data.site(TIP).xpos.copy())
    image = with_caption(_with_measures(overlaid(images, depths), layout), caption, layout.caption)
    return with_words(image, labels, project(matrix, np.array(tips)))


def _layout(
    robot: RobotSpec,
    model: mujoco.MjModel,
    states: Sequence[State],
    caption: Sequence[str],
    size: tuple[int, int],
    camera: str,
    close_up: bool,
    measures: bool,
) -> _Layout:
    """Return where to look from, and the emptiest corners, the largest things first."""
    width, height = size
    points = swept_points(model, states)
    view = fitted_view(next(item for item in views(robot) if item.name == camera), points, width, height)
    full = max((float(row.max()) for state in states for row in state.tension), default=0.0)
    taken: list[Corner] = []

    def free(wanted: bool, needs: tuple[int, int]) -> Corner | None:
        if not wanted:
            return None
        taken.append(emptiest_corner(view, points, width, height, needs, taken))
        return taken[-1]

    side = max(SMALLEST_SIDE, round(_INSET * min(width, height)))
    inset = free(close_up, (side, side))
    text = free(True, caption_size(caption, height)) or (0, 0)
    legend = free(measures and full > _LEAST_TENSION_N, legend_size(height))
    scale = free(measures, scale_size(height))
    return _Layout(view, pulled_tendons(model, robot), full, inset, side, text, legend, scale)


def _with_measures(image: Picture, layout: _Layout) -> Picture:
    if layout.scale is not None:
        image = with_scale(image, layout.view, layout.scale)
    if layout.legend is not None:
        image = with_tension_legend(image, layout.full_N, layout.legend)
    return image


def _set_scene(
    renderer: mujoco.Renderer,
    view: View,
    layout: _Layout,
    state: State,
    model: mujoco.MjModel,
    data: mujoco.MjData,
) -> None:
    options = mujoco.MjvOption()
    options.sitegroup[:] = 0
    renderer.update_scene(data, free_camera(view), options)
    if state.tension and layout.full_N > _LEAST_TENSION_N:
        full = [layout.full_N] * len(state.tension)
        paint_tendons(renderer.scene, model, data, layout.pulled, state.tension, full)


def _pinhole(view: View, width: int, height: int) -> PinholeCamera:
    right, up = view.axes
    axes = np.column_stack([right, up, view.backward])
    return PinholeCamera(view.position, axes, math.radians(FOVY_DEG), width, height)
