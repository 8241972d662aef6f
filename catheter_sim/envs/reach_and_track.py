"""The tasks of reaching a point and of following a moving target, with simple controllers."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.document import Settings
from catheter_sim.core.robot import RobotSpec
from catheter_sim.envs import EPISODE_STEPS
from catheter_sim.envs.robots import Path, Plant, change_toward
from catheter_sim.envs.tip import (
    CONTROL_STEP_S,
    DIVERGED_REWARD,
    RATE_PER_S,
    TARGET_CLEARANCE,
    Action,
    Bounds,
    Observation,
    TipEnv,
    checked_flag,
    checked_options,
    checked_whole,
    frictionless_level,
    random_path,
    random_target,
    require_reachable,
)
from catheter_sim.pictures.images import Picture

# ----------------------------------------------------------------------------------------------------
# The task of bringing the tip of a robot to a point and resting there.

HOLD_STEPS = 5  # assumed: half a second
REST_S = 1.0  # assumed: at rest is a tip that would take longer than this for one tolerance


class ReachEnv(TipEnv):
    """Bring the tip of a tendon- or rod-driven robot to a target, and rest there.

    ## The robot

    Any robot of the package, in its MuJoCo simulation with tendon friction (so that the way matters:
    the same inputs give other postures on the way out and on the way back; the two nominal mitral
    catheters have none), with its effects. A control step is 0.1 s of simulated time. With
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
    right and left up to 0.39 N (a side's two tendons together). `ChestTubeReach-v0` has eight, its
    rods: base and middle right up to 24.0 N and left up to 26.6 N, tip right and left up to 19.5 N,
    tip front and back up to 44.3 N. Rods bend what they pass too: the middle's ranges end where the
    base is bent so far. `ChestTubeSectionReach-v0` has one, up to 50.2 N (`largest_bend_rad` is 3).
    `MitralTransseptalReach-v0` has four displacements: bending 3.82 mm (120 deg), proximal torsion 3.12 mm
    and distal torsion 3.29 mm (75 deg), advance 60 mm. `Mitral4dofReach-v0` too: proximal bending 3.38 mm
    (90 deg), distal bending 4.49 mm (120 deg), torsion 2.75 mm (75 deg), advance 60 mm. Their last
    torsion turns the tool about its axis and does not move the tip: three drives matter here.

    ## Observation

    A flat `Box` of float32, all parts finite and of order one; `layout` maps names to slices, L is
    the length of the straight robot (of a catheter with its tube all out: 117.34 mm and 108.18 mm), s
    and t its numbers of segments and tendons (of a catheter pairs and tube), b that of its bends: 2 s, of
    a catheter one for each joint.

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
    where the tip has been at rest at the target after each of `hold_steps` steps in a row: within
    `tolerance_m` of it, and in this step slower than one tolerance a second. It also terminates where
    the simulation diverges (`info["diverged"]`), with the last finite observation. The registered
    environments are truncated after 100 steps (10 s).

    The default tolerance is the target value of Kato 2016 (doi 10.1007/s11548-015-1310-2): a mean
    error of 5 mm leaves good margins in aiming at a tumour of 2 cm. `ChestTubeReach-v0` keeps it (1.3 %
    of the robot's length). The single sections and the mitral catheters ask for 2 mm, the notched wrist, 6 mm
    long, for 0.2 mm (assumed).

    The tip has to stay, for half a second (5 steps, assumed), because chance passes through targets: the tip
    of a section moves on a curve, and friction holds it still where random actions turn about. After random
    actions it is at rest at the target in some step of 11 of 100 episodes of `NeuroendoscopeReach-v0`, and of
    12 and 2 of `NeuroendoscopeSectionReach-v0` and `ChestTubeSectionReach-v0`; for 5 steps in 1, 0 and 0.

    ## Reset

    `reset(seed=...)` draws a target by driving the simulated robot from rest with random inputs to
    where it settles: every target is reachable. It lies at least a tenth of the robot's length from
    the tip at rest. `options={"target": (x, y, z)}` sets it instead, in m in the base frame; one that
    the simulated robot cannot be brought to within the tolerance is refused. The search drives it
    from rest and takes about a second.

    `info` of `reset` and `step`, in the units of files, which stand at the end of the names: `tip_mm`,
    `target_mm` (true ones, base frame), `distance_mm`, `speed_mm_per_s`, `commanded_tension_N` or
    `commanded_displacement_mm` (of each tendon), `is_success`, `diverged`; and `drawn`, of what is
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
    - `randomised`: settings that are drawn evenly within bounds, and the robot built anew, at every reset:
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
        self.hold_steps, self._held = checked_whole("hold_steps", hold_steps), 0
        super().__init__(robot, settings, action_type, **arguments)

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Observation | Picture, dict[str, Any]]:
        """Start an episode; see the class's text.

        Args:
            seed: of the random targets from now on; None: go on with the present generator.
            options: `{"target": (x, y, z)}` [m], or nothing for a random target.

        Raises:
            InputError: an unknown option, or a target that is out of reach.
        """
        super().reset(seed=seed, options=options)
        if self.randomised:
            self._checked_targets.clear()
        given = self.target_of(options or {})
        if given is None:
            clearance = TARGET_CLEARANCE * self.length_m
            given = random_target(self.plant, self.np_random, clearance).tip_m
        self.target_m = given
        self._held = 0
        self._start()
        return self._observation(), self._info()

    def step(self, action: Action) -> tuple[Observation | Picture, float, bool, bool, dict[str, Any]]:
        """Move the drives for one control step; see the class's text."""
        if not self._moved(action):
            self._held = 0
            return self._observation(), DIVERGED_REWARD, True, False, self._info()
        speed = np.linalg.norm(self._now.velocity)
        self._held = self._held + 1 if arrived(self._distance_m, speed, self.tolerance_m) else 0
        info = self._info()
        return self._observation(), -self._distance_m / self.length_m, info["is_success"], False, info

    def target_of(self, options: Mapping[str, Any]) -> Array | None:
        """Return the target that options of `reset` set, shape (3,) [m], or None.

        Raises:
            InputError: an unknown option, or a target that is out of reach.
        """
        target = checked_options(options, self.reset_options).get("target")
        return None if target is None else self._reachable(target)

    @cached_property
    def _checked_targets(self) -> set[tuple[float, ...]]:
        """Targets that were found in reach."""
        return set()

    def _reachable(self, target_m: Any) -> Array:
        """Return `target_m`; one that was found in reach before is not sought again."""
        try:
            known = tuple(float(value) for value in target_m)
        except (TypeError, ValueError):
            known = ()
        if known in self._checked_targets:
            return np.array(known)
        target = require_reachable(self.plant, target_m, self.tolerance_m)
        self._checked_targets.add(tuple(target))
        return target

    def _observation(self) -> Observation | Picture:
        return self._observed({"target": self.target_m / self.length_m})

    def _info(self) -> dict[str, Any]:
        return self._handed_out({**self._common_info(), "is_success": self._held >= self.hold_steps})

    def _more_bounds(self) -> Bounds:
        return {"held": (np.zeros(1), 1.0)}

    def _more_parts(self) -> Mapping[str, Array]:
        return {"held": np.array([self._held / self.hold_steps])}


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


# ----------------------------------------------------------------------------------------------------
# Simple controllers that reach targets and follow them: what a learned one is to be measured against.

GAIN = 0.3  # share of the way to the target in one step; the robot follows within a step or two
# The same of a moving target, whose own motion is added: friction takes a part of every change of a rod's or
# tendon's pull, all of it just after a reversal. From 2 on the catheters begin to swing.
FOLLOWING_GAIN = 1.5
LOOKING = 0.1  # robot lengths that a wrong direction weighs, per radian
# A bend that is farther than this from the planned one, in half turns, may belong to another branch.
_OTHER_BRANCH = 0.15


def resolved_rate(env: ReachEnv, observation: Observation) -> Action:
    """Return the action that moves the tip toward the target by the frictionless Jacobian.

    Actions add up in the drives' levels, so that it goes on pulling where friction holds the robot.
    Straight to the target may end at a joint's limit, before a point that only another branch of
    postures reaches. A robot whose drives set its bends one by one (a catheter) therefore first goes
    near the posture in which the frictionless robot is at the target.

    Args:
        env: for the robot's lengths, drives and quick model; its state is not read.
        observation: of `env`.
    """
    part = _parts(env, observation)
    way = (part["target"] - part["tip"]) * env.length_m
    unit = env.plant.quick.bend_unit
    bend = part["bend"].reshape(unit.shape) * unit
    largest = RATE_PER_S * CONTROL_STEP_S
    if env.plant.quick.sets_bends:
        ahead = _planned_bends(env.plant, tuple(part["target"] * env.length_m)) - bend
        if np.abs(ahead / unit).max() > _OTHER_BRANCH:
            change = np.linalg.solve(env.drives.bend, GAIN * ahead)
            return np.clip(change / largest, -1.0, 1.0).astype(np.float32)
    return _toward(env, part["level"], GAIN * way, env.plant.quick.tip_slopes(part["level"], bend))


def following(env: TrackEnv, observation: Observation) -> Action:
    """Return the action that keeps the tip at a moving target by the frictionless Jacobian.

    The tip is to go where the target goes in the step to come, and one and a half times the way that it
    is behind; to turn toward the target's direction weighs less. The way began at rest and knows no other
    branch.

    Args:
        env: for the robot's lengths, drives and quick model; its state is not read.
        observation: of `env`.
    """
    part = _parts(env, observation)
    unit = env.plant.quick.bend_unit
    bend = part["bend"].reshape(unit.shape) * unit
    behind = FOLLOWING_GAIN * (part["target"] - part["tip"]) + part["target_velocity"] * CONTROL_STEP_S
    turned = FOLLOWING_GAIN * (part["target_direction"] - part["tip_direction"])
    looking = LOOKING * env.length_m
    quick = env.plant.quick
    slopes = np.concatenate(
        [quick.tip_slopes(part["level"], bend), looking * quick.direction_slopes(part["level"], bend)]
    )
    return _toward(env, part["level"], np.concatenate([env.length_m * behind, looking * turned]), slopes)


def _parts(env: TipEnv, observation: Observation) -> dict[str, Array]:
    return {name: observation[place].astype(float) for name, place in env.layout.items()}


def _toward(env: TipEnv, level: Array, way: Array, slopes: Array) -> Action:
    """Return the action that goes `way`, shape (m,), as near as the drives can, by slopes (m, d)."""
    largest = RATE_PER_S * CONTROL_STEP_S
    least = np.clip(env.drives.lowest - level, -largest, 0.0)
    most = np.clip(1.0 - level, 0.0, largest)
    return (change_toward(way, slopes, env.length_m, least, most) / largest).astype(np.float32)


def _planned_bends(plant: Plant, target_m: tuple[float, ...]) -> Array:
    """Return the bends with which the frictionless robot is at the target, shape (*b) [rad, m]."""
    if plant.planned is None or plant.planned[0] != target_m:
        level = frictionless_level(plant, np.array(target_m))
        plant.planned = target_m, plant.quick.reach(level[np.newaxis], plant.rest_bends)[1][0]
    return plant.planned[1]
