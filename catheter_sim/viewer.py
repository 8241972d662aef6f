"""A robot in MuJoCo's interactive viewer: sliders for its inputs, its tendons coloured by their tension.

The window is MuJoCo's passive viewer; the steps are `Simulator`'s, friction included. A tendon is drawn
stretch by stretch, so that friction shows as the tension falls along it.
"""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Protocol

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import drives_of
from catheter_sim.core.robot import RobotSpec
from catheter_sim.envs.robots import input_range, quick_model
from catheter_sim.errors import InputError
from catheter_sim.modelling.build import remembered_mjcf
from catheter_sim.pictures.images import paint_tendons, pulled_tendons, stretch_tensions
from catheter_sim.simulation.simulator import Simulator

FRAME_S = 1.0 / 30.0
_SCREEN_VARIABLES = ("DISPLAY", "WAYLAND_DISPLAY")
_ELSEWHERE = "`catheter-sim render` draws to a file and needs none"


class Window(Protocol):
    """What is used of `mujoco.viewer.Handle`."""

    @property
    def user_scn(self) -> Any:
        """What is drawn beside the model."""

    def is_running(self) -> bool:
        """Return whether the window is open."""

    def lock(self) -> AbstractContextManager[Any]:
        """Keep the window from drawing."""

    def sync(self) -> None:
        """Show the state, and take over what the user did."""


@dataclass(frozen=True)
class Ranges:
    """What the sliders reach.

    Attributes:
        least, most: of each tendon's input, of a catheter each pair's, shape (t,) [N, m].
        full_tension: what is drawn in the last colour, of each tendon or pair, shape (t,) [N].
    """

    least: Array
    most: Array
    full_tension: Array


def slider_ranges(robot: RobotSpec, actuation: str) -> Ranges:
    """Return the inputs that bend each segment alone by 90 deg; of a catheter, its joints' own limits.

    Tensions start at slack; displacements go to either side as far as all segments together ask.

    Raises:
        InputError: tendons that bend nothing.
    """
    drives = quick_model(robot, actuation).drives
    ends = np.stack([drives.tendon * drives.lowest, drives.tendon])  # of each drive, (2, t, d)
    lowest, highest = input_range(robot)
    return Ranges(
        least=np.maximum(ends.min(axis=0).sum(axis=1), lowest),
        most=np.minimum(ends.max(axis=0).sum(axis=1), highest),
        full_tension=np.where(drives.tension > 0.0, drives.tension, 1.0),
    )


def slider_names(simulator: Simulator) -> list[str]:
    """Return what the sliders of a simulator's actuators are called: their channels, with a slider's unit.

    Where several tendons share a channel, each has a slider of its own, and the channel's value is their sum.
    """
    names: dict[int, str] = {}
    for drive in drives_of(simulator.robot, simulator.actuation):
        stem = drive.column.rpartition("_")[0]
        unit = drive.quantity.value.partition(",")[0]
        for number, tendon in enumerate(drive.tendons, 1):
            which = f" {number} of {len(drive.tendons)}" if len(drive.tendons) > 1 else ""
            names[tendon] = f"{stem}{which} [{unit}]"
    model = simulator.model
    partners = dict(antagonists(model, len(simulator.robot.tendons)))
    for actuator in range(model.nu):
        if actuator in partners:
            names[actuator] = f"antagonist of {names[partners[actuator]]}"
    return [names.get(actuator, model.actuator(actuator).name) for actuator in range(model.nu)]


def named_model(simulator: Simulator, names: Sequence[str]) -> mujoco.MjModel:
    """Return a simulator's model again, its actuators under other names, to be shown and not to be stepped.

    A window names its sliders by the actuators of the model that it is given. The simulator finds its own
    model's actuators by their names, which no model can change once it is compiled.
    """
    spec = mujoco.MjSpec.from_string(remembered_mjcf(simulator.robot, simulator.actuation))
    for actuator, name in zip(spec.actuators, names, strict=True):
        actuator.name = name
    shown = spec.compile()
    for field in (
        "actuator_ctrlrange",
        "actuator_ctrllimited",
        "geom_pos",
        "site_pos",
        "body_pos",
        "jnt_pos",
    ):
        getattr(shown, field)[:] = getattr(simulator.model, field)
    shown.opt.gravity[:] = simulator.model.opt.gravity
    shown.opt.timestep = simulator.model.opt.timestep
    return shown


def antagonists(model: mujoco.MjModel, count: int) -> list[tuple[int, int]]:
    """Return the actuators, beyond the first `count`, that mirror one of these, and which."""
    found = []
    for actuator in range(count, model.nu):
        pair = model.actuator(actuator).name.replace("antagonist_", "tendon_", 1)
        partner = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, pair)
        if partner not in (actuator, -1):
            found.append((actuator, partner))
    return found


