"""What the tasks of one tip have in common: a robot that actions move, what is seen of it, pictures."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import gymnasium
import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.core.drive import Quantity
from catheter_sim.core.quick_model import DriveLevels
from catheter_sim.core.robot import RobotSpec
from catheter_sim.core.settings import SAID, Settings, settings_table
from catheter_sim.envs import EPISODE_STEPS
from catheter_sim.envs.arguments import (
    argument_names,
    checked_above_zero,
    checked_action,
    checked_choice,
    checked_options,
    checked_vector,
    refuse_unknown,
)
from catheter_sim.envs.observation import Bounds, Observation, look, observation_space, observe
from catheter_sim.envs.picture import TargetPicture, checked_size
from catheter_sim.envs.plant import Plant
from catheter_sim.envs.randomised import RANDOMISED, check_randomised, drawn_settings, end_settings
from catheter_sim.envs.surroundings import Surround
from catheter_sim.envs.targets import frictionless_reach
from catheter_sim.errors import SimulationDiverged
from catheter_sim.modelling.scene import View, views
from catheter_sim.pictures.framing import fitted_view
from catheter_sim.pictures.images import Picture
from catheter_sim.pictures.state import State
from catheter_sim.units import in_file_units

Action = NDArray[np.float32]
OBSERVATIONS = ("state", "pixels")
ACTION_TYPES = ("tension", "displacement")
DYNAMICS = ("quasi-static", "inertial")
_RENDERED, _OBSERVED = (640, 480), (64, 64)  # default sizes of pictures [pixels]

CONTROL_STEP_S = 0.1  # assumed: two relaxation times of the robots' default dynamics
RATE_PER_S = 0.5  # assumed: at full action a drive goes from rest to its range's end in 2 s
TARGET_TOLERANCE_M = 5e-3  # Kato 2016: target value of 5 mm, from tumours of 2 cm
TARGET_CLEARANCE = 0.1  # assumed: least way from rest to a random target, over the robot's length
DIVERGED_REWARD = -2.0 * EPISODE_STEPS  # the tip is never farther than two lengths: it saves nothing


class RobotEnv(gymnasium.Env[Any, Any]):
    """A robot that moves in one of two ways.

    Attributes:
        dynamics: "quasi-static", or "inertial": the robot swings as its masses and its own damping let it.
    """

    def __init__(self, dynamics: str = DYNAMICS[0]) -> None:
        """Say how; raise `InputError` where there is no such way."""
        self.dynamics: str = checked_choice("dynamics", dynamics, DYNAMICS)


class TipEnv(RobotEnv):
    """A robot whose tip has something to do; what that is, a task's own class says.

    A control step is 0.1 s of simulated time. The arguments are those of `reach.ReachEnv`. An environment may
    be copied and pickled at any time: the copy goes on as the original would; its pictures are drawn by a
    renderer of its own.

    Attributes:
        plant: the simulated robot.
        drives: what moves it.
        length_m: of the straight robot.
        randomised: settings of the robot that are drawn at every reset, and their bounds.
        target_m: where the tip is wanted now, base frame, shape (3,) [m].
        pixels: whether pictures are the observations.
        state_space: of the observations that are no pictures.
        layout: name of a part of these -> where it lies.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - Gymnasium's way
        "render_modes": ["rgb_array"],
        "render_fps": round(1.0 / CONTROL_STEP_S),
    }
    goal: tuple[str, ...] = ("target",)  # what the observation shows of the task, before the robot
    reset_options: ClassVar[tuple[str, ...]] = ()
    _drawn: Mapping[str, float]  # what is changed in the robot now

    def __init__(
        self,
        robot: RobotSpec | str | os.PathLike[str],
        settings: Settings = (),
        action_type: str | None = None,
        gravity_mps2: Sequence[float] = (0.0, 0.0, 0.0),
        tolerance_m: float = TARGET_TOLERANCE_M,
        largest_bend_rad: float | None = None,
        render_mode: str | None = None,
        width: int | None = None,
        height: int | None = None,
        observation: str = "state",
        randomised: Mapping[str, Sequence[float]] | None = None,
        **others: Any,
    ) -> None:
        """Build the robot; the arguments are those of the task's text.

        Raises:
            InputError: an argument is impossible, or the task has none of its name (`others`).
        """
        refuse_unknown(others, argument_names(type(self)), type(self).__name__)
        self.render_mode = checked_choice("render_mode", render_mode, self.metadata["render_modes"], True)
        checked_choice("observation", observation, OBSERVATIONS)
        super().__init__(**others)  # what is left are the base's own
        self.pixels = observation == "pixels"
        self._size = checked_size(width, height, _OBSERVED if self.pixels else _RENDERED)
        self.tolerance_m = checked_above_zero("tolerance_m", tolerance_m)
        self._robot, self._settings = robot, settings_table(settings)
        self._action_type = checked_choice("action_type", action_type, ACTION_TYPES, True)
        self._gravity = checked_vector("gravity_mps2", gravity_mps2)
        self._largest_bend_rad = largest_bend_rad
        if largest_bend_rad is not None:
            self._largest_bend_rad = checked_above_zero("largest_bend_rad", largest_bend_rad)
        self.randomised = check_randomised(randomised)
        ends = [end_settings(self.randomised, which) for which in range(2)] if self.randomised else []
        for self._drawn in ({}, *ends):
            self._drawn_robot()
        self._drawn = {}
        self._prepare()
        for self._drawn in ends:  # the bounds themselves must be possible
            self._new_plant()
        self._drawn = {}
        self.plant = self._new_plant()
        self.drives = self.plant.drives
        self.length_m = float(self.plant.segment_length.sum())
        self.target_m = np.zeros(3)
        self._picture: TargetPicture | None = None
        self._begun = self._diverged = False
        actions = len(self.drives.names) + len(self.plant.carriage)
        self.action_space: gymnasium.spaces.Box = gymnasium.spaces.Box(-1.0, 1.0, (actions,), np.float32)
        self.observation_space: gymnasium.spaces.Box
        self.state_space, self.layout = observation_space(self.plant, self.goal, self._more_bounds())
        self.observation_space = self.state_space
        if self.pixels:
            self.observation_space = gymnasium.spaces.Box(0, 255, (*self._size[::-1], 3), np.uint8)
        self._now = look(self.plant)

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Seed the generator and draw the robot anew where it is `randomised`; a task does the rest.

        Raises:
            InputError: an option is not among `reset_options`.
        """
        options = checked_options(options, self.reset_options)
        super().reset(seed=seed)
        self._begun = False  # what fails from here on leaves no episode
        self._drawn = drawn_settings(self.randomised, self.np_random)
        self._renew(options)
        return None, {}

    def render(self) -> Picture | None:  # type: ignore[override]
        """Return a picture of the robot and the target, shape (height, width, 3), or None.

        Raises:
            InputError: no OpenGL context can be had.
        """
        if self.render_mode is None:
            gymnasium.logger.warn("render() draws only where render_mode='rgb_array' was given to make()")
            return None
        return self.drawn(self._now.state, self.target_m)

    def drawn(self, state: State, target_m: Array) -> Picture:
        """Return a picture of the robot in `state` and a target, shape (height, width, 3).

        Raises:
            InputError: no OpenGL context can be had.
        """
        if self._picture is None:
            self._picture = TargetPicture(self.plant.simulator.model, self._view(), *self._size)
        return self._picture.draw(state, target_m, self.tolerance_m)

    def close(self) -> None:
        """Free the renderer; may be called again."""
        if self._picture is not None:
            self._picture.close()
            self._picture = None

    def __getstate__(self) -> dict[str, Any]:
        """Return what a copy is made of: all but the renderer, which is opened anew for the next picture."""
        return {**self.__dict__, "_picture": None}

    def _view(self) -> View:
        """Return where to look from."""
        camera = "side" if self.plant.quick.planar else "overview"
        view = next(view for view in views(self.plant.simulator.robot) if view.name == camera)
        reach = np.concatenate([frictionless_reach(self.plant)[1], np.zeros((1, 3))])
        return fitted_view(view, reach, *self._size)

    def _prepare(self) -> None:
        """Make what the first robot needs; called once, when the arguments have been found possible."""

    def _new_plant(self) -> Plant:
        """Return the simulated robot with the settings that were drawn."""
        return Plant(
            self._drawn_robot(),
            self._action_type,
            tuple(self._gravity),
            self._largest_bend_rad,
            self._surround(),
            self.dynamics == "inertial",
        )

    def _drawn_robot(self) -> RobotSpec:
        """Return the specified robot, changed by the settings that were drawn."""
        said = RANDOMISED if self._drawn else SAID
        return load_robot(self._robot, {**self._settings, **self._drawn}, said)

    def _surround(self) -> Surround | None:
        """Return what puts the robot into surroundings; None: it stands alone."""
        return None

    def _renew(self, options: Mapping[str, Any]) -> None:
        """Build the robot anew, at a reset with these options, where it was drawn anew."""
        if self.randomised:
            self._replace_plant()

    def _replace_plant(self) -> None:
        self.close()
        self.plant = self._new_plant()
        self.drives = self.plant.drives

    def _more_bounds(self) -> Bounds:
        """Return the further parts of the observation, by their names."""
        return {}

    def _base_after(self, change: Array) -> Array | None:
        """Return where the base goes, shape (c,), by the actions that are left for it; None: it stays."""
        return None

    def _start(self) -> None:
        """Bring the robot to rest, drives at zero, for a new episode."""
        self._diverged = False
        self.plant.reset()
        self._now = look(self.plant)
        self._begun = True

    def _moved(self, action: Action) -> bool:
        """Move the drives for one control step; return whether the simulation stayed finite.

        Where it did not, the robot is seen as it was before.

        Raises:
            InputError: the action has another shape, or is not a number.
            ResetNeeded: no episode has begun.
        """
        shape = self.action_space.shape
        wished = checked_action("action", action, shape, f"{shape[0]} numbers are needed")
        if not self._begun:
            raise gymnasium.error.ResetNeeded("step() needs a reset before it")
        drives = len(self.drives.names)
        level = level_after(self.plant.level, wished[:drives], self.drives)
        base = self._base_after(np.clip(wished[drives:], -1.0, 1.0) * CONTROL_STEP_S)
        try:
            self.plant.move(level, CONTROL_STEP_S, base)
        except SimulationDiverged:
            self._diverged = True
            return False
        self._now = look(self.plant, self._now, CONTROL_STEP_S)
        return True

    @property
    def _distance_m(self) -> float:
        """How far the tip is from the target, in truth."""
        return float(np.linalg.norm(self._now.tip - self.target_m))

    def _observed(self, goal: Mapping[str, Array]) -> Observation | Picture:
        if self.pixels:
            return self.drawn(self._now.state, self.target_m)
        return observe(self.plant, self._now, goal, self.state_space, self._more_parts())

    def _more_parts(self) -> Mapping[str, Array]:
        """Return the values of the parts that `_more_bounds` names."""
        return {}

    def _common_info(self) -> dict[str, Any]:
        """Return what every task tells, SI: true places in the base frame and the drives' inputs."""
        return {
            "tip_m": self._now.tip.copy(),
            "target_m": self.target_m.copy(),
            "distance_m": self._distance_m,
            "speed_m_per_s": float(np.linalg.norm(self._now.velocity)),
            commanded_name(self.drives): self.drives.tendon @ self._now.level,
            "diverged": self._diverged,
        }

    def _handed_out(self, told: Mapping[str, Any]) -> dict[str, Any]:
        """Return `info`: what a task tells, SI, in the units of files, and what was drawn of the robot."""
        return {**in_file_units(told), **({"drawn": dict(self._drawn)} if self.randomised else {})}


def commanded_name(drives: DriveLevels) -> str:
    """Return what the tendons' commanded inputs are called in `info`, with their SI unit."""
    return "commanded_tension_N" if drives.quantity is Quantity.TENSION else "commanded_displacement_m"


def level_after(level: Array, action: Array, drives: DriveLevels) -> Array:
    """Return the drives' levels that an action asks for at the end of a step, shapes (..., d)."""
    change = np.clip(action, -1.0, 1.0) * (RATE_PER_S * CONTROL_STEP_S)
    return np.clip(level + change, drives.lowest, 1.0)
