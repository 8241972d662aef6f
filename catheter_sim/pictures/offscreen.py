"""Pictures of a simulated robot without a screen: framing, shots, videos."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import product

import mujoco
import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.channels import channel_inputs, input_channels
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, SimulationDiverged, unknown
from catheter_sim.mjcf.names import TIP
from catheter_sim.modelling.build import FOVY_DEG, View, remembered_mjcf, views
from catheter_sim.pictures.beside import (
    GHOST_SHARE,
    Item,
    MeasuredPoints,
    TendonLook,
    computed_points,
    free_places,
    ghost_line,
    paint_close_up,
    paint_line,
    paint_measured,
    paint_pulled,
)
from catheter_sim.pictures.curves import Curves, overlaid, strip_width
from catheter_sim.pictures.images import (
    ANIMATION,
    MEASURED,
    PICTURE,
    SMALLEST_SIDE,
    VIDEO,
    Picture,
    PinholeCamera,
    Place,
    PulledTendons,
    caption_size,
    gap_of,
    inset_size,
    legend_size,
    open_renderer,
    project,
    projection_matrix,
    pulled_tendons,
    require_even,
    round_end,
    scale_size,
    stretch_tensions,
    suffix_of,
    with_caption,
    with_inset,
    with_scale,
    with_tension_legend,
    with_words,
    write_picture,
    write_video,
)
from catheter_sim.robots import kind_of
from catheter_sim.simulation.replay import RAMP_S, simulate
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.units import si_factor

# ----------------------------------------------------------------------------------------------------
# What must be remembered of a simulation to draw it later.
#
# Joint positions alone do not say where a rolling-joint robot is: the simulation moves its hinges and links
# in the model itself (`catheter_sim.robots.rolling.laws`).

_MOVED = ("jnt_pos", "body_pos", "site_pos")  # fields of the model that a simulation writes


@dataclass(frozen=True)
class DrawnState:
    """A simulator's state as far as it is drawn.

    Attributes:
        qpos: joint positions, shape (nq,).
        moved: fields of the model by their names, shapes (..., 3) [m].
        tension: in every stretch of each pulled tendon [N], where the tendons are to be painted by it.
        points: measured beside it, shape (k, 3) [m]; NaN is missing. None: no measurement is shown.
        point_names: of `points`, as `MeasuredPoints` has them.
    """

    qpos: Array
    moved: Mapping[str, Array]
    tension: tuple[Array, ...] = ()
    points: Array | None = None
    point_names: tuple[str, ...] = ()


def state_of(
    simulator: Simulator, tendons: PulledTendons | None = None, before: DrawnState | None = None
) -> DrawnState:
    """Return what `simulator` shows now.

    `tendons`: whose tensions are shown, too. What has not moved since `before` is held once for both.
    """
    model = simulator.model
    now = {name: getattr(model, name) for name in _MOVED}
    now["geom_pos"] = kind_of(simulator.robot).picture.geom_places(simulator.robot, model)
    known = {} if before is None else before.moved
    moved = {
        name: known[name] if name in known and np.array_equal(known[name], values) else values.copy()
        for name, values in now.items()
    }
    tension = stretch_tensions(simulator, tendons) if tendons is not None else ()
    return DrawnState(simulator.data.qpos.copy(), moved, tension)


def between(earlier: DrawnState, later: DrawnState, share: float) -> DrawnState:
    """Return the state that lies evenly between two: `share` 0 is the earlier one, 1 the later."""

    def at(first: Array, second: Array) -> Array:
        return first if first is second else (1.0 - share) * first + share * second

    return DrawnState(
        at(earlier.qpos, later.qpos),
        {name: at(values, later.moved[name]) for name, values in earlier.moved.items()},
        tuple(at(first, second) for first, second in zip(earlier.tension, later.tension, strict=True)),
    )


def put(state: DrawnState, model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Let `model` and `data` stand in `state`; kinematics and tendons' paths are up to date."""
    for name, values in state.moved.items():
        getattr(model, name)[:] = values
    data.qpos[:] = state.qpos
    mujoco.mj_fwdPosition(model, data)


# ----------------------------------------------------------------------------------------------------
# Where to put the camera so that a robot's whole motion fills the picture.

