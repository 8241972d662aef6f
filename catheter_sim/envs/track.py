"""The task of following a moving target with the tip of a robot, in place and direction."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.envs import EPISODE_STEPS
from catheter_sim.envs.arguments import checked_flag
from catheter_sim.envs.draws import Path
from catheter_sim.envs.observation import Bounds, Observation
from catheter_sim.envs.targets import random_path
from catheter_sim.envs.tip import CONTROL_STEP_S, DIVERGED_REWARD, TARGET_CLEARANCE, Action, TipEnv
from catheter_sim.pictures.images import Picture

DIRECTION_TOLERANCE_RAD = math.radians(10.0)  # assumed
DIRECTION_WEIGHT = 0.1  # assumed: robot lengths that a half turn of the tip costs


class TrackEnv(TipEnv):
    """Keep the tip of a tendon- or rod-driven robot at a moving target, and look where it looks.

    ## The robot and the action

    As in `reach.ReachEnv`: any robot of the package in its MuJoCo simulation, friction and effects
    included, 0.1 s a step; an action says how far each drive's level moves, in shares of 0.05.

    ## The target

    It starts at the tip at rest and moves for 100 steps (10 s) on a way that this very robot has gone:
    at reset the simulated robot is driven from rest to random levels and on to others, gently, a level
    moving by 0.047 a step at most, and the tip's place and direction after each step are the target's. So
    there are actions that follow it exactly, through friction and effects; it goes at least a tenth of
    the robot's length away from the tip at rest.

    ## Observation

    A flat `Box` of float32; `layout` maps names to slices. First the target, then what
    `reach.ReachEnv` shows of the robot (`tip` to `bend`); L is the length of the straight robot.

    | part | size | what | unit |
    |---|---|---|---|
    | `target` | 3 | where the target is now, base frame | L |
    | `target_direction` | 3 | unit vector that the tip's axis is wanted along | 1 |
    | `target_velocity` | 3 | mean velocity of the target over the step to come; zero at the end | L/s |
    | `time_left` | 1 | last, in `...Track-v1` only: what is left of the way's steps, from 1 to 0 | 1 |

    ## Reward

    Minus the distance of the tip from the target in robot lengths, and minus a tenth of the angle
    between their directions in half turns, after each step. A simulation that diverges costs 200.

    ## Episode

    It starts at rest on the target. It terminates only where the simulation diverges, and is truncated after
    100 steps, where the way ends: the clock is no state of the robot. In `...Track-v0` the observation does
    not hold the time; in `...Track-v1` it does, so that a value of what is still to come can be learned.
    Success is judged at the end: the root mean square distance over all steps is at most `tolerance_m`, and
    the root mean square angle at most 10 degrees (assumed).

    ## Reset

    `reset(seed=...)` draws a way. There are no options.

    `path` holds the whole way: the drives' levels that made it, places and directions.

    `info` of `reset` and `step`: that of `reach.ReachEnv`, `is_success` at the end of the way only, and
    `angle_deg`, `rms_distance_mm` and `rms_angle_deg` (over the steps so far).

    ## Arguments

    Those of `reach.ReachEnv` but `hold_steps`, and `time_left`: whether the observation holds it. The
    registered environments have its tolerances: 5 mm, and 2 mm for single sections and catheters.
    """

    goal = ("target", "target_direction", "target_velocity")
    path: Path
    _step: int
    _squares: np.ndarray

    def __init__(
        self, robot: RobotSpec | str | os.PathLike[str], *rest: Any, time_left: bool = False, **arguments: Any
    ) -> None:
        """Build the robot; see the class's text.

        Raises:
            InputError: an argument is impossible.
        """
        self.time_left, self._step = checked_flag("time_left", time_left), 0
        super().__init__(robot, *rest, **arguments)

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Observation | Picture, dict[str, Any]]:
        """Start an episode; see the class's text.

        Args:
            seed: of the random ways from now on; None: go on with the present generator.
            options: none are known.

        Raises:
            InputError: an option, or a robot whose random inputs move its tip nowhere.
        """
        super().reset(seed=seed, options=options)
        self.path = random_path(
            self.plant, self.np_random, TARGET_CLEARANCE * self.length_m, EPISODE_STEPS, CONTROL_STEP_S
        )
        self._step, self._squares = 0, np.zeros(2)
        self.target_m = self.path.tip_m[0]
        self._start()
        return self._observation(), self._info()

    def step(self, action: Action) -> tuple[Observation | Picture, float, bool, bool, dict[str, Any]]:
        """Move the drives for one control step; see the class's text."""
        finite = self._moved(action)
        self._step = min(self._step + 1, EPISODE_STEPS)
        self.target_m = self.path.tip_m[self._step]
        if not finite:
            return self._observation(), DIVERGED_REWARD, True, False, self._info()
        self._squares = self._squares + np.square([self._distance_m, self._angle_rad()])
        cost = cost_of(self._distance_m, self._angle_rad(), self.length_m)
        return self._observation(), -cost, False, self._step == EPISODE_STEPS, self._info()

    def _more_bounds(self) -> Bounds:
        return {"time_left": (np.zeros(1), 1.0)} if self.time_left else {}

    def _more_parts(self) -> Mapping[str, Array]:
        return {"time_left": np.array([1.0 - self._step / EPISODE_STEPS])} if self.time_left else {}

    def _angle_rad(self) -> float:
        """Return the angle between the tip's axis and the wanted one."""
        return float(angle_between(self._now.direction, self.path.direction[self._step]))

    def _observation(self) -> Observation | Picture:
        following = self.path.tip_m[min(self._step + 1, EPISODE_STEPS)]
        return self._observed(
            {
                "target": self.target_m / self.length_m,
                "target_direction": self.path.direction[self._step],
                "target_velocity": (following - self.target_m) / (CONTROL_STEP_S * self.length_m),
            }
        )

    def _info(self) -> dict[str, Any]:
        distance, angle = np.sqrt(self._squares / max(self._step, 1))
        ended = self._step == EPISODE_STEPS and not self._diverged
        return self._handed_out(
            {
                **self._common_info(),
                "angle_rad": self._angle_rad(),
                "rms_distance_m": float(distance),
                "rms_angle_rad": float(angle),
                "is_success": bool(followed(distance, angle, self.tolerance_m) and ended),
            }
        )


def angle_between(one: Array, other: Array) -> Any:
    """Return the angles between unit vectors (..., 3), exact for small ones too, shape (...) [rad]."""
    apart, along = np.linalg.norm(one - other, axis=-1), np.linalg.norm(one + other, axis=-1)
    return 2.0 * np.arctan2(apart, along)


def cost_of(distance_m: Any, angle_rad: Any, length_m: float) -> Any:
    """Return what a step at these distances and angles costs, shapes (...) [robot lengths]."""
    return distance_m / length_m + DIRECTION_WEIGHT * angle_rad / math.pi


def followed(rms_distance_m: Any, rms_angle_rad: Any, tolerance_m: float) -> Any:
    """Return whether a way with these errors was followed, shapes (...)."""
    return (rms_distance_m <= tolerance_m) & (rms_angle_rad <= DIRECTION_TOLERANCE_RAD)
