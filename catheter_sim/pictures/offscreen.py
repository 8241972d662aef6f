"""Pictures of a simulated robot without a screen: framing, shots, videos."""

from __future__ import annotations

import math
import os
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import product

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import channel_inputs, input_channels
from catheter_sim.core.inputs import Inputs, slice_inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, SimulationDiverged, unknown
from catheter_sim.mjcf.names import TIP
from catheter_sim.modelling.build import FOVY_DEG, View, remembered_mjcf, views
from catheter_sim.pictures.curves import Curves, overlaid, strip_width
from catheter_sim.pictures.images import (
    ANIMATION,
    PICTURE,
    SMALLEST_SIDE,
    VIDEO,
    Picture,
    PinholeCamera,
    PulledTendons,
    caption_size,
    legend_size,
    open_renderer,
    paint_points,
    paint_tendons,
    project,
    projection_matrix,
    pulled_tendons,
    require_even,
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
    """

    qpos: Array
    moved: Mapping[str, Array]
    tension: tuple[Array, ...] = ()
    points: Array | None = None


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
        if state.points is not None:
            clouds.append(state.points[np.isfinite(state.points).all(axis=1)])
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


def emptiest_corner(
    view: View,
    points: Array,
    width: int,
    height: int,
    size: tuple[int, int],
    taken: Collection[tuple[int, int]] = (),
) -> tuple[int, int]:
    """Return the corner (row, column: 0 first, 1 last) where a small rectangle hides the fewest points.

    Points have the shape (n, 3) [m], sizes are in pixels; corners that are `taken` are no choice.
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
    """

    camera: str = CAMERAS[0]
    azimuth_deg: float | None = None
    elevation_deg: float | None = None
    zoom: float = 1.0
    look_at_mm: tuple[float, float, float] | None = None
    transparent: bool = False
    legend: bool = True


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

Corner = tuple[int, int]


@dataclass(frozen=True)
class _Layout:
    """From where a robot is seen, and what lies in which corner of its picture; None: nothing."""

    view: View
    pulled: PulledTendons
    full_N: float
    inset: Corner | None
    side: int
    caption: Corner | None
    legend: Corner | None
    scale: Corner | None


def draw(
    robot: RobotSpec,
    model: mujoco.MjModel,
    states: Sequence[DrawnState],
    captions: Sequence[Sequence[str]],
    width: int,
    height: int,
    look: Look = Look(),
    close_up: bool = True,
) -> Iterator[Picture]:
    """Yield one picture for each of `states`, all from one place that holds them all.

    The model is left in the last state. Tendons are painted where the states have tensions. `close_up` shows
    the cells at the base, beside what `look` asks for.
    """
    layout = _layout(robot, model, states, captions[-1], (width, height), look, close_up)
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
            finished = _finished(image, layout, lines)
            yield with_alpha(finished, image, large) if look.transparent else finished


def draw_together(
    robot: RobotSpec,
    model: mujoco.MjModel,
    states: Sequence[DrawnState],
    labels: Sequence[str],
    caption: Sequence[str],
    width: int,
    height: int,
    look: Look = Look(),
) -> Picture:
    """Return one picture of all `states`, the last in full colours, each with its label at its tip.

    Arguments are those of `draw`; `caption` is the picture's.
    """
    layout = _layout(robot, model, states, caption, (width, height), look, False)
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
    image = _finished(overlaid(images, depths), layout, caption)
    return with_words(image, labels, project(matrix, np.array(tips)))


def _layout(
    robot: RobotSpec,
    model: mujoco.MjModel,
    states: Sequence[DrawnState],
    caption: Sequence[str],
    size: tuple[int, int],
    look: Look,
    close_up: bool,
) -> _Layout:
    """Return where to look from, and the emptiest corners, the largest things first."""
    width, height = size
    points = swept_points(model, states)
    own = next(item for item in views(robot) if item.name == look.camera)
    plane = bending_azimuth(model, states) if look.camera == CAMERAS[0] else 0.0
    view = zoomed(fitted_view(looked_from(own, look, plane), points, width, height), look)
    full = max((float(row.max()) for state in states for row in state.tension), default=0.0)
    taken: list[Corner] = []

    def free(wanted: bool, needs: tuple[int, int]) -> Corner | None:
        if not wanted:
            return None
        taken.append(emptiest_corner(view, points, width, height, needs, taken))
        return taken[-1]

    side = max(SMALLEST_SIDE, round(_INSET * min(width, height)))
    inset = free(close_up and look.legend, (side, side))
    text = free(look.legend, caption_size(caption, height))
    legend = free(look.legend and full > _LEAST_TENSION_N, legend_size(height))
    scale = free(look.legend, scale_size(height))
    return _Layout(view, pulled_tendons(model, robot), full, inset, side, text, legend, scale)


def _finished(image: Picture, layout: _Layout, caption: Sequence[str]) -> Picture:
    """Return a picture with what stands beside the robot."""
    if layout.scale is not None:
        image = with_scale(image, layout.view, layout.scale)
    if layout.legend is not None:
        image = with_tension_legend(image, layout.full_N, layout.legend)
    return image if layout.caption is None else with_caption(image, caption, layout.caption)


def with_alpha(finished: Picture, drawn: Picture, renderer: mujoco.Renderer) -> Picture:
    """Return a picture, shape (height, width, 4), that is clear where neither the robot nor a word is.

    `drawn`: as it was before anything was written on it; `renderer`: holds its scene.
    """
    farthest = float(renderer.model.vis.map.zfar * renderer.model.stat.extent)
    renderer.enable_depth_rendering()
    try:
        robot = renderer.render() < _NOTHING * farthest
    finally:
        renderer.disable_depth_rendering()
    opaque = robot | (finished != drawn).any(axis=-1)
    return np.concatenate([finished, np.where(opaque, 255, 0)[..., np.newaxis].astype(np.uint8)], axis=-1)


def _set_scene(
    renderer: mujoco.Renderer,
    view: View,
    layout: _Layout,
    state: DrawnState,
    model: mujoco.MjModel,
    data: mujoco.MjData,
) -> None:
    options = mujoco.MjvOption()
    options.sitegroup[:] = 0
    renderer.update_scene(data, free_camera(view), options)
    if state.tension and layout.full_N > _LEAST_TENSION_N:
        full = [layout.full_N] * len(state.tension)
        paint_tendons(renderer.scene, model, data, layout.pulled, state.tension, full)
    if state.points is not None:
        paint_points(renderer.scene, state.points, _POINT * view.height)


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
    points: Array | None


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
    points: Array | None = None,
) -> None:
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
        points: where points were measured at the rows of `inputs`, shape (r, k, 3) [m]; NaN is missing.

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
    drawing = _Drawing(robot, inputs, gravity_mps2, path, width, height, look, progress, states, points)
    if kind == PICTURE:
        _render_picture(drawing, rows)
    else:
        _render_video(drawing, curves)


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
    if drawing.points is not None:
        states = [
            replace(state, points=drawing.points[row]) for state, row in zip(states, shown, strict=True)
        ]
    if len(shown) > 1:
        labels = [f"{row + 1}" for row in shown]
        lines = [row_words(robot, inputs, row) for row in shown][:_CAPTION_LINES]
        image = draw_together(
            robot, model, states, labels, lines, drawing.width, drawing.height, drawing.look
        )
    else:
        captions = [caption(robot, inputs, shown[0])]
        (image,) = draw(robot, model, states, captions, drawing.width, drawing.height, drawing.look)
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
    if drawing.points is not None:
        flat = drawing.points.reshape(len(inputs), -1).T
        seen = np.stack([np.interp(times, inputs.time_s, values) for values in flat], axis=1)
        pairs = zip(states, seen.reshape(len(times), -1, 3), strict=True)
        states = [replace(state, points=points) for state, points in pairs]
    captions = [caption(robot, every, row) for row in rows]
    strip = strip_width(drawing.width) if curves else 0
    frames = draw(robot, model, states, captions, drawing.width - strip, drawing.height, drawing.look)
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
    """Return the row's time and inputs as lines of text."""
    lines = [f"t = {inputs.time_s[row]:.2f} s"]
    values = channel_inputs(robot, slice_inputs(inputs, slice(row, row + 1)))[0]
    for column, value in zip(input_channels(robot, inputs.actuation), values, strict=True):
        name, _, unit = column.rpartition("_")
        lines.append(f"{name.replace('_', ' ')} {value / si_factor(column):.2f} {unit}")
    return lines[:_CAPTION_LINES]


def row_words(robot: RobotSpec, inputs: Inputs, row: int) -> str:
    """Return a row's number, and its inputs if they are few, else its time."""
    time, *driven = caption(robot, inputs, row)
    return f"{row + 1}: {', '.join(driven) if len(driven) <= _FEW_CHANNELS else time}"