_MARGIN = 1.06  # picture over what is to be seen
_VISIBLE_GROUPS = 3  # MuJoCo shows the geom groups 0 to 2


def swept_points(model: mujoco.MjModel, states: Iterable[DrawnState]) -> Array:
    """Return points that enclose what is drawn in all `states`, shape (n, 3) [m]: the corners of its boxes.

    The model is left in the last state.
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

    Points have the shape (n, 3) [m]; the picture's size is in pixels.
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


# ----------------------------------------------------------------------------------------------------
# Pictures of a robot in given states, from one place that holds them all, with what they are read by.

CAMERAS = ("overview", "side")
_STRAIGHT = 0.01  # of the length: a robot that leaves its axis by less bends in no plane
_ROUND = 0.5  # second extent of the motion across the axis over the first: above it, it has no plane


@dataclass(frozen=True)
class Look:
    """From where a robot is drawn, and what stands beside it.

    Angles and zoom are MuJoCo's: azimuth 90 looks along +y, a negative elevation looks down.

    Attributes:
        camera: one of `CAMERAS`. "side" looks along +y; "overview" from above onto the plane in which the
            robot bends most.
        azimuth_deg, elevation_deg: of the looking direction; None: the camera's.
        zoom: how much larger than when the robot fills the picture.
        look_at_mm: the point in the picture's middle, base frame; None: the middle of the robot.
        transparent: nothing is drawn behind the robot.
        legend: scale, axes, colours and caption are drawn.
        inset: with them, a close-up: of the joint that has turned most where the kind has a profile to show,
            else of the base.
    """

    camera: str = CAMERAS[0]
    azimuth_deg: float | None = None
    elevation_deg: float | None = None
    zoom: float = 1.0
    look_at_mm: tuple[float, float, float] | None = None
    transparent: bool = False
    legend: bool = True
    inset: bool = True


def bending_azimuth(model: mujoco.MjModel, states: Iterable[DrawnState]) -> float:
    """Return the angle about z from the xz plane to the plane in which a robot bends most [rad].

    It lies within a quarter turn of 0, which it is for a robot that bends in no plane more than in others.
    The model is left in the last state.
    """
    data, places = mujoco.MjData(model), []
    for state in states:
        put(state, model, data)
        places.append(data.xpos[1:].copy())
    away = np.concatenate(places)
    across = away[:, :2]
    turned, size, _ = np.linalg.svd(across.T, full_matrices=False)
    if np.abs(across).max() < _STRAIGHT * np.ptp(away[:, 2]) or size[1] > _ROUND * size[0]:
        return 0.0
    x, y = turned[:, 0] if turned[0, 0] >= 0.0 else -turned[:, 0]
    return math.atan2(y, x)


def looked_from(view: View, look: Look, plane: float) -> View:
    """Return a view in the direction that is asked for; `plane` as of `bending_azimuth`."""
    x, y, z = view.backward
    azimuth, elevation = math.degrees(math.atan2(-y, -x)), math.degrees(math.asin(-z))
    if look.camera == CAMERAS[0]:
        azimuth += math.degrees(plane)
    azimuth = math.radians(azimuth if look.azimuth_deg is None else look.azimuth_deg)
    elevation = math.radians(elevation if look.elevation_deg is None else look.elevation_deg)
    forward = np.array([math.cos(azimuth), math.sin(azimuth), 0.0]) * math.cos(elevation)
    forward[2] = math.sin(elevation)
    return replace(view, backward=-forward)


def zoomed(view: View, look: Look) -> View:
    """Return a view that is zoomed and turned to a point, as is asked for."""
    target = view.target if look.look_at_mm is None else 1e-3 * np.array(look.look_at_mm)
    return replace(view, target=target, height=view.height / look.zoom)


_INSET = 0.42  # side of the close-up over the picture's height
_LEAST_TENSION_N = 1e-6  # less is no tension to paint
_NOTHING = 0.99  # of the largest distance that is drawn: what is farther is none
_POINT = 0.009  # radius of a measured point over the height that is seen
_LEAST_TENDON_PX = 0.8  # radius of a tendon that is thinner
_TRIED_STATES = 16  # of a video, that must leave room for what stands beside the robot
# How much more than the robot is seen to make room, and where the robot then stands across: -1 left.
_MORE = ((1.0, (0,)), *((more, (0, -1, 1)) for more in (1.12, 1.25, 1.4, 1.6, 1.9)))
INSET, CAPTION, LEGEND, SCALE = "close-up", "inputs", "tensions", "scale"
OnLeftOut = Callable[[Sequence[str]], None]


@dataclass(frozen=True)
class _Layout:
    """From where a robot is seen, and what stands where beside it, by name; missing: nothing.

    `words` stand above the close-up.
    """

    view: View
    height: int
    pulled: PulledTendons
    full_N: float
    side: int
    words: tuple[str, ...]
    places: Mapping[str, Place]
    left_out: tuple[str, ...] = ()

    @property
    def frame(self) -> Place:
        """Of the close-up, below its words."""
        left, top = self.places[INSET]
        return left, top + _words_height(self.words, self.height)


@dataclass(frozen=True)
class _Scene:
    """What of a robot is drawn, and into pictures of which size."""

    robot: RobotSpec
    model: mujoco.MjModel
    states: Sequence[DrawnState]
    width: int
    height: int
    look: Look

    def beside(self, captions: Sequence[Sequence[str]], full_N: float, close_up: bool) -> list[Item]:
        """Return what stands beside the robot, what needs most room first."""
        if not self.look.legend:
            return []
        sizes = np.array([caption_size(lines, self.height) for lines in captions])
        across, down = sizes.max(axis=0).tolist()
        items = []
        if close_up and self.look.inset:
            (whole, high), words = inset_size(self.side, self.height), self.close_words()
            wide = max(whole, caption_size(words, self.height)[0])
            items.append(Item(INSET, (wide, high + _words_height(words, self.height)), (1, 1)))
        items.append(Item(CAPTION, (across, down), (0, 0)))
        if full_N > 0.0:
            items.append(Item(LEGEND, legend_size(self.height), (0, 1)))
        return [*items, Item(SCALE, scale_size(self.height), (1, 0))]

    def measured_corners(self) -> list[Array]:
        """Return points around the measured ones, shapes (n, 3) [m]: as far as a robot there would reach."""
        reach = max(segment.outer_radius_m for segment in self.robot.segments)
        found = [state.points for state in self.states if state.points is not None]
        finite = [points[np.isfinite(points).all(axis=1)] for points in found]
        return [points + reach * way for points in finite for way in (*np.eye(3), *-np.eye(3))]

    @property
    def side(self) -> int:
        """Of the close-up [pixels]."""
        return max(SMALLEST_SIDE, round(_INSET * min(self.width, self.height)))

    def close_words(self) -> tuple[str, ...]:
        """Return what stands above the close-up, line by line."""
        if (profile := kind_of(self.robot).profile) is None:
            return ()
        data = mujoco.MjData(self.model)
        put(self.states[-1], self.model, data)
        return profile.close_up(self.robot, self.model, data, data.qpos).words


def _words_height(words: Sequence[str], height: int) -> int:
    """Return how much higher a close-up is with words above it, in a picture so high [pixels]."""
    return caption_size(words, height)[1] - gap_of(height) if words else 0


def draw(
    robot: RobotSpec,
    model: mujoco.MjModel,
    states: Sequence[DrawnState],
    captions: Sequence[Sequence[str]],
    width: int,
    height: int,
    look: Look = Look(),
    close_up: bool = True,
    on_left_out: OnLeftOut | None = None,
) -> Iterator[Picture]:
    """Yield one picture for each of `states`, all from one place that holds them all.

    The model is left in the last state. Tendons are painted where the states have tensions. `close_up` shows
    one place closely, beside what `look` asks for. `on_left_out` is called with names of what has no room.
    """
    scene = _Scene(robot, model, states, width, height, look)
    data = mujoco.MjData(model)
    with ExitStack() as opened:
        large = opened.enter_context(open_renderer(model, width, height))
        layout = _layout(scene, large, captions, close_up)
        if on_left_out is not None:
            on_left_out(layout.left_out)
        small = None
        if INSET in layout.places:
            small = opened.enter_context(open_renderer(model, layout.side, layout.side))
        for state, lines in zip(states, captions, strict=True):
            put(state, model, data)
            image = _image(large, scene, layout, state, data)
            written: NDArray[np.bool_] = np.zeros(image.shape[:2], dtype=bool)
            if small is not None:
                close = _close_up(small, scene, layout, state, data)
                image = with_inset(image, close, layout.frame)
                frame = with_inset(np.zeros_like(image), np.ones_like(close), layout.frame)
                written |= np.asarray(frame.any(axis=-1))
            finished = _finished(image, layout, lines)
            written |= np.asarray((finished != image).any(axis=-1))
            yield with_alpha(finished, written, large) if look.transparent else finished


def draw_together(
    robot: RobotSpec,
    model: mujoco.MjModel,
    states: Sequence[DrawnState],
    labels: Sequence[str],
    caption: Sequence[str],
    width: int,
    height: int,
    look: Look = Look(),
    on_left_out: OnLeftOut | None = None,
) -> Picture:
    """Return one picture of all `states`, the last in full colours, each with its label at its tip.

    Arguments are those of `draw`; `caption` is the picture's.
    """
    scene = _Scene(robot, model, states, width, height, look)
    data = mujoco.MjData(model)
    images, depths, tips = [], [], []
    with open_renderer(model, width, height) as renderer:
        layout = _layout(scene, renderer, [caption], False)
        if on_left_out is not None:
            on_left_out(layout.left_out)
        for state in states:
            put(state, model, data)
            images.append(_image(renderer, scene, layout, state, data))
            depths.append(_depths(renderer))
            tips.append(data.site(TIP).xpos.copy())
    image = _finished(overlaid(images, depths), layout, caption)
    matrix = projection_matrix(_pinhole(layout.view, width, height))
    return with_words(image, labels, project(matrix, np.array(tips)))


def _layout(
    scene: _Scene, renderer: mujoco.Renderer, captions: Sequence[Sequence[str]], close_up: bool
) -> _Layout:
    """Return where to look from, and where things stand beside the robot: on none of its pixels.

    Where there is no room, more than the robot is seen, but in a view that is asked for.
    """
    look, size = scene.look, (scene.width, scene.height)
    points = np.concatenate([swept_points(scene.model, scene.states), *scene.measured_corners()])
    own = next(item for item in views(scene.robot) if item.name == look.camera)
    plane = bending_azimuth(scene.model, scene.states) if look.camera == CAMERAS[0] else 0.0
    view = zoomed(fitted_view(looked_from(own, look, plane), points, *size), look)
    largest = max((float(row.max()) for state in scene.states for row in state.tension), default=0.0)
    full_N = round_end(largest) if largest > _LEAST_TENSION_N else 0.0
    items = scene.beside(captions, full_N, close_up)
    pulled = pulled_tendons(scene.model, scene.robot)
    best = _Layout(view, scene.height, pulled, full_N, scene.side, scene.close_words(), {})
    asked = look.zoom != 1.0 or look.look_at_mm is not None
    for more, sides in _MORE[:1] if asked else _MORE:
        for side in sides:
            room = 0.5 * side * (more - 1.0) * view.height * scene.width / scene.height
            seen = replace(view, target=view.target - room * view.axes[0], height=more * view.height)
            tried = replace(best, view=seen)
            places = free_places(_taken(scene, tried, renderer), items)
            if len(places) > len(best.places) or not best.left_out:
                left_out = tuple(item.name for item in items if item.name not in places)
                best = replace(tried, places=places, left_out=left_out)
            if len(places) == len(items):
                return best
    return best


def _taken(scene: _Scene, layout: _Layout, renderer: mujoco.Renderer) -> NDArray[np.bool_]:
    """Return which pixels the robot and what is measured take in any state, shape (height, width)."""
    data = mujoco.MjData(scene.model)
    last = len(scene.states) - 1
    rows = np.unique(np.rint(np.linspace(0, last, min(last + 1, _TRIED_STATES))).astype(int))
    taken = np.zeros((scene.height, scene.width), dtype=bool)
    for row in rows:
        put(scene.states[row], scene.model, data)
        _set_whole_scene(renderer, scene, layout, scene.states[row], data)
        _add_ghost(renderer, scene, scene.states[row])
        taken |= _robot_pixels(renderer)
    return taken


def _finished(image: Picture, layout: _Layout, caption: Sequence[str]) -> Picture:
    """Return a picture with what stands beside the robot."""
    places = layout.places
    if SCALE in places:
        image = with_scale(image, layout.view, places[SCALE])
    if LEGEND in places:
        image = with_tension_legend(image, layout.full_N, places[LEGEND])
    if INSET in places and layout.words:
        image = with_caption(image, layout.words, places[INSET])
    return with_caption(image, caption, places[CAPTION]) if CAPTION in places else image


def _close_up(
    renderer: mujoco.Renderer, scene: _Scene, layout: _Layout, state: DrawnState, data: mujoco.MjData
) -> Picture:
    """Return a close-up: of what the kind wants to be seen closely, else of the base."""
    profile = kind_of(scene.robot).profile
    if profile is None:
        detail = next(view for view in views(scene.robot) if view.name == "detail")
        _set_scene(renderer, detail, scene, layout, state, data)
        return np.asarray(renderer.render())
    shown = profile.close_up(scene.robot, scene.model, data, scene.states[-1].qpos)
    facing = 1.0 if shown.across @ layout.view.backward >= 0.0 else -1.0
    view = View("close-up", shown.middle, facing * shown.across, shown.height_m)
    _set_scene(renderer, view, scene, layout, state, data)
    paint_close_up(renderer.scene, shown)
    return np.asarray(renderer.render())


def _depths(renderer: mujoco.Renderer) -> NDArray[np.float32]:
    """Return how far what each pixel shows is from the camera, shape (height, width) [m]."""
    renderer.enable_depth_rendering()
    try:
        return np.array(renderer.render())
    finally:
        renderer.disable_depth_rendering()


def _robot_pixels(renderer: mujoco.Renderer) -> NDArray[np.bool_]:
    """Return which pixels show anything of the renderer's scene, shape (height, width)."""
    model = renderer.model
    return _depths(renderer) < _NOTHING * float(model.vis.map.zfar * model.stat.extent)


