"""Seeded random episodes, to be compared."""

from __future__ import annotations

import numpy as np

from catheter_sim.envs.reach_and_track import ReachEnv
from catheter_sim.envs.robots import DrawnPoints, Plant, RobotAlone, random_targets


def episode(env: ReachEnv, seed: int, steps: int = 15, draw: bool = False) -> list[np.ndarray]:
    """Return everything that a seeded random episode gives."""
    observation, info = env.reset(seed=seed)
    rng = np.random.default_rng(seed)
    seen = [observation, *map(np.asarray, info.values())]
    for _ in range(steps):
        moved = rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)
        observation, reward, terminated, _, info = env.step(moved)
        seen += [observation, np.float64(reward), *map(np.asarray, info.values())]
        if draw:
            env.render()
        if terminated:
            break
    return seen


def same(one: list[np.ndarray], other: list[np.ndarray]) -> bool:
    return len(one) == len(other) and all(map(np.array_equal, one, other))


def random_target(plant: Plant, rng: np.random.Generator, clearance_m: float) -> DrawnPoints:
    """Return a random reachable point, at least `clearance_m` from the tip at rest, and its levels."""
    return random_targets(plant, RobotAlone(plant), np.arange(1), [rng], clearance_m)[0]
