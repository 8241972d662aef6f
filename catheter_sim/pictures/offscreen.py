"""Pictures and videos of a simulated robot under a history of inputs, drawn without a screen."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import channel_inputs, input_channels
from catheter_sim.core.inputs import Inputs, slice_inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, SimulationDiverged, unknown
from catheter_sim.modelling.model_cache import remembered_mjcf
from catheter_sim.pictures.backend import open_renderer
from catheter_sim.pictures.curves import Curves, strip_width
from catheter_sim.pictures.images import ANIMATION, PICTURE, VIDEO, Picture, require_even, suffix_of
from catheter_sim.pictures.images import write_picture as write_picture_file
from catheter_sim.pictures.images import write_video as write_video_file
from catheter_sim.pictures.shots import draw, draw_together
from catheter_sim.pictures.state import State, between, state_of
from catheter_sim.pictures.tendon_paint import PulledTendons, pulled_tendons
from catheter_sim.simulation.replay import RAMP_S, simulate
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.units import si_factor

CAMERAS = ("overview", "side")
FPS = 25
LONGEST_VIDEO_S = 8.0  # longer inputs are played faster
_CAPTION_LINES = 10
_FEW_CHANNELS = 2  # whose inputs stand in one line of a caption


def render(
    robot: RobotSpec,
    inputs: Inputs,
    gravity_mps2: Sequence[float],
    path: str | os.PathLike[str],
    width: int = 1280,
    height: int = 720,
    camera: str = "overview",
    progress: bool = False,
    rows: Sequence[int] = (),
    curves: bool = False,
    states: Sequence[State] = (),
) -> None:
    """Write a picture (.png) or a video (.mp4, .gif), as the file's name says; see the two functions below.

    Raises:
        InputError: also where `rows` or `curves` is given for a file that has no use for it.
    """
    kind = suffix_of(path)
    if kind != PICTURE and rows:
        raise InputError(f"{os.fspath(path)}: several rows are shown in a picture; choices: {PICTURE}")
    if kind == PICTURE and curves:
        raise InputError(f"{os.fspath(path)}: curves stand beside a video; choices: {VIDEO}, {ANIMATION}")
    if kind == PICTURE:
        render_picture(robot, inputs, gravity_mps2, path, width, height, camera, progress, rows, states)
    else:
        render_video(robot, inputs, gravity_mps2, path, width, height, camera, progress, curves, states)


def render_picture(
    robot: RobotSpec,
    inputs: Inputs,
    gravity_mps2: Sequence[float],
    path: str | os.PathLike[str],
    width: int = 1280,
    height: int = 720,
    camera: str = "overview",
    progress: bool = False,
    rows: Sequence[int] = (),
    states: Sequence[State] = (),
) -> None:
    """Write a PNG of the robot at the last row of `inputs`, after all rows before it; or of several rows.

    Tendons are coloured by their tension, along their length; a scale bar, the base frame's axes and what
    the colours mean stand beside the robot.

    Args:
        robot: the robot; its `effects` are not read.
        inputs: rows of inputs, held quasi-statically.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
        path: file to write, `.png`.
        width, height: [pixels].
        camera: where to look from, one of `CAMERAS`; the robot fills the picture.
        progress: show on standard error what is done.
        rows: numbers of the rows to show in one picture, the first 0, the last in full colours; none: the
            last row alone, with a close look at the robot's base.
        states: of a simulation, one a row of `inputs`, where that was made already; none: it is made.

    Raises:
        InputError: bad path, size, camera or row, nothing to draw with, or the simulation diverged.
    """
    _check(path, (PICTURE,), camera, width, height)
    for row in rows:
        if not 0 <= row < len(inputs):
            raise InputError(f"row {row + 1}: the inputs have the rows 1 to {len(inputs)}")
    shown = list(dict.fromkeys(rows)) or [len(inputs) - 1]
    if states:
        model, states = _model_of(robot, inputs), [states[row] for row in shown]
    else:
        model, states = _simulated(robot, inputs, gravity_mps2, shown, RAMP_S, progress)
    if len(shown) > 1:
        labels = [f"{row + 1}" for row in shown]
        lines = [row_words(robot, inputs, row) for row in shown][:_CAPTION_LINES]
        image = draw_together(robot, model, states, labels, lines, width, height, camera)
    else:
        (image,) = draw(robot, model, states, [caption(robot, inputs, shown[0])], width, height, camera)
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
    curves: bool = False,
    states: Sequence[State] = (),
) -> None:
    """Write a video of the robot under `inputs`, in real time or in `LONGEST_VIDEO_S`, whichever is shorter.

    Every frame is simulated: the inputs move linearly from row to row. With `states` given, the robot moves
    evenly from one to the next instead. Arguments and errors are those
    of `render_picture`; the file is an `.mp4`, with even width and height, or a `.gif`. With `curves` the
    inputs' curves take the right part of the picture, and a line in them runs along.
    """
    _check(path, (VIDEO, ANIMATION), camera, width, height)
    if suffix_of(path) == VIDEO:
        require_even(path, width, height)
    times = frame_times(inputs)
    every = resampled(inputs, np.union1d(inputs.time_s, times))
    rows = [int(row) for row in np.searchsorted(every.time_s, times)]
    if states:
        model, states = _model_of(robot, inputs), [_state_at(states, inputs.time_s, time) for time in times]
    else:
        # Frames lie closer than rows: the inputs move no faster than from row to row otherwise.
        ramp_s = RAMP_S * len(inputs) / len(every)
        model, states = _simulated(robot, every, gravity_mps2, rows, ramp_s, progress)
    captions = [caption(robot, every, row) for row in rows]
    strip = strip_width(width) if curves else 0
    frames = draw(robot, model, states, captions, width - strip, height, camera)
    if curves:
        frames = _beside(frames, Curves(robot, inputs, strip, height), [float(time) for time in times])
    write_video_file(path, frames, FPS, len(rows), progress)


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


def _check(
    path: str | os.PathLike[str], suffixes: Sequence[str], camera: str, width: int, height: int
) -> None:
    """Raise what would otherwise be raised only after the simulation."""
    if suffix_of(path) not in suffixes:
        raise InputError(f"{os.fspath(path)}: the file's name must end in {' or '.join(suffixes)}")
    if camera not in CAMERAS:
        raise unknown("camera", camera, CAMERAS)
    empty = mujoco.MjModel.from_xml_string("<mujoco/>")
    open_renderer(empty, width, height).close()


def _model_of(robot: RobotSpec, inputs: Inputs) -> mujoco.MjModel:
    """Return the model that `states` of a simulation under `inputs` are drawn in."""
    return mujoco.MjModel.from_xml_string(remembered_mjcf(robot, inputs.actuation))


def _state_at(states: Sequence[State], time_s: Array, when_s: float) -> State:
    """Return the state at a time within those of the rows."""
    later = int(np.clip(np.searchsorted(time_s, when_s), 1, len(states) - 1)) if len(states) > 1 else 0
    earlier = max(later - 1, 0)
    length_s = float(time_s[later] - time_s[earlier])
    share = (when_s - float(time_s[earlier])) / length_s if length_s else 0.0
    return between(states[earlier], states[later], share)


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
    tendons: list[PulledTendons] = []

    def keep(simulator: Simulator, row: int) -> None:
        if not models or models[0] is not simulator.model:
            models[:], tendons[:] = [simulator.model], [pulled_tendons(simulator.model, robot)]
        if row in wanted:
            states[row] = state_of(simulator, tendons[0])

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
        lines.append(f"{name.replace('_', ' ')} {value / si_factor(column):.2f} {unit}")
    return lines[:_CAPTION_LINES]


def row_words(robot: RobotSpec, inputs: Inputs, row: int) -> str:
    """Return a row's number, and its inputs if they are few, else its time."""
    time, *driven = caption(robot, inputs, row)
    return f"{row + 1}: {', '.join(driven) if len(driven) <= _FEW_CHANNELS else time}"