def with_alpha(finished: Picture, written: NDArray[np.bool_], renderer: mujoco.Renderer) -> Picture:
    """Return a picture, shape (height, width, 4), that is clear where neither the robot nor a word is.

    `written`: which pixels are words, and what else is not the robot; `renderer`: holds its scene.
    """
    opaque = _robot_pixels(renderer) | written
    return np.concatenate([finished, np.where(opaque, 255, 0)[..., np.newaxis].astype(np.uint8)], axis=-1)


def _set_scene(
    renderer: mujoco.Renderer,
    view: View,
    scene: _Scene,
    layout: _Layout,
    state: DrawnState,
    data: mujoco.MjData,
) -> None:
    options = mujoco.MjvOption()
    options.sitegroup[:] = 0
    renderer.update_scene(data, free_camera(view), options)
    least = _LEAST_TENDON_PX * view.height / renderer.height
    paint_pulled(
        renderer.scene,
        scene.model,
        data,
        layout.pulled,
        state.tension,
        layout.full_N,
        TendonLook(view.backward, least),
    )


def _set_whole_scene(
    renderer: mujoco.Renderer, scene: _Scene, layout: _Layout, state: DrawnState, data: mujoco.MjData
) -> None:
    """Let `renderer` show the whole robot, with the points that were measured of it."""
    _set_scene(renderer, layout.view, scene, layout, state, data)
    if state.points is not None:
        computed = computed_points(scene.model, data, state.point_names)
        paint_measured(renderer.scene, state.points, computed, _POINT * layout.view.height)


