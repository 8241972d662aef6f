"""Simple controllers that reach targets and follow them: what a learned one is to be measured against."""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.envs.observation import Observation
from catheter_sim.envs.plant import Plant
from catheter_sim.envs.reach import ReachEnv
from catheter_sim.envs.steering import change_toward
from catheter_sim.envs.targets import frictionless_level
from catheter_sim.envs.tip import CONTROL_STEP_S, RATE_PER_S, Action, TipEnv
from catheter_sim.envs.track import TrackEnv

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
