"""What the tasks of one tip have in common: arguments, targets, observations, actions, pictures."""

from __future__ import annotations

import copy
import inspect
import math
import os
from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from numbers import Integral, Real
from typing import Any, ClassVar, NamedTuple

import gymnasium
import mujoco
import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array, Index
from catheter_sim.catalogue import load_robot
from catheter_sim.core.document import SAID, Settings, settings_table
from catheter_sim.core.inputs import Quantity
from catheter_sim.core.published import DriveLevels
from catheter_sim.core.robot import RobotSpec
from catheter_sim.envs import EPISODE_STEPS
from catheter_sim.envs.robots import (
    PULLED_SHARE,
    RAMP_S,
    DrawnPoints,
    Generators,
    Plant,
    RobotAlone,
    RobotGroup,
    change_toward,
)
from catheter_sim.envs.surroundings import Surround
from catheter_sim.errors import InputError, SimulationDiverged, shown, unknown
from catheter_sim.modelling.build import View, views
from catheter_sim.pictures.images import LARGEST_SIDE, SMALLEST_SIDE, Picture, open_renderer
from catheter_sim.pictures.offscreen import DrawnState, fitted_view, free_camera, put
from catheter_sim.units import in_file_units

# ----------------------------------------------------------------------------------------------------
# Checks of what an environment is given: for a wrong argument `InputError` is one line that names it and the
# choices.

_OPEN = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)


def argument_names(environment: type) -> list[str]:
    """Return the names of the arguments of an environment's class, those of its bases included."""
    names: dict[str, None] = {}
    for base in environment.__mro__:
        own = base.__dict__.get("__init__")
        if own is None or base.__module__.split(".")[0] in ("gymnasium", "builtins", "typing"):
            continue
        for name, parameter in inspect.signature(own).parameters.items():
            if name != "self" and parameter.kind not in _OPEN:
                names.setdefault(name)
    return list(names)


def refuse_unknown(given: Iterable[str], choices: Sequence[str], where: str) -> None:
    """Raise `InputError` for the first of the `given` names that is not among `choices`."""
    for name in given:
        if name not in choices:
            raise unknown("argument", name, choices, where)


def checked_choice(name: str, value: Any, choices: Sequence[str], none_too: bool = False) -> Any:
    """Return `value`, one of the texts `choices`, or None where that is one too."""
    if value is None and none_too:
        return None
    if isinstance(value, str) and value in choices:
        return value
    known = [*choices, "None"] if none_too else choices
    if isinstance(value, str):
        raise unknown(name, value, known)
    raise InputError(f"{name} = {shown(value)}: choices: {', '.join(known)}")


def checked_above_zero(name: str, value: Any, most: float = math.inf) -> float:
    """Return `value` as a number above zero, finite, and at most `most`."""
    number = math.nan
    if isinstance(value, Real) and not isinstance(value, bool):
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
    if not (0.0 < number <= most and math.isfinite(number)):
        bound = "zero and finite" if most == math.inf else f"0 and at most {most:g}"
        given = f"{value:g}" if isinstance(value, float) else shown(value)
        raise InputError(f"{name} = {given}: must be above {bound}")
    return number


def checked_whole(name: str, value: Any, least: int = 1) -> int:
    """Return `value` as a whole number, `least` or more."""
    if isinstance(value, bool) or not isinstance(value, Integral) or value < least:
        raise InputError(f"{name} = {shown(value)}: must be a whole number, {least} or more")
    return int(value)


def checked_flag(name: str, value: Any) -> bool:
    """Return `value`, true or false."""
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{name} = {shown(value)}: choices: True, False")
    return bool(value)


def checked_numbers(
    name: str, value: Any, shape: tuple[int, ...], needed: str, infinite_too: bool = False
) -> Array:
    """Return `value` as an array of numbers of `shape`; `needed` says what would be right."""
    numbers = _array(value)
    allowed = (lambda array: ~np.isnan(array)) if infinite_too else np.isfinite
    if numbers is None or numbers.shape != shape or not allowed(numbers).all():
        raise InputError(f"{name} = {shown(value)}: {needed}")
    return numbers


def checked_pair(name: str, value: Any, needed: str) -> tuple[float, float]:
    """Return `value` as two finite numbers, the lower first; `needed` says what would be right."""
    low, high = map(float, checked_numbers(name, value, (2,), needed))
    if low > high:
        raise InputError(f"{name} = {shown(value)}: {needed}")
    return low, high