def _add_ghost(renderer: mujoco.Renderer, scene: _Scene, state: DrawnState) -> bool:
    """Add to the scene what was measured as a robot of its own; return whether enough was."""
    if state.points is None or len(line := ghost_line(state.point_names, state.points)) == 0:
        return False
    radius_m = min(segment.outer_radius_m for segment in scene.robot.segments)
    paint_line(renderer.scene, line, radius_m, MEASURED, mujoco.mjtGeom.mjGEOM_CYLINDER)  # with flat ends
    return True


def _image(
    renderer: mujoco.Renderer, scene: _Scene, layout: _Layout, state: DrawnState, data: mujoco.MjData
) -> Picture:
    """Return the whole robot, and a measured one that is seen through."""
    _set_whole_scene(renderer, scene, layout, state, data)
    image = np.asarray(renderer.render())
    if not _add_ghost(renderer, scene, state):
        return image
    both = (1.0 - GHOST_SHARE) * image + GHOST_SHARE * renderer.render()
    return np.asarray(np.rint(both), dtype=np.uint8)


def _pinhole(view: View, width: int, height: int) -> PinholeCamera:
    right, up = view.axes
    axes = np.column_stack([right, up, view.backward])
    return PinholeCamera(view.position, axes, math.radians(FOVY_DEG), width, height)