class Sliders:
    """The viewer's control sliders as the inputs of a simulator."""

    def __init__(self, simulator: Simulator, ranges: Ranges) -> None:
        """Set the sliders' ranges in the model."""
        model = simulator.model
        self._least, self._most = ranges.least, ranges.most
        count = len(ranges.least)
        model.actuator_ctrllimited[:] = 1
        model.actuator_ctrlrange[:count] = np.stack([self._least, self._most], axis=1)
        # Of a catheter's pair the antagonist's slider only shows what the pair's own does.
        self._antagonists = antagonists(model, count)
        for actuator, partner in self._antagonists:
            model.actuator_ctrlrange[actuator] = -self._most[partner], -self._least[partner]
        self._command = np.zeros(count)

    def reset(self) -> None:
        """Return to zero inputs."""
        self._command[:] = 0.0

    def read(self, ctrl: Array) -> Array:
        """Return the inputs that the sliders ask for, shape (t,) [N, m]."""
        self._command = np.clip(ctrl[: len(self._command)], self._least, self._most)
        return self._command.copy()

    def show(self, ctrl: Array) -> None:
        """Let the sliders stand where the user left them, whatever play made of it on the way."""
        ctrl[: len(self._command)] = self._command
        for actuator, partner in self._antagonists:
            ctrl[actuator] = -self._command[partner]


class TendonPaint:
    """Draws the tendons of a simulator stretch by stretch."""

    def __init__(self, simulator: Simulator, ranges: Ranges) -> None:
        self._simulator = simulator
        self._pulled = pulled_tendons(simulator.model, simulator.robot)
        self._full = [
            ranges.full_tension[row] if row >= 0 else ranges.full_tension.max() for row in self._pulled.rows
        ]

    def tensions(self) -> tuple[Array, ...]:
        """Return the tension in every straight stretch of each drawn tendon, base to tip [N]."""
        return stretch_tensions(self._simulator, self._pulled)

    def draw(self, scene: mujoco.MjvScene) -> None:
        """Put the tendons into `scene`, as far as it has room."""
        scene.ngeom = 0
        model, data = self._simulator.model, self._simulator.data
        paint_tendons(scene, model, data, self._pulled, self.tensions(), self._full)


def show(
    simulator: Simulator,
    window: Window,
    sliders: Sliders,
    paint: TendonPaint,
    clock: Callable[[], float] = time.perf_counter,
    sleep: Callable[[float], None] = time.sleep,
) -> None:
    """Simulate in real time, or as fast as it goes, until the window is closed.

    The viewer's reset brings the robot back to rest and the sliders to zero.

    Raises:
        SimulationDiverged: it did.
    """
    data, timestep = simulator.data, simulator.model.opt.timestep
    steps = max(1, round(FRAME_S / timestep))
    while window.is_running():
        start, before = clock(), data.time
        with window.lock():
            paint.draw(window.user_scn)
        window.sync()
        if data.time < before:
            sliders.reset()
            simulator.reset()
        else:
            simulator.set_inputs(sliders.read(data.ctrl))
            simulator.step(steps)
            simulator.require_finite()
        sliders.show(data.ctrl)
        sleep(max(0.0, steps * timestep - (clock() - start)))


def no_screen() -> bool:
    """Return whether no window can be opened."""
    try:
        require_screen()
    except InputError:
        return True
    return False


def require_screen() -> None:
    """Raise `InputError` where no window can be opened."""
    if platform.system() == "Linux" and not any(os.environ.get(name) for name in _SCREEN_VARIABLES):
        raise InputError(f"no screen: neither {' nor '.join(_SCREEN_VARIABLES)} is set; {_ELSEWHERE}")
    try:
        import glfw

        # The viewer opens its window in a thread, from which no failure comes back: try one here first.
        opened = bool(glfw.init())
        if opened:
            glfw.window_hint(glfw.VISIBLE, glfw.FALSE)
            trial = glfw.create_window(64, 64, "catheter-sim", None, None)
            opened = trial is not None and bool(trial)
            if opened:
                glfw.destroy_window(trial)
            glfw.terminate()
    except Exception as error:  # a library that is missing, or GLFW's own errors
        raise InputError(f"no screen: {' '.join(str(error).split())}; {_ELSEWHERE}") from None
    if not opened:
        raise InputError(f"no screen: no window can be opened; {_ELSEWHERE}")


def view(robot: RobotSpec, gravity_mps2: tuple[float, float, float]) -> None:
    """Open the viewer on `robot`, with such of its `effects` as act on it, and return when it is closed.

    Raises:
        InputError: there is no screen, the viewer fails, the robot cannot be driven, or an effect acts on
            inputs or outputs.
    """
    require_screen()
    simulator = Simulator(robot, gravity_mps2=gravity_mps2)
    ranges = slider_ranges(robot, simulator.actuation)
    sliders, paint = Sliders(simulator, ranges), TendonPaint(simulator, ranges)
    try:
        import mujoco.viewer as viewer

        shown = named_model(simulator, slider_names(simulator))
        window = viewer.launch_passive(shown, simulator.data)
    except (ImportError, RuntimeError, mujoco.FatalError) as error:
        raise InputError(f"no viewer: {' '.join(str(error).split())}; {_ELSEWHERE}") from None
    with window:
        show(simulator, window, sliders, paint)