def checked_actions(value: Any, shape: tuple[int, int], stepping: np.ndarray) -> Array:
    """Return the actions of many environments, a row each; infinite ones count as the largest.

    Only rows that are `stepping`, shape (n,), count: what starts again does not read its own.
    """
    numbers = _array(value)
    if numbers is None or numbers.shape != shape or np.isnan(numbers[stepping]).any():
        raise InputError(f"actions: {shape} numbers are needed, one row for each environment")
    return numbers


def require_running(ended: np.ndarray) -> None:
    """Raise `InputError` where an environment's episode has ended and nothing starts it again."""
    if ended.any():
        which = ", ".join(map(str, np.flatnonzero(ended)))
        raise InputError(f"the episodes of environments {which} have ended: reset them (reset_mask)")


def checked_options(options: Any, choices: Sequence[str]) -> dict[str, Any]:
    """Return the options of a reset, a mapping of some of `choices`."""
    if options is None:
        return {}
    if not isinstance(options, Mapping):
        known = ", ".join(choices) or "(none)"
        raise InputError(f"options = {shown(options)}: a mapping is needed; its keys: {known}")
    for name in options:
        if name not in choices:
            raise unknown("option of reset", name, choices)
    return dict(options)


def checked_seeds(seed: Any, count: int) -> list[int | None]:
    """Return a seed for each of `count` environments: of one seed, the first one's, each next is one more."""
    if seed is None:
        return [None] * count
    if isinstance(seed, Integral) and not isinstance(seed, bool):
        first = checked_whole("seed", seed, 0)
        return [first + one for one in range(count)]
    if isinstance(seed, str) or not isinstance(seed, Sequence | np.ndarray):
        raise InputError(f"seed = {shown(seed)}: a whole number, 0 or more, or {count} of them, is needed")
    if len(seed) != count:
        raise InputError(f"seed: {len(seed)} numbers are given, {count} are needed")
    return [None if own is None else checked_whole("seed", own, 0) for own in seed]


def checked_mask(mask: Any, count: int) -> np.ndarray:
    """Return which of `count` environments `reset_mask` names, as truth values; all where it is None."""
    if mask is None:
        return np.ones(count, dtype=bool)
    if not isinstance(mask, np.ndarray) or mask.dtype != bool or mask.shape != (count,):
        raise InputError(f"reset_mask: an array of {count} booleans is needed")
    if not mask.any():
        raise InputError("reset_mask: at least one environment is to be reset")
    return mask


def _array(value: Any) -> Array | None:
    """Return `value` as an array of real numbers, or None where it is none."""
    try:
        if np.asarray(value).dtype.kind not in "biuf":
            return None
        return np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        return None


# ----------------------------------------------------------------------------------------------------
# What a task shows of its robots: their states at the end of a control step, as one flat array each.

Observation = NDArray[np.float32]

# Bounds of the observation; what lies beyond is cut off.
_PLACE_BOUND = 2.0  # robot lengths
_SPEED_BOUND = 10.0  # robot lengths a second
_TENSION_BOUND = 10.0  # ranges of the tension drives
_BEND_BOUND = 4.0  # half turns, or strokes of an advance
# What a task may ask for: where to be [robot lengths], which way to look, how fast to go [lengths a second].
_GOAL_BOUNDS = {"target": _PLACE_BOUND, "target_direction": 1.0, "target_velocity": _SPEED_BOUND}


class TipState(NamedTuple):
    """Robots at the end of a control step, a row each, SI units."""

    tip: Array  # of the tip, true and as measured, shape (n, 3) [m]
    measured_tip: Array
    direction: Array  # unit vector along the tip's axis, true and as measured, shape (n, 3)
    measured_direction: Array
    velocity: Array  # mean over the step of the two tips, shape (n, 3) [m/s]
    measured_velocity: Array
    level: Array  # of the drives, shape (n, d)
    tension: Array  # at the actuators, shape (n, t) [N]
    bends: Array  # of the robot, as its quick model has them, shape (n, *b) [rad or m]


