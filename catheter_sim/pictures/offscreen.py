"""Pictures and videos of a simulated robot under a history of inputs, drawn without a screen."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import ExitStack

import mujoco
import numpy as np

from catheter_sim.channels import channel_inputs, input_channels
from catheter_sim.core.inputs import Inputs, slice_inputs
from catheter_sim.core.posture import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, SimulationDiverged, unknown
from catheter_sim.modelling.scene import views
from catheter_sim.pictures.backend import SMALLEST_SIDE, open_renderer
from catheter_sim.pictures.framing import emptiest_corner, fitted_view, free_camera, swept_points
from catheter_sim.pictures.images import (
    PICTURE,
    VIDEO,
    Picture,
    caption_size,
    require_even,
    suffix_of,
    with_caption,
    with_inset,
)
from catheter_sim.pictures.images import write_picture as write_picture_file
from catheter_sim.pictures.images import write_video as write_video_file
from catheter_sim.pictures.state import State, put, state_of
from catheter_sim.simulation.replay import RAMP_S, simulate
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.units import si_factor

CAMERAS = ("overview", "side")
FPS = 25
LONGEST_VIDEO_S = 8.0  # longer inputs are played faster
_INSET = 0.42  # side of the close-up over the picture's height
_CAPTION_LINES = 10


def render(
    robot: RobotSpec,
    inputs: Inputs,
    gravity_mps2: Sequence[float],
    path: str | os.PathLike[str],
    width: int = 1280,
    height: int = 720,
    camera: str = "overview",
    progress: bool = False,
) -> None:
    """Write a picture (.png) or a video (.mp4), as the file's name says; see the two functions below."""
    write = render_picture if suffix_of(path) == PICTURE else render_video
    write(robot, inputs, gravity_mps2, path, width, height, camera, progress)


def render_picture(
    robot: RobotSpec,
    inputs: Inputs,
    gravity_mps2: Sequence[float],
    path: str | os.PathLike[str],
    width: int = 1280,
    height: int = 720,
    camera: str = "overview",
    progress: bool = False,
) -> None:
    """Write a PNG of the robot at the last row of `inputs`, after all rows before it.

    Args:
        robot: the robot; its `effects` are not read.
        inputs: rows of inputs, held quasi-statically.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
        path: file to write, `.png`.
        width, height: [pixels].
        camera: where to look from, one of `CAMERAS`; the robot fills the picture.
        progress: show on standard error what is done.

    Raises:
        InputError: bad path, size or camera, nothing to draw with, or the simulation diverged.
    """
    _check(path, PICTURE, camera, width, height)
    last = len(inputs) - 1
    model, states = _simulated(robot, inputs, gravity_mps2, [last], RAMP_S, progress)
    (image,) = draw(robot, model, states, [caption(robot, inputs, last)], width, height, camera)
    write_picture_file(path, image)


def render_video(
    robot: RobotSpec,
    inputs: Inputs,
    gravity_mps2: Sequence[float],
    path: str | os.PathLike[str],
    width: int = 1280,
    height: int = 720,
    camera: str = "overview",
    progress: bool = False,
) -> None:
    """Write an MP4 of the robot under `inputs`, in real time or in `LONGEST_VIDEO_S`, whichever is shorter.

    Every frame is simulated: the inputs move linearly from row to row. Arguments and errors are those
    of `render_picture`; width and height are even.
    """
    _check(path, VIDEO, camera, width, height)
    require_even(path, width, height)
    times = frame_times(inputs)
    every = resampled(inputs, np.union1d(inputs.time_s, times))
    rows = [int(row) for row in np.searchsorted(every.time_s, times)]
    # Frames lie closer than rows: the inputs move no faster than from row to row otherwise.
    ramp_s = RAMP_S * len(inputs) / len(every)
    model, states = _simulated(robot, every, gravity_mps2, rows, ramp_s, progress)
    captions = [caption(robot, every, row) for row in rows]
    frames = draw(robot, model, states, captions, width, height, camera)
    write_video_file(path, frames, FPS, len(rows), progress)


def draw(
    robot: RobotSpec,
    model: mujoco.MjModel,
    states: Sequence[State],
    captions: Sequence[Sequence[str]],
    width: int,
    height: int,
    camera: str = "overview",
    close_up: bool = True,
) -> Iterator[Picture]:
    """Yield one picture for each of `states`, all from one place that holds them all.

    Args:
        robot: the robot.
        model: its model; it is left in the last state.
        states: of its simulator.
        captions: lines of text for each state.
        width, height: [pixels].
        camera: one of `CAMERAS`.
        close_up: show the cells at the base, in the corner that the robot leaves free.
    """
    points = swept_points(model, states)
    named = {view.name: view for view in views(robot)}
    view = fitted_view(named[camera], points, width, height)
    side = max(SMALLEST_SIDE, round(_INSET * min(width, height)))
    corner = emptiest_corner(view, points, width, height, (side, side))
    text = caption_size(captions[-1], height)
    beside = emptiest_corner(view, points, width, height, text, taken=corner)
    data = mujoco.MjData(model)
    options = mujoco.MjvOption()
    options.sitegroup[:] = 0
    with ExitStack() as opened:
        large = opened.enter_context(open_renderer(model, width, height))
        inset = opened.enter_context(open_renderer(model, side, side)) if close_up else None
        for state, lines in zip(states, captions, strict=True):
            put(state, model, data)
            large.update_scene(data, free_camera(view), options)
            image = large.render()
            if inset is not None:
                inset.update_scene(data, free_camera(named["detail"]), options)
                image = with_inset(image, inset.render(), corner)
            yield with_caption(image, lines, beside)


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


def _check(path: str | os.PathLike[str], suffix: str, camera: str, width: int, height: int) -> None:
    """Raise what would otherwise be raised only after the simulation."""
    if suffix_of(path) != suffix:
        raise InputError(f"{os.fspath(path)}: the file's name must end in {suffix}")
    if camera not in CAMERAS:
        raise unknown("camera", camera, CAMERAS)
    empty = mujoco.MjModel.from_xml_string("<mujoco/>")
    open_renderer(empty, width, height).close()


def _simulated(
    robot: RobotSpec,
    inputs: Inputs,
    gravity_mps2: Sequence[float],
    rows: Sequence[int],
    ramp_s: float,
    progress: bool,
) -> tuple[mujoco.MjModel, list[State]]:
    """Return the model, and its state at each of the given rows of `inputs`."""
    wanted, states = set(rows), {}
    models: list[mujoco.MjModel] = []

    def keep(simulator: Simulator, row: int) -> None:
        models[:] = [simulator.model]
        if row in wanted:
            states[row] = state_of(simulator)

    gravity = np.asarray(gravity_mps2, dtype=float)
    run = simulate(robot, inputs, gravity, ramp_s=ramp_s, progress=progress, on_row=keep)
    if run.failure is not None:
        raise SimulationDiverged(run.failure)
    return models[0], [states[row] for row in rows]


def caption(robot: RobotSpec, inputs: Inputs, row: int) -> list[str]:
    """Return the row's time and inputs as lines of text."""
    lines = [f"t = {inputs.time_s[row]:.2f} s"]
    values = channel_inputs(robot, slice_inputs(inputs, slice(row, row + 1)))[0]
    for column, value in zip(input_channels(robot, inputs.actuation), values, strict=True):
        name, _, unit = column.rpartition("_")
        lines.append(f"{name} {value / si_factor(column):.2f} {unit}")
    return lines[:_CAPTION_LINES]