# ----------------------------------------------------------------------------------------------------
# Pictures and videos of a simulated robot under a history of inputs, drawn without a screen.

FPS = 25
LONGEST_VIDEO_S = 8.0  # longer inputs are played faster
_CAPTION_LINES = 10
_FEW_CHANNELS = 2  # whose inputs stand in one line of a caption


@dataclass(frozen=True)
class _Drawing:
    """What is drawn into which file; fields are the arguments of `render`."""

    robot: RobotSpec
    inputs: Inputs
    gravity_mps2: Sequence[float]
    path: str | os.PathLike[str]
    width: int
    height: int
    look: Look
    progress: bool
    states: Sequence[DrawnState]
    measured: MeasuredPoints | None
    left_out: list[str]

    def beside(self, states: Sequence[DrawnState], places: Array) -> list[DrawnState]:
        """Return `states` with what was measured at each: `places`, shape (n, k, 3) [m]."""
        assert self.measured is not None
        names = self.measured.names
        pairs = zip(states, places, strict=True)
        return [replace(state, points=points, point_names=names) for state, points in pairs]


def render(
    robot: RobotSpec,
    inputs: Inputs,
    gravity_mps2: Sequence[float],
    path: str | os.PathLike[str],
    width: int = 1280,
    height: int = 720,
    look: Look = Look(),
    progress: bool = False,
    rows: Sequence[int] = (),
    curves: bool = False,
    states: Sequence[DrawnState] = (),
    measured: MeasuredPoints | None = None,
) -> tuple[str, ...]:
    """Write a picture (.png) or a video (.mp4, .gif), as the file's name says.

    A picture shows the robot at the last row of `inputs`, after all rows before it, or at several rows.
    Tendons are coloured by their tension, along their length; a scale bar, the base frame's axes and what
    the colours mean stand beside the robot. A video runs in real time or in `LONGEST_VIDEO_S`, whichever is
    shorter. Every frame is simulated: the inputs move linearly from row to row; with `states` given, the
    robot moves evenly from one to the next instead.

    Args:
        robot: the robot; its `effects` are not read.
        inputs: rows of inputs, held quasi-statically.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
        path: file to write; a video has even width and height.
        width, height: [pixels].
        look: from where the robot is drawn, and what stands beside it.
        progress: show on standard error what is done.
        rows: numbers of the rows to show in one picture, the first 0, the last in full colours; none: the
            last row alone, with a close look at the robot's base.
        curves: the inputs' curves take the right part of a video, and a line in them runs along.
        states: of a simulation, one a row of `inputs`, where that was made already; none: it is made.
        measured: points that were measured at the rows of `inputs`.

    Returns:
        What has no room beside the robot and is left out: "close-up", "inputs", "tensions", "scale".

    Raises:
        InputError: bad path, size, camera or row, `rows` or `curves` for a file that has no use for it,
            nothing to draw with, or the simulation diverged.
    """
    kind = suffix_of(path)
    if kind != PICTURE and rows:
        raise InputError(f"{os.fspath(path)}: several rows are shown in a picture; choices: {PICTURE}")
    if kind == PICTURE and curves:
        raise InputError(f"{os.fspath(path)}: curves stand beside a video; choices: {VIDEO}, {ANIMATION}")
    if look.camera not in CAMERAS:
        raise unknown("camera", look.camera, CAMERAS)
    if look.transparent and (kind != PICTURE or len(rows) > 1):
        raise InputError(f"{os.fspath(path)}: transparent is one row's picture; choices: {PICTURE}")
    empty = mujoco.MjModel.from_xml_string("<mujoco/>")
    open_renderer(empty, width, height).close()  # what it raises is not to come after the simulation
    drawing = _Drawing(robot, inputs, gravity_mps2, path, width, height, look, progress, states, measured, [])
    if kind == PICTURE:
        _render_picture(drawing, rows)
    else:
        _render_video(drawing, curves)
    return tuple(drawing.left_out)