def look(
    plant: Plant, robots: RobotGroup, chosen: Index, level: Array, before: TipState | None = None
) -> TipState:
    """Return how the chosen ones of `robots`, each a `plant`, stand at levels (k, d).

    `before` is how they stood a control step before; without it they are at rest.
    """
    tip, axes, tension = robots.tips(chosen)
    measured_tip, measured_axes = plant.measured(tip, axes)
    velocity, measured_velocity = np.zeros((2, *tip.shape))
    if before is not None:
        velocity = (tip - before.tip) / CONTROL_STEP_S
        measured_velocity = (measured_tip - before.measured_tip) / CONTROL_STEP_S
    return TipState(
        tip=tip,
        measured_tip=measured_tip,
        direction=axes[..., 2],
        measured_direction=measured_axes[..., 2],
        velocity=velocity,
        measured_velocity=measured_velocity,
        level=level,
        tension=tension,
        bends=robots.bends(chosen),
    )


def observe(
    plant: Plant,
    state: TipState,
    goal: Mapping[str, Array],
    space: gymnasium.spaces.Box,
    more: Mapping[str, Array],
) -> Observation:
    """Return the observations of robots whose states are given, in the units and bounds of `space`, (n, k).

    The task asks for a `goal`, by the names of `_GOAL_BOUNDS` and in their units, each of shape (n, 3);
    `more` are its own further parts, as `observation_space` was given them, shape (n, ...) each.
    """
    length = float(plant.segment_length.sum())
    parts: Mapping[str, Array] = {
        **goal,
        "tip": state.measured_tip / length,
        "tip_direction": state.measured_direction,
        "tip_velocity": state.measured_velocity / length,
        "level": state.level,
        "tension": state.tension / plant.drives.tension,
        "bend": (state.bends / plant.quick.bend_unit).reshape(len(state.tip), -1),
        **more,
    }
    values = np.concatenate(list(parts.values()), axis=-1)
    return np.clip(values.astype(np.float32), space.low, space.high)


Bounds = Mapping[str, tuple[Array, float]]  # name -> lower bounds, shape (n,), and the upper bound


def observation_space(
    plant: Plant, goal: Sequence[str], more: Bounds
) -> tuple[gymnasium.spaces.Box, dict[str, slice]]:
    """Return the space of the observations, and where in them each part lies.

    First the task's `goal`, of `_GOAL_BOUNDS`, then the robot, then `more`, the task's own further parts.
    """
    bounds: Bounds = {
        **{name: (np.full(3, -_GOAL_BOUNDS[name]), _GOAL_BOUNDS[name]) for name in goal},
        "tip": (np.full(3, -_PLACE_BOUND), _PLACE_BOUND),
        "tip_direction": (np.full(3, -1.0), 1.0),
        "tip_velocity": (np.full(3, -_SPEED_BOUND), _SPEED_BOUND),
        "level": (plant.drives.lowest, 1.0),
        "tension": (np.zeros(len(plant.drives.tension)), _TENSION_BOUND),
        "bend": (np.full(plant.quick.bend_unit.size, -_BEND_BOUND), _BEND_BOUND),
        **more,
    }
    ends = np.cumsum([0, *(len(low) for low, _ in bounds.values())])
    layout = {name: slice(int(ends[k]), int(ends[k + 1])) for k, name in enumerate(bounds)}
    lowest = np.concatenate([low for low, _ in bounds.values()]).astype(np.float32)
    highest = np.concatenate([np.full(len(low), high) for low, high in bounds.values()]).astype(np.float32)
    return gymnasium.spaces.Box(lowest, highest, dtype=np.float32), layout


# ----------------------------------------------------------------------------------------------------
# Settings of a robot that are drawn at random within bounds, at every reset of an environment.

Randomised = Mapping[str, tuple[float, float]]  # dotted key of a setting -> bounds, in the key's unit
RANDOMISED = "randomised"  # what errors call such a setting


def check_randomised(randomised: Any) -> Randomised:
    """Return the bounds, least first; none where None is given."""
    if randomised is None:
        return {}
    if not isinstance(randomised, Mapping):
        raise InputError(
            f"{RANDOMISED} = {shown(randomised)}: a mapping of keys to bounds is needed, as in "
            "{'friction.mu': (0.1, 0.5)}"
        )
    needed = "two finite numbers, least first, are needed; values are drawn evenly between them"
    for name in randomised:
        if not isinstance(name, str) or "=" in name or not name.isprintable():
            raise InputError(f"{RANDOMISED}: {shown(name)}: a dotted key is needed, as in friction.mu")
    return {name: checked_pair(f"{RANDOMISED} {name}", item, needed) for name, item in randomised.items()}


