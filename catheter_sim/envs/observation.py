"""What a task shows of a robot: its state at the end of a control step, as one flat array."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import gymnasium
import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.envs.plant import Plant
from catheter_sim.pictures.state import State, state_of

Observation = NDArray[np.float32]

# Bounds of the observation; what lies beyond is cut off.
_PLACE_BOUND = 2.0  # robot lengths
_SPEED_BOUND = 10.0  # robot lengths a second
_TENSION_BOUND = 10.0  # ranges of the tension drives
_BEND_BOUND = 4.0  # half turns, or strokes of an advance
# What a task may ask for: where to be [robot lengths], which way to look, how fast to go [lengths a second].
GOAL_BOUNDS = {"target": _PLACE_BOUND, "target_direction": 1.0, "target_velocity": _SPEED_BOUND}


@dataclass(frozen=True)
class Seen:
    """A robot at the end of a control step, or many robots (an axis more at the front), SI units.

    Attributes:
        tip, seen_tip: of the tip, true and as measured, shape (..., 3) [m].
        direction, seen_direction: unit vector along the tip's axis, true and as measured, shape (..., 3).
        velocity, seen_velocity: mean over the step of the two tips, shape (..., 3) [m/s].
        level: of the drives, shape (..., d).
        tension: at the actuators, shape (..., t) [N].
        bends: of the robot, as its quick model has them, shape (..., *b) [rad or m].
    """

    tip: Array
    seen_tip: Array
    direction: Array
    seen_direction: Array
    velocity: Array
    seen_velocity: Array
    level: Array
    tension: Array
    bends: Array


@dataclass(frozen=True)
class Look(Seen):
    """One robot at the end of a control step.

    Attributes:
        state: what a picture of the robot needs.
    """

    state: State


def look(plant: Plant, before: Look | None = None, step_s: float = 1.0) -> Look:
    """Return how `plant` stands now, `step_s` after `before`; at rest without one."""
    posture = plant.posture()
    tip = posture.p_w[-1]
    seen_tip, seen_axes = plant.seen(tip, posture.R_w[-1])
    return Look(
        tip=tip,
        seen_tip=seen_tip,
        direction=posture.R_w[-1][:, 2],
        seen_direction=seen_axes[:, 2],
        velocity=(tip - before.tip) / step_s if before else np.zeros(3),
        seen_velocity=(seen_tip - before.seen_tip) / step_s if before else np.zeros(3),
        level=plant.level.copy(),
        tension=posture.actuator_tension,
        bends=plant.segment_bends(),
        state=state_of(plant.simulator),
    )


def observe(
    plant: Plant,
    seen: Seen,
    goal: Mapping[str, Array],
    space: gymnasium.spaces.Box,
    more: Mapping[str, Array] | None = None,
) -> Observation:
    """Return the observation of `seen`, in the units and bounds of `space`.

    Args:
        plant: the robot.
        seen: how it stands, or how many such robots stand.
        goal: what the task asks for, by the names of `GOAL_BOUNDS`, each of shape (..., 3), in their units.
        space: of the observations.
        more: the task's own further parts, as `observation_space` was told of them.
    """
    length = float(plant.segment_length.sum())
    parts: Mapping[str, Array] = {
        **goal,
        "tip": seen.seen_tip / length,
        "tip_direction": seen.seen_direction,
        "tip_velocity": seen.seen_velocity / length,
        "level": seen.level,
        "tension": seen.tension / plant.drives.tension,
        "bend": (seen.bends / plant.quick.bend_unit).reshape(*seen.tip.shape[:-1], -1),
    }
    values = np.concatenate(
        [*(parts[name] for name in _bounds(plant, tuple(goal))), *(more or {}).values()], axis=-1
    )
    return np.clip(values.astype(np.float32), space.low, space.high)


Bounds = Mapping[str, tuple[Array, float]]  # name -> lower bounds, shape (n,), and the upper bound


def observation_space(
    plant: Plant, goal: Sequence[str], more: Bounds | None = None
) -> tuple[gymnasium.spaces.Box, dict[str, slice]]:
    """Return the space of the observations, and where in them each part lies.

    Args:
        plant: the robot.
        goal: names of what the task asks for, of `GOAL_BOUNDS`.
        more: the task's own further parts, last.
    """
    lows, highs, start = [], [], 0
    layout: dict[str, slice] = {}
    for name, (low, high) in {**_bounds(plant, goal), **(more or {})}.items():
        lows.append(low)
        highs.append(np.full(len(low), high))
        layout[name] = slice(start, start + len(low))
        start += len(low)
    lowest, highest = (np.concatenate(ends).astype(np.float32) for ends in (lows, highs))
    return gymnasium.spaces.Box(lowest, highest, dtype=np.float32), layout


def _bounds(plant: Plant, goal: Sequence[str]) -> dict[str, tuple[Array, float]]:
    """Return the parts of an observation in their order, with lower bounds and the upper bound."""
    asked = {name: (np.full(3, -GOAL_BOUNDS[name]), GOAL_BOUNDS[name]) for name in goal}
    return asked | {
        "tip": (np.full(3, -_PLACE_BOUND), _PLACE_BOUND),
        "tip_direction": (np.full(3, -1.0), 1.0),
        "tip_velocity": (np.full(3, -_SPEED_BOUND), _SPEED_BOUND),
        "level": (plant.drives.lowest, 1.0),
        "tension": (np.zeros(len(plant.drives.tension)), _TENSION_BOUND),
        "bend": (np.full(plant.quick.bend_unit.size, -_BEND_BOUND), _BEND_BOUND),
    }