def _render_picture(drawing: _Drawing, rows: Sequence[int]) -> None:
    robot, inputs = drawing.robot, drawing.inputs
    for row in rows:
        if not 0 <= row < len(inputs):
            raise InputError(f"row {row + 1}: the inputs have the rows 1 to {len(inputs)}")
    shown = list(dict.fromkeys(rows)) or [len(inputs) - 1]
    if drawing.states:
        model, states = _model_of(drawing), [drawing.states[row] for row in shown]
    else:
        model, states = _simulated(drawing, inputs, shown, RAMP_S)
    if drawing.measured is not None:
        states = drawing.beside(states, drawing.measured.places[shown])
    if len(shown) > 1:
        labels = [f"{row + 1}" for row in shown]
        lines = [row_words(robot, inputs, row) for row in shown][:_CAPTION_LINES]
        size = drawing.width, drawing.height
        image = draw_together(
            robot, model, states, labels, lines, *size, drawing.look, drawing.left_out.extend
        )
    else:
        captions = [caption(robot, inputs, shown[0])]
        (image,) = draw(
            robot,
            model,
            states,
            captions,
            drawing.width,
            drawing.height,
            drawing.look,
            on_left_out=drawing.left_out.extend,
        )
    write_picture(drawing.path, image)


def _render_video(drawing: _Drawing, curves: bool) -> None:
    robot, inputs = drawing.robot, drawing.inputs
    if suffix_of(drawing.path) == VIDEO:
        require_even(drawing.path, drawing.width, drawing.height)
    times = frame_times(inputs)
    every = resampled(inputs, np.union1d(inputs.time_s, times))
    rows = [int(row) for row in np.searchsorted(every.time_s, times)]
    if drawing.states:
        model = _model_of(drawing)
        states = [_state_at(drawing.states, inputs.time_s, time) for time in times]
    else:
        # Frames lie closer than rows: the inputs move no faster than from row to row otherwise.
        model, states = _simulated(drawing, every, rows, RAMP_S * len(inputs) / len(every))
    if drawing.measured is not None:
        flat = drawing.measured.places.reshape(len(inputs), -1).T
        seen = np.stack([np.interp(times, inputs.time_s, values) for values in flat], axis=1)
        states = drawing.beside(states, seen.reshape(len(times), -1, 3))
    captions = [caption(robot, every, row) for row in rows]
    strip = strip_width(drawing.width) if curves else 0
    frames = draw(
        robot,
        model,
        states,
        captions,
        drawing.width - strip,
        drawing.height,
        drawing.look,
        on_left_out=drawing.left_out.extend,
    )
    if curves:
        frames = _beside(
            frames, Curves(robot, inputs, strip, drawing.height), [float(time) for time in times]
        )
    write_video(drawing.path, frames, FPS, len(rows), drawing.progress)