def drawn_settings(randomised: Randomised, rng: np.random.Generator) -> dict[str, float]:
    """Return the settings, each value drawn evenly within its bounds."""
    return {name: float(rng.uniform(*bounds)) for name, bounds in randomised.items()}


# ----------------------------------------------------------------------------------------------------
# Pictures of a simulated robot and its target, drawn without a screen.

_ROUND = 16  # corners of the target's outline: the model's thin tendons do with fewer
# Small pictures, as they are observed: without a graphics card it is the triangles that take time, and four
# samples of each more than thrice as many pixels a side, whose mean is smoother.
_SMALL = 128  # pixels a side
_FINER = 3
_SMALL_ROUND = 8
_TARGET_RGBA = (0.10, 0.62, 0.25, 0.75)


def checked_size(width: Any, height: Any, default: tuple[int, int]) -> tuple[int, int]:
    """Return width and height of a picture [pixels]; `default` for what is None."""
    sides = [
        given if side is None else checked_whole(name, side)
        for name, side, given in (("width", width, default[0]), ("height", height, default[1]))
    ]
    least = SMALLEST_SIDE if max(sides) > _SMALL else -(-SMALLEST_SIDE // _FINER)
    for name, side in zip(("width", "height"), sides, strict=True):
        if not least <= side <= LARGEST_SIDE:
            raise InputError(f"{name} = {shown(side)}: a picture has {least} to {LARGEST_SIDE} pixels a side")
    return sides[0], sides[1]


class TargetPicture:
    """An open renderer; model and state are its own, so that drawing leaves the simulation alone."""

    def __init__(self, model: mujoco.MjModel, view: View, width: int, height: int) -> None:
        """Open the renderer of a copy of the robot, width and height in pixels.

        `InputError`: the size is no picture's, or no OpenGL context can be had.
        """
        model = copy.copy(model)
        quality = model.vis.quality
        if max(width, height) <= _SMALL:
            self._finer = _FINER
            quality.offsamples = 0
            quality.numslices, quality.numstacks = _SMALL_ROUND, _SMALL_ROUND // 2
        else:
            self._finer = 1
            quality.numslices = max(quality.numslices, _ROUND)
            quality.numstacks = max(quality.numstacks, _ROUND // 2)
        self._size = height, width
        self._renderer = open_renderer(model, self._finer * width, self._finer * height)
        self._model = model
        self._data = mujoco.MjData(model)
        self._camera = free_camera(view)
        self._options = mujoco.MjvOption()
        self._options.sitegroup[:] = 0

    def draw(self, state: DrawnState, target_m: Array, radius_m: float) -> Picture:
        """Return the robot in `state` with a sphere at `target_m`, shape (height, width, 3)."""
        put(state, self._model, self._data)
        self._renderer.update_scene(self._data, self._camera, self._options)
        scene = self._renderer.scene
        if scene.ngeom < scene.maxgeom:
            mujoco.mjv_initGeom(
                scene.geoms[scene.ngeom],
                mujoco.mjtGeom.mjGEOM_SPHERE,
                np.full(3, radius_m),
                target_m,
                np.eye(3).ravel(),
                np.array(_TARGET_RGBA, dtype=np.float32),
            )
            scene.ngeom += 1
        picture: Picture = self._renderer.render()
        if self._finer == 1:
            return picture
        height, width = self._size
        parts = picture.reshape(height, self._finer, width, self._finer, 3)
        return np.rint(parts.mean(axis=(1, 3))).astype(np.uint8)

    def close(self) -> None:
        """Free the renderer."""
        self._renderer.close()


# ----------------------------------------------------------------------------------------------------
# Points and ways that the tip of a robot reaches: drawn at random, or checked.
#
# A point counts as reachable where the simulated robot comes to it from rest on a straight way of its
# drives, friction, effects and load included. So every target has inputs that are known to reach it, and
# none rests on a model of the workspace.

_STARTS = 4  # places in the range of the drives from which a given point is sought
_APART_RAD = 1.0  # between their bends; a tube's stroke counts as half a turn
_TRIALS = 12  # simulated postures on the way from each of them
_GAIN = 0.95  # a trial that leaves more than this share of the miss is the last from its start
_CORRECTED = 8  # trials from the best posture with slopes corrected by what they showed
_CLOUD = 4000  # draws among which the starts are chosen


def tip_at(plant: Plant, level: Array) -> Array:
    """Return where the tip comes to rest when the drives go from rest to `level`, shape (3,) [m].

    The plant stays there; `SimulationDiverged` is raised where it comes to rest nowhere.
    """
    plant.reset()
    plant.move(level, RAMP_S)
    plant.settle()
    return plant.posture().p_w[-1]


def nearest(plant: Plant, target_m: Array, enough_m: float) -> DrawnPoints:
    """Return the posture whose tip is nearest to `target_m` among those found from several starts.

    The search ends at a posture nearer than `enough_m` [m]; `SimulationDiverged` is raised where the robot
    does not stand even at rest.
    """
    drives, length = plant.drives, float(plant.segment_length.sum())
    plant.reset()
    best = DrawnPoints(plant.level.copy(), plant.posture().p_w[-1])
    best_miss = float(np.linalg.norm(best.tip_m - target_m))
    for start in starts_near(plant, target_m):
        level, least_miss = start, np.inf
        for _ in range(_TRIALS):
            try:
                tip = tip_at(plant, level)
            except SimulationDiverged:
                break
            miss = float(np.linalg.norm(tip - target_m))
            if miss < best_miss:
                best, best_miss = DrawnPoints(level, tip), miss
            if best_miss <= enough_m:
                return best
            if miss > _GAIN * least_miss:
                break
            least_miss = miss
            room = drives.lowest - level, 1.0 - level
            slopes = plant.quick.tip_slopes(level, plant.segment_bends())
            level = level + change_toward(target_m - tip, slopes, length, *room)
    return _corrected(plant, target_m, best, enough_m)


def _corrected(plant: Plant, target_m: Array, found: DrawnPoints, enough_m: float) -> DrawnPoints:
    """Return `found`, or a nearer posture by slopes that learn from every trial (Broyden's update).

    Friction turns and shortens the tip's way; where a robot has many drives, the quick model's slopes
    alone may lead no nearer.
    """
    drives, length = plant.drives, float(plant.segment_length.sum())
    tip_at(plant, found.level)
    slopes = plant.quick.tip_slopes(found.level, plant.segment_bends())
    for _ in range(_CORRECTED):
        room = drives.lowest - found.level, 1.0 - found.level
        change = change_toward(target_m - found.tip_m, slopes, length, *room)
        if not change.any():
            break
        try:
            tip = tip_at(plant, found.level + change)
        except SimulationDiverged:
            break
        slopes = slopes + np.outer(tip - found.tip_m - slopes @ change, change) / (change @ change)
        if np.linalg.norm(tip - target_m) < np.linalg.norm(found.tip_m - target_m):
            found = DrawnPoints(found.level + change, tip)
        if np.linalg.norm(found.tip_m - target_m) <= enough_m:
            break
    return found


def require_reachable(plant: Plant, target_m: Sequence[float], tolerance_m: float) -> Array:
    """Return `target_m`, shape (3,) [m]; `InputError` where the tip comes not within `tolerance_m` of it."""
    target = checked_numbers("target", target_m, (3,), "three finite numbers are needed, x, y and z in m")
    out_of_reach = f"target {_millimetres(target)} mm is out of reach of {plant.specified.name}: "
    away, longest = float(np.linalg.norm(target)), float(plant.segment_length.sum())
    if away > longest + tolerance_m:
        raise InputError(f"{out_of_reach}{away * 1e3:.1f} mm from the base, it is {longest * 1e3:g} mm long")
    if plant.quick.planar and abs(target[1]) > tolerance_m:
        raise InputError(f"{out_of_reach}y must be 0, as it bends in the xz plane only")
    found = nearest(plant, target, tolerance_m)
    miss = float(np.linalg.norm(found.tip_m - target))
    if miss > tolerance_m:
        raise InputError(
            f"{out_of_reach}the tip was brought no nearer than {miss * 1e3:.1f} mm, "
            f"to {_millimetres(found.tip_m)} mm (tolerance {tolerance_m * 1e3:g} mm)"
        )
    return target


def frictionless_reach(plant: Plant) -> tuple[Array, Array, Array]:
    """Return where the robot without friction and load goes all over the range of its drives.

    Levels (n, d), tips (n, 3) [m] and bends (n, *b) [rad or m].
    """
    lowest = plant.drives.lowest
    rng = np.random.default_rng(0)  # the same points every time
    level = rng.uniform(lowest, 1.0, (_CLOUD, len(lowest)))
    level[::2] *= rng.random(level[::2].shape) < PULLED_SHARE
    bent = plant.quick.reach(level[1:2], plant.rest_bends)[1][0]
    level *= np.any(plant.quick.tip_slopes(level[1], bent), axis=0)  # drives that move no tip stay at rest
    return level, *plant.quick.reach(level, plant.rest_bends)


def starts_near(plant: Plant, target_m: Array) -> list[Array]:
    """Return levels, far apart in posture, at which the frictionless robot is near `target_m`."""
    level, tip, bend = frictionless_reach(plant)
    bend = bend * (math.pi / plant.quick.bend_unit)
    chosen: list[int] = []
    for index in np.argsort(np.linalg.norm(tip - target_m, axis=1)):
        if all(np.linalg.norm(bend[index] - bend[other]) > _APART_RAD for other in chosen):
            chosen.append(int(index))
        if len(chosen) == _STARTS:
            break
    return [level[index] for index in chosen]


def _millimetres(point_m: Array) -> str:
    return "(" + ", ".join(f"{value * 1e3:.1f}" for value in point_m) + ")"


# ----------------------------------------------------------------------------------------------------
# What the tasks of one tip have in common: robots that actions move, what is seen of them, pictures.

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
_ONE = np.arange(1)  # the row of a robot alone


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

    A control step is 0.1 s of simulated time. The arguments are those of `ReachEnv`. An environment may
    be copied and pickled at any time: the copy goes on as the original would; its pictures are drawn by a
    renderer of its own.

    What is asked of a robot and seen of it stands in arrays with a row for each robot: one here, many where
    copies are stepped together (`vector.TogetherEnv`). A task is written for any number of rows:

    - `draw_goals(robots, chosen, rngs)`: what each of the chosen robots is to do in an episode, drawn at
      random; `given_goal(options)`: the same where options of the reset say it, else None;
    - `set_goals(chosen, goals)`: let rows have this to do, their robots at rest;
    - `judge_rows(stepped)`: rewards of rows after a step, and whether their episodes terminate, shapes (k,);
      `over()`: which have come to the end of their time, shape (n,);
    - `_goal()`: what observations show of the task, by the names of `goal`, each of shape (n, 3);
      `_more_bounds()`, `_more_parts()`: the task's own further parts, each of shape (n, ...);
    - `_task_info()`: the task's own part of `info`, SI, for all rows.

    Attributes:
        plant: the simulated robot.
        drives: what moves it.
        length_m: of the straight robot.
        randomised: settings of the robot that are drawn at every reset, and their bounds.
        target_m, targets_m: where the tip is wanted now, base frame, shape (3,), and of all rows, (n, 3) [m].
        level: of the drives, as commanded, shape (n, d).
        diverged: whether the simulation has, shape (n,).
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
    stepped_together: ClassVar[bool] = True  # whether copies can be, as far as the task goes
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
        self.pixels = checked_choice("observation", observation, OBSERVATIONS) == "pixels"
        super().__init__(**others)  # what is left are the base's own
        self._size = checked_size(width, height, _OBSERVED if self.pixels else _RENDERED)
        self.tolerance_m = checked_above_zero("tolerance_m", tolerance_m)
        self._robot, self._settings = robot, settings_table(settings)
        self._action_type = checked_choice("action_type", action_type, ACTION_TYPES, True)
        self._gravity = checked_numbers("gravity_mps2", gravity_mps2, (3,), "three finite numbers are needed")
        self._largest_bend_rad = largest_bend_rad
        if largest_bend_rad is not None:
            self._largest_bend_rad = checked_above_zero("largest_bend_rad", largest_bend_rad)
        self.randomised = check_randomised(randomised)
        ends = [{name: bounds[k] for name, bounds in self.randomised.items()} for k in range(2)]
        ends = ends if self.randomised else []
        for self._drawn in ({}, *ends):
            self._drawn_robot()
        self._drawn = {}
        self._prepare()
        for self._drawn in ends:  # the bounds themselves must be possible
            self._new_plant()
        self._drawn = {}
        self._picture: TargetPicture | None = None
        self._replace_plant()
        self.length_m = float(self.plant.segment_length.sum())
        self._begun = False
        actions = len(self.drives.names) + len(self.plant.carriage)
        self.action_space: gymnasium.spaces.Box = gymnasium.spaces.Box(-1.0, 1.0, (actions,), np.float32)
        self.observation_space: gymnasium.spaces.Box
        self.state_space, self.layout = observation_space(self.plant, self.goal, self._more_bounds())
        self.observation_space = self.state_space
        if self.pixels:
            self.observation_space = gymnasium.spaces.Box(0, 255, (*self._size[::-1], 3), np.uint8)
        standing = look(self.plant, self._alone, _ONE, self.plant.level[np.newaxis])
        self._now = TipState(*map(np.array, standing))  # each part for itself: they are written in place
        self.make_rows(1)
        self._states[0] = self._alone.state(0)

    def make_rows(self, count: int) -> None:
        """Make room for so many robots; none has been seen yet."""
        self.level = np.zeros((count, len(self.drives.names)))
        self.targets_m = np.zeros((count, 3))
        self.diverged = np.zeros(count, dtype=bool)
        self._states: list[DrawnState | None] = [None] * count
        if len(self._now.tip) != count:
            self._now = TipState(*(np.zeros((count, *part.shape[1:])) for part in self._now))

    @property
    def target_m(self) -> Array:
        """Where the tip is wanted now, base frame, shape (3,) [m]."""
        return self.targets_m[0].copy()

    @target_m.setter
    def target_m(self, place: Array) -> None:
        self.targets_m[0] = place

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode; see the class's text.

        Args:
            seed: of all that is drawn from now on; None: go on with the present generator.
            options: see the class's text.

        Raises:
            InputError: an unknown or impossible option, or a robot whose random inputs move its tip nowhere.
        """
        options = self._checked_options(options)
        super().reset(seed=seed)
        self._begun = False  # what fails from here on leaves no episode
        self._drawn = drawn_settings(self.randomised, self.np_random)
        self._renew(options)
        given = self.given_goal(options)
        goals = self.draw_goals(self._alone, _ONE, [self.np_random]) if given is None else [given]
        self.diverged[0] = False
        self.plant.reset()
        self.level[0] = 0.0
        self.see(self._alone, _ONE, _ONE, moved=False)
        self.set_goals(_ONE, goals)
        self._begun = True
        return self._observation(), self._info()

    def step(self, action: Action) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Move the drives for one control step; see the class's text.

        Raises:
            InputError: the action has another shape, or is not a number.
            ResetNeeded: no episode has begun.
        """
        shape = self.action_space.shape
        wished = checked_numbers("action", action, shape, f"{shape[0]} numbers are needed", True)
        if not self._begun:
            raise gymnasium.error.ResetNeeded("step() needs a reset before it")
        drives = len(self.drives.names)
        self.level[0] = level_after(self.plant.level, wished[:drives], self.drives)
        base = self._base_after(np.clip(wished[drives:], -1.0, 1.0) * CONTROL_STEP_S)
        try:
            self.plant.move(self.level[0], CONTROL_STEP_S, base)
        except SimulationDiverged:  # the robot is seen as it was before
            self.diverged[0] = True
        else:
            self.see(self._alone, _ONE, _ONE, moved=True)
        rewards, ended = self.judge_rows(_ONE)
        return self._observation(), float(rewards[0]), bool(ended[0]), bool(self.over()[0]), self._info()

    def render(self) -> Picture | None:  # type: ignore[override]
        """Return a picture of the robot and the target, shape (height, width, 3), or None.

        Raises:
            InputError: no OpenGL context can be had.
        """
        if self.render_mode is None:
            gymnasium.logger.warn("render() draws only where render_mode='rgb_array' was given to make()")
            return None
        return self.drawn(0)

    def drawn(self, row: int) -> Picture:
        """Return a picture of a row's robot and target, shape (height, width, 3).

        Raises:
            InputError: no OpenGL context can be had.
            ResetNeeded: the robot was never seen.
        """
        state = self._states[row]
        if state is None:
            raise gymnasium.error.ResetNeeded("render() needs a reset before it")
        if self._picture is None:
            self._picture = TargetPicture(self.plant.simulator.model, self._view(), *self._size)
        return self._picture.draw(state, self.targets_m[row], self.tolerance_m)

    def close(self) -> None:
        """Free the renderer; may be called again."""
        if self._picture is not None:
            self._picture.close()
            self._picture = None

    def __getstate__(self) -> dict[str, Any]:
        """Return what a copy is made of: all but the renderer, which is opened anew for the next picture."""
        return {**self.__dict__, "_picture": None}

    def see(self, robots: RobotGroup, own: Index, rows: Index, moved: bool) -> None:
        """Take down how robots stand, `own` among `robots`, after a step in which they moved or at rest."""
        if not len(own):
            return
        before = TipState(*(part[rows] for part in self._now)) if moved else None
        for part, new in zip(self._now, look(self.plant, robots, own, self.level[rows], before), strict=True):
            part[rows] = new
        if self.pixels or self.render_mode is not None:
            for row, one in zip(rows, own, strict=True):
                self._states[row] = robots.state(int(one))

    def observations(self) -> Observation | Picture:
        """Return what is observed of all rows; of a robot that was never seen a picture is black."""
        if self.pixels:
            black = np.zeros(self.observation_space.shape, dtype=np.uint8)
            return np.stack(
                [black if state is None else self.drawn(row) for row, state in enumerate(self._states)]
            )
        return observe(self.plant, self._now, self._goal(), self.state_space, self._more_parts())

    def infos(self) -> dict[str, np.ndarray]:
        """Return `info` of all rows, in the units of files."""
        now, drives = self._now, self.drives
        what = "tension_N" if drives.quantity is Quantity.TENSION else "displacement_m"
        return in_file_units(
            {
                "tip_m": now.tip.copy(),  # in the base frame, as the target
                "target_m": self.targets_m.copy(),
                "distance_m": self._distance(),
                "speed_m_per_s": np.linalg.norm(now.velocity, axis=1),
                f"commanded_{what}": np.matmul(drives.tendon, now.level[..., np.newaxis])[..., 0],
                "diverged": self.diverged.copy(),
                **self._task_info(),
            }
        )

    def _observation(self) -> Observation | Picture:
        return self.observations()[0]

    def _info(self) -> dict[str, Any]:
        info = one_of(self.infos(), 0)
        return {**info, "drawn": dict(self._drawn)} if self.randomised else info

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

    def _checked_options(self, options: Any) -> dict[str, Any]:
        """Return the options of a reset; one that is refused leaves the episode as it is."""
        return checked_options(options, self.reset_options)

    def _renew(self, options: Mapping[str, Any]) -> None:
        """Build the robot anew, at a reset with these options, where it was drawn anew."""
        if self.randomised:
            self._replace_plant()

    def _replace_plant(self) -> None:
        self.close()
        self.plant = self._new_plant()
        self.drives = self.plant.drives
        self._alone = RobotAlone(self.plant)

    def _base_after(self, change: Array) -> Array | None:
        """Return where the base goes, shape (c,), by the actions that are left for it; None: it stays."""
        return None

    def given_goal(self, options: Mapping[str, Any]) -> Any:
        return None

    @abstractmethod
    def draw_goals(self, robots: RobotGroup, chosen: Index, rngs: Generators) -> list[Any]: ...

    @abstractmethod
    def set_goals(self, chosen: Index, goals: list[Any]) -> None: ...

    @abstractmethod
    def judge_rows(self, stepped: Index) -> tuple[Array, np.ndarray]: ...

    def over(self) -> np.ndarray:
        return np.zeros(len(self.targets_m), dtype=bool)

    def _goal(self) -> Mapping[str, Array]:
        return {"target": self.targets_m / self.length_m}

    def _more_bounds(self) -> Bounds:
        return {}

    def _more_parts(self) -> Mapping[str, Array]:
        return {}

    @abstractmethod
    def _task_info(self) -> Mapping[str, Any]: ...

    def _distance(self) -> Array:
        """Return how far tips are from their targets, in truth, shape (n,) [m]."""
        distance: Array = np.linalg.norm(self._now.tip - self.targets_m, axis=1)
        return distance


def one_of(infos: Mapping[str, np.ndarray], row: int) -> dict[str, Any]:
    """Return a row of `TipEnv.infos`; numbers and truth values as Python's own."""
    return {name: part[row] if part.ndim > 1 else part[row].item() for name, part in infos.items()}


def level_after(level: Array, action: Array, drives: DriveLevels) -> Array:
    """Return the drives' levels that an action asks for at the end of a step, shapes (..., d)."""
    change = np.clip(action, -1.0, 1.0) * (RATE_PER_S * CONTROL_STEP_S)
    return np.clip(level + change, drives.lowest, 1.0)
