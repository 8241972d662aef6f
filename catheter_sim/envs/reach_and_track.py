"""The tasks of reaching a point and of following a moving target."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from catheter_sim.arrays import Array, Index
from catheter_sim.core.document import Settings
from catheter_sim.core.robot import RobotSpec
from catheter_sim.envs import EPISODE_STEPS
from catheter_sim.envs.robots import Generators, Path, RobotGroup, random_paths, random_targets
from catheter_sim.envs.tip import (
    CONTROL_STEP_S,
    DIVERGED_REWARD,
    TARGET_CLEARANCE,
    Bounds,
    TipEnv,
    checked_flag,
    checked_whole,
    require_reachable,
)

# ----------------------------------------------------------------------------------------------------
# The task of bringing the tip of a robot to a point and resting there.

HOLD_STEPS = 5  # assumed: half a second
REST_S = 1.0  # assumed: at rest is a tip that would take longer than this for one tolerance


class ReachEnv(TipEnv):
    """Bring the tip of a tendon- or rod-driven robot to a target, and rest there.

    ## The robot

    Any robot of the package, in its MuJoCo simulation with tendon friction and effects. So the way matters:
    the same inputs give other postures on the way out and on the way back. (The two nominal mitral
    catheters have no friction.) A control step is 0.1 s of simulated time. With
    `dynamics="quasi-static"`, the default, the robot follows its inputs with a lag (the relaxation time of
    its dynamics, 0.05 s by default) and without overshoot: its mass has weight, but no inertia. With
    `dynamics="inertial"` it moves as its masses and its own damping let it, from rest at every reset; the
    published robots' damping is assumed (`settings` may set `dynamics.damping_time_s`). There is no contact:
    not with surroundings, not with itself (but for the rolling joints').

    ## Action

    `Box(-1, 1, (d,), float32)`: for each drive how far its level moves in this step, in shares of the
    largest change, 0.05 (the rate is limited to 0.5 a second). Levels stay in their ranges; within
    the step the inputs move linearly.

    - `action_type="tension"`: a drive is an input channel of the robot, each antagonist its own. Level
      0 is slack, level 1 the tension at which it alone would bend a segment by `largest_bend_rad` if
      there were no friction; for rolling joints 100 N at most (chest_tube_2025, Table I).
    - `action_type="displacement"` (not for robots of rolling joints, whose rods know tension only): a
      drive is the bend asked of one segment in one direction, level -1 to 1 for minus to plus
      `largest_bend_rad`. Each tendon is pulled in or paid out by what these bends shorten or lengthen
      its path (constant curvature), antagonists together. Of a catheter (displacement only) a drive is
      a channel, the displacement of a pair on its pulley: level -1 to 1 is where inextensible taut
      tendons bring the joint to its limits, and its angle is not linear in it. A tube's level 0 to 1 is
      an advance by its stroke, 60 mm in 2 s. Where an effect sends a pair beyond the end of its joint,
      gaps closed or tendon unwound, the drive stops there.

    `drives.names` names the drives, `drives.tendon` holds the tendons' inputs at level 1.
    `NeuroendoscopeReach-v0` has four tension drives: distal right and left up to 0.32 N, proximal
    right and left up to 0.39 N (a side's two tendons together). `ChestTubeReach-v0` has eight, its rods.
    Base and middle right have up to 24.0 N and left up to 26.6 N, tip right and left up to 19.5 N, tip
    front and back up to 44.3 N. Rods bend what they pass too: the middle's ranges end where the
    base is bent so far. `ChestTubeSectionReach-v0` has one, up to 50.2 N (`largest_bend_rad` is 3).
    `MitralTransseptalReach-v0` has four displacements: bending 3.82 mm (120 deg), proximal torsion 3.12 mm
    and distal torsion 3.29 mm (75 deg), advance 60 mm. `Mitral4dofReach-v0` too: proximal bending 3.38 mm
    (90 deg), distal bending 4.49 mm (120 deg), torsion 2.75 mm (75 deg), advance 60 mm. Their last
    torsion turns the tool about its axis and does not move the tip: three drives matter here.

    ## Observation

    A flat `Box` of float32, all parts finite and of order one. `layout` maps names to slices. L is the
    length of the straight robot (of a catheter with its tube all out: 117.34 mm and 108.18 mm). s and t are
    its numbers of segments and tendons (of a catheter pairs and tube). b is that of its bends: 2 s, of a
    catheter one for each joint.

    | part | size | what | unit |
    |---|---|---|---|
    | `target` | 3 | the target, base frame | L |
    | `tip` | 3 | the tip, base frame | L |
    | `tip_direction` | 3 | unit vector along the tip's axis | 1 |
    | `tip_velocity` | 3 | mean velocity of the tip over the last step | L/s |
    | `level` | d | levels of the drives | range |
    | `tension` | t | tensions at the actuators | ranges of the tension drives |
    | `bend` | b | bend of each segment toward +x and +y, its joints' sums | half turns |
    | | | of a catheter: torsion, bend and advance of its joints, base to tip | half turns; strokes |
    | `held` | 1 | share of `hold_steps` for which the tip has been at rest at the target | 1 |

    The tension of a catheter's pair is the tauter tendon's, in shares of what holds its bending joint
    at the limit (torsion joints and tube: of the largest of these; a tube has none).
    Tip, direction and velocity are as measured, effects on the outputs included. What lies beyond the bounds
    of the space is cut off (only displacement drives reach them, by tension). Friction has a memory
    that is not in the observation: the tensions between the tendons' holes.

    ## Reward

    Minus the distance of the tip from the target, in robot lengths, after each step. Nothing is added
    at success: the episode, and with it the cost, ends. A simulation that diverges costs 200, as much
    as 100 steps at the largest distance there is.

    ## Episode

    It starts at rest with slack tendons, under gravity if there is any. It terminates with success
    where the tip has been at rest at the target after each of `hold_steps` steps in a row. It must be
    within `tolerance_m` of it, and in this step slower than one tolerance a second. It also terminates
    where the simulation diverges (`info["diverged"]`), with the last finite observation. The registered
    environments are truncated after 100 steps (10 s).

    The default tolerance is the target value of Kato 2016 (doi 10.1007/s11548-015-1310-2): a mean
    error of 5 mm leaves good margins in aiming at a tumour of 2 cm. `ChestTubeReach-v0` keeps it (1.3 %
    of the robot's length). The single sections and the mitral catheters ask for 2 mm, the notched wrist, 6 mm
    long, for 0.2 mm (assumed).

    The tip has to stay, for half a second (5 steps, assumed), because chance passes through targets. The
    tip of a section moves on a curve, and friction holds it still where random actions turn about. After
    random actions it is at rest at the target in some step of 11 of 100 episodes of
    `NeuroendoscopeReach-v0`, and of 12 and 2 of `NeuroendoscopeSectionReach-v0` and
    `ChestTubeSectionReach-v0`. For 5 steps in 1, 0 and 0.

    ## Reset

    `reset(seed=...)` draws a target by driving the simulated robot from rest with random inputs to
    where it settles: every target is reachable. It lies at least a tenth of the robot's length from
    the tip at rest. `options={"target": (x, y, z)}` sets it instead, in m in the base frame; one that
    the simulated robot cannot be brought to within the tolerance is refused. The search drives it
    from rest and takes about a second.

    `info` of `reset` and `step`, in the units of files, which stand at the end of the names: `tip_mm`,
    `target_mm` (true ones, base frame), `distance_mm`, `speed_mm_per_s`, `commanded_tension_N` or
    `commanded_displacement_mm` (of each tendon), `is_success`, `diverged`. And `drawn`, of what is
    `randomised`: each key and the value of this episode, in the key's unit.

    ## Arguments

    - `robot`: a robot id, the path of a robot `.toml`, or a robot (`cs.load_robot`).
    - `settings`: a text `KEY=VALUE` as for `--set`, a list of such texts, or a mapping of keys to values
      (`{"friction.mu": 0}`); effects included (`"effects.backlash.width_N=0.02"`).
    - `action_type`: "tension" or "displacement"; default: the robot's own.
    - `gravity_mps2`: in the base frame, default none.
    - `tolerance_m`, `hold_steps`: see Episode.
    - `dynamics`: "quasi-static" or "inertial", see The robot.
    - `largest_bend_rad`: sets the drives' ranges, but not of catheters, which have their joints' limits
      and refuse it; default a quarter turn (assumed), but 3 rad in `ChestTubeSectionReach-v0`, so that its
      rod goes through the tensions of the prototype's published measurement, up to 47.9 N. With friction
      it bends by 2.5 rad there.
    - `render_mode`: None or "rgb_array".
    - `randomised`: settings that are drawn evenly within bounds, with a robot built at every reset:
      `{"friction.mu": (0.1, 0.5), "effects.actuation_gain.scale": (0.9, 1.1)}`. They may change the drives'
      ranges with them, where these depend on what is drawn (a stiffness, a radius).
    - `observation`: "state", as above, or "pixels": a picture, `Box(0, 255, (height, width, 3), uint8)`, of
      what the simulation is, not of what is measured. `info` is the same.
    - `width`, `height`: of the picture [pixels]; default 640 and 480, as observation 64 and 64. The target is
      a green sphere of the tolerance's radius.
    """

    reset_options: ClassVar[tuple[str, ...]] = ("target",)

    def __init__(
        self,
        robot: RobotSpec | str | os.PathLike[str],
        settings: Settings = (),
        action_type: str | None = None,
        *,
        hold_steps: int = HOLD_STEPS,
        **arguments: Any,
    ) -> None:
        """Build the robot; see the class's text.

        Raises:
            InputError: an argument is impossible.
        """
        self.hold_steps = checked_whole("hold_steps", hold_steps)
        self._checked_targets: set[tuple[float, ...]] = set()
        super().__init__(robot, settings, action_type, **arguments)

    def make_rows(self, count: int) -> None:
        """Make room for so many robots."""
        super().make_rows(count)
        self._held = np.zeros(count, dtype=int)

    def given_goal(self, options: Mapping[str, Any]) -> Array | None:
        """Return the target that options of a reset set; one that was found in reach is not sought again."""
        target_m = options.get("target")
        if target_m is None:
            return None
        try:
            known = tuple(float(value) for value in target_m)
        except (TypeError, ValueError):
            known = ()
        if self.randomised or known not in self._checked_targets:
            known = tuple(require_reachable(self.plant, target_m, self.tolerance_m))
            self._checked_targets.add(known)
        return np.array(known)

    def draw_goals(self, robots: RobotGroup, chosen: Index, rngs: Generators) -> list[Array]:
        clearance = TARGET_CLEARANCE * self.length_m
        return [found.tip_m for found in random_targets(self.plant, robots, chosen, rngs, clearance)]

    def set_goals(self, chosen: Index, goals: list[Array]) -> None:
        self.targets_m[chosen], self._held[chosen] = goals, 0

    def judge_rows(self, stepped: Index) -> tuple[Array, np.ndarray]:
        distance, lost = self._distance()[stepped], self.diverged[stepped]
        speed = np.linalg.norm(self._now.velocity[stepped], axis=1)
        there = arrived(distance, speed, self.tolerance_m) & ~lost
        self._held[stepped] = np.where(there, self._held[stepped] + 1, 0)
        rewards = np.where(lost, DIVERGED_REWARD, -distance / self.length_m)
        return rewards, (self._held[stepped] >= self.hold_steps) | lost

    def _more_bounds(self) -> Bounds:
        return {"held": (np.zeros(1), 1.0)}

    def _more_parts(self) -> Mapping[str, Array]:
        return {"held": self._held[:, np.newaxis] / self.hold_steps}

    def _task_info(self) -> Mapping[str, np.ndarray]:
        return {"is_success": self._held >= self.hold_steps}


def arrived(distance_m: Any, speed_m_per_s: Any, tolerance_m: float) -> Any:
    """Return whether a tip is at rest at its target, or many tips, shapes (...)."""
    return (distance_m <= tolerance_m) & (speed_m_per_s < tolerance_m / REST_S)


# ----------------------------------------------------------------------------------------------------
# The task of following a moving target with the tip of a robot, in place and direction.

DIRECTION_TOLERANCE_RAD = math.radians(10.0)  # assumed
DIRECTION_WEIGHT = 0.1  # assumed: robot lengths that a half turn of the tip costs


class TrackEnv(TipEnv):
    """Keep the tip of a tendon- or rod-driven robot at a moving target, and look where it looks.

    ## The robot and the action

    As in `ReachEnv`: any robot of the package in its MuJoCo simulation, friction and effects
    included, 0.1 s a step; an action says how far each drive's level moves, in shares of 0.05.

    ## The target

    It starts at the tip at rest and moves for 100 steps (10 s) on a way that this very robot has gone. At
    reset the simulated robot is driven from rest to random levels and on to others, gently, a level moving
    by 0.047 a step at most. The tip's place and direction after each step are the target's. So
    there are actions that follow it exactly, through friction and effects; it goes at least a tenth of
    the robot's length away from the tip at rest.

    ## Observation

    A flat `Box` of float32; `layout` maps names to slices. First the target, then what
    `ReachEnv` shows of the robot (`tip` to `bend`); L is the length of the straight robot.

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

    `info` of `reset` and `step`: that of `ReachEnv`, `is_success` at the end of the way only, and
    `angle_deg`, `rms_distance_mm` and `rms_angle_deg` (over the steps so far).

    ## Arguments

    Those of `ReachEnv` but `hold_steps`, and `time_left`: whether the observation holds it. The
    registered environments have its tolerances: 5 mm, and 2 mm for single sections and catheters.
    """

    goal = ("target", "target_direction", "target_velocity")

    def __init__(
        self, robot: RobotSpec | str | os.PathLike[str], *rest: Any, time_left: bool = False, **arguments: Any
    ) -> None:
        """Build the robot; see the class's text.

        Raises:
            InputError: an argument is impossible.
        """
        self.time_left = checked_flag("time_left", time_left)
        super().__init__(robot, *rest, **arguments)

    def make_rows(self, count: int) -> None:
        """Make room for so many robots."""
        super().make_rows(count)
        self._levels = np.zeros((count, EPISODE_STEPS + 1, len(self.drives.names)))
        self._way, self._looking = np.zeros((2, count, EPISODE_STEPS + 1, 3))
        self._steps = np.zeros(count, dtype=int)
        self._squares = np.zeros((count, 2))

    @property
    def path(self) -> Path:
        """The whole way of this episode."""
        return Path(self._levels[0], self._way[0], self._looking[0])

    def draw_goals(self, robots: RobotGroup, chosen: Index, rngs: Generators) -> list[Path]:
        clearance = TARGET_CLEARANCE * self.length_m
        return random_paths(self.plant, robots, chosen, rngs, clearance, EPISODE_STEPS, CONTROL_STEP_S)

    def set_goals(self, chosen: Index, goals: list[Path]) -> None:
        self._steps[chosen], self._squares[chosen] = 0, 0.0
        self._levels[chosen] = [goal.level for goal in goals]
        self._way[chosen] = [goal.tip_m for goal in goals]
        self._looking[chosen] = [goal.direction for goal in goals]
        self.targets_m[chosen] = self._way[chosen, 0]

    def judge_rows(self, stepped: Index) -> tuple[Array, np.ndarray]:
        self._steps[stepped] = np.minimum(self._steps[stepped] + 1, EPISODE_STEPS)
        self.targets_m[stepped] = self._way[stepped, self._steps[stepped]]
        distance, angle = self._distance()[stepped], self._angle_rad()[stepped]
        lost = self.diverged[stepped]
        self._squares[stepped[~lost]] += np.square(np.stack([distance, angle], axis=1)[~lost])
        rewards = np.where(lost, DIVERGED_REWARD, -cost_of(distance, angle, self.length_m))
        return rewards, lost

    def over(self) -> np.ndarray:
        return (self._steps == EPISODE_STEPS) & ~self.diverged

    def _wanted(self) -> Array:
        """Return the directions in which the tips' axes are wanted now, shape (n, 3)."""
        return self._looking[np.arange(len(self._steps)), self._steps]

    def _angle_rad(self) -> Array:
        return np.asarray(angle_between(self._now.direction, self._wanted()))

    def _goal(self) -> Mapping[str, Array]:
        after = np.minimum(self._steps + 1, EPISODE_STEPS)
        following = self._way[np.arange(len(after)), after]
        return {
            "target": self.targets_m / self.length_m,
            "target_direction": self._wanted(),
            "target_velocity": (following - self.targets_m) / (CONTROL_STEP_S * self.length_m),
        }

    def _more_bounds(self) -> Bounds:
        return {"time_left": (np.zeros(1), 1.0)} if self.time_left else {}

    def _more_parts(self) -> Mapping[str, Array]:
        left = 1.0 - self._steps[:, np.newaxis] / EPISODE_STEPS
        return {"time_left": left} if self.time_left else {}

    def _task_info(self) -> Mapping[str, np.ndarray]:
        distance, angle = np.sqrt(self._squares / np.maximum(self._steps, 1)[:, np.newaxis]).T
        return {
            "angle_rad": self._angle_rad(),
            "rms_distance_m": distance.copy(),
            "rms_angle_rad": angle.copy(),
            "is_success": followed(distance, angle, self.tolerance_m) & self.over(),
        }


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