def _beside(frames: Iterator[Picture], strip: Curves, times: Sequence[float]) -> Iterator[Picture]:
    for frame, time_s in zip(frames, times, strict=True):
        yield strip.beside(frame, time_s)


def frame_times(inputs: Inputs) -> Array:
    """Return the times of a video's frames within the time of `inputs`, both ends included [s]."""
    first, last = inputs.time_s[0], inputs.time_s[-1]
    count = 1 + round(FPS * min(last - first, LONGEST_VIDEO_S))
    return np.linspace(first, last, max(count, 2)) if last > first else np.array([first])


def resampled(inputs: Inputs, time_s: Array) -> Inputs:
    """Return `inputs` at other times, linear between its rows."""

    def at(values: Array) -> Array:
        columns = [np.interp(time_s, inputs.time_s, column) for column in values.T]
        return np.stack(columns, axis=1)

    shape = (len(time_s), len(inputs.bodies), 3)
    rows = len(inputs)
    force, moment = (values.reshape(rows, -1) for values in (inputs.force_body, inputs.moment_body))
    return Inputs(
        time_s,
        inputs.actuation,
        at(inputs.tendon),
        at(inputs.force_tip),
        at(inputs.moment_tip),
        inputs.bodies,
        at(force).reshape(shape) if inputs.bodies else inputs.force_body,
        at(moment).reshape(shape) if inputs.bodies else inputs.moment_body,
    )


