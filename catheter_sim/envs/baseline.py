"""A simple controller that reaches targets: what a learned one is to be measured against."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from catheter_sim.envs.plant import Plant
from catheter_sim.envs.reach import CONTROL_STEP_S, RATE_PER_S, Action, Observation, ReachEnv
from catheter_sim.envs.steering import change_toward
from catheter_sim.envs.targets import frictionless_level
from catheter_sim.robots.posture import Array

GAIN = 0.3  # share of the way to the target in one step; the robot follows within a step or two
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
    part = {name: observation[place].astype(float) for name, place in env.layout.items()}
    way = (part["target"] - part["tip"]) * env.length_m
    unit = env.plant.quick.bend_unit
    bend = part["bend"].reshape(unit.shape) * unit
    largest = RATE_PER_S * CONTROL_STEP_S
    if env.plant.quick.sets_bends:
        ahead = _planned_bends(env.plant, tuple(part["target"] * env.length_m)) - bend
        if np.abs(ahead / unit).max() > _OTHER_BRANCH:
            change = np.linalg.solve(env.drives.bend, GAIN * ahead)
            return np.clip(change / largest, -1.0, 1.0).astype(np.float32)
    change = change_toward(
        GAIN * way,
        env.plant.quick.tip_slopes(part["level"], bend),
        env.length_m,
        np.clip(env.drives.lowest - part["level"], -largest, 0.0),
        np.clip(1.0 - part["level"], 0.0, largest),
    )
    return (change / largest).astype(np.float32)


@lru_cache(maxsize=1)
def _planned_bends(plant: Plant, target_m: tuple[float, ...]) -> Array:
    """Return the bends with which the frictionless robot is at the target, shape (*b) [rad, m]."""
    level = frictionless_level(plant, np.array(target_m))
    return plant.quick.reach(level[np.newaxis], plant.rest_bends)[1][0]