def _model_of(drawing: _Drawing) -> mujoco.MjModel:
    """Return the model that states of a simulation that was made already are drawn in."""
    return mujoco.MjModel.from_xml_string(remembered_mjcf(drawing.robot, drawing.inputs.actuation))


def _state_at(states: Sequence[DrawnState], time_s: Array, when_s: float) -> DrawnState:
    """Return the state at a time within those of the rows."""
    later = int(np.clip(np.searchsorted(time_s, when_s), 1, len(states) - 1)) if len(states) > 1 else 0
    earlier = max(later - 1, 0)
    length_s = float(time_s[later] - time_s[earlier])
    share = (when_s - float(time_s[earlier])) / length_s if length_s else 0.0
    return between(states[earlier], states[later], share)


def _simulated(
    drawing: _Drawing, inputs: Inputs, rows: Sequence[int], ramp_s: float
) -> tuple[mujoco.MjModel, list[DrawnState]]:
    """Return the model, and its state at each of the given rows of `inputs`."""
    wanted, states = set(rows), {}
    models: list[mujoco.MjModel] = []
    tendons: list[PulledTendons] = []

    def keep(simulator: Simulator, row: int) -> None:
        if not models or models[0] is not simulator.model:
            models[:], tendons[:] = [simulator.model], [pulled_tendons(simulator.model, drawing.robot)]
        if row in wanted:
            states[row] = state_of(simulator, tendons[0])

    gravity = np.asarray(drawing.gravity_mps2, dtype=float)
    run = simulate(drawing.robot, inputs, gravity, ramp_s=ramp_s, progress=drawing.progress, on_row=keep)
    if run.failure is not None:
        raise SimulationDiverged(run.failure)
    return models[0], [states[row] for row in rows]


def caption(robot: RobotSpec, inputs: Inputs, row: int) -> list[str]:
    """Return the row's time and inputs as lines of text: of channels and loads that leave 0 in any row.

    Where there are more than the picture has room for, the last line says how many.
    """
    lines = [f"t = {inputs.time_s[row]:.2f} s"]
    values = channel_inputs(robot, inputs)
    for column, own in zip(input_channels(robot, inputs.actuation), values.T, strict=True):
        if own.any():
            name, _, unit = column.rpartition("_")
            lines.append(f"{name.replace('_', ' ')} {own[row] / si_factor(column):.2f} {unit}")
    for column, own in _loads(inputs):
        if own.any():
            name, _, unit = column.rpartition("_")
            lines.append(f"{name.replace('_', ' ')} {own[row]:.2g} {unit}")
    if len(lines) > _CAPTION_LINES:
        lines[_CAPTION_LINES - 1 :] = [f"and {len(lines) - _CAPTION_LINES + 1} more"]
    return lines


def _loads(inputs: Inputs) -> list[tuple[str, Array]]:
    """Return the forces and moments by their columns, each of shape (r,)."""
    found = []
    for axis, letter in enumerate("xyz"):
        found += [
            (f"force_tip_{letter}_N", inputs.force_tip[:, axis]),
            (f"moment_tip_{letter}_Nm", inputs.moment_tip[:, axis]),
        ]
        for index, body in enumerate(inputs.bodies):
            found += [
                (f"force_body_{body}_{letter}_N", inputs.force_body[:, index, axis]),
                (f"moment_body_{body}_{letter}_Nm", inputs.moment_body[:, index, axis]),
            ]
    return found


def row_words(robot: RobotSpec, inputs: Inputs, row: int) -> str:
    """Return a row's number, and its inputs if they are few, else its time."""
    time, *driven = caption(robot, inputs, row)
    return f"{row + 1}: {', '.join(driven) if len(driven) <= _FEW_CHANNELS else time}"
