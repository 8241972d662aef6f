"""Copies of environments, deep and pickled: they go on as the original does."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest

from catheter_sim.envs.reach_and_track import ReachEnv

IDS = sorted(name for name in gymnasium.registry if name.startswith("catheter_sim/"))
COPIES = {"deep": copy.deepcopy, "pickled": lambda env: pickle.loads(pickle.dumps(env))}


def steps(env: gymnasium.Env[Any, Any], count: int, seed: int) -> list[Any]:
    """Return what random steps give."""
    rng = np.random.default_rng(seed)
    seen: list[Any] = []
    for _ in range(count):
        action = rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)  # type: ignore[arg-type]
        observation, reward, terminated, truncated, info = env.step(action)
        seen += [*observation.ravel(), reward, terminated, truncated, *map(str, info.values())]
    return seen


@pytest.mark.slow
@pytest.mark.parametrize("name", IDS)
def test_a_copy_made_after_a_picture_goes_on_as_the_original(name: str) -> None:
    """Steps give the same numbers to the bit, be it a deep copy or a pickled one."""
    env = gymnasium.make(name, render_mode="rgb_array", width=48, height=32)
    env.reset(seed=2)
    steps(env, 1, 0)
    env.render()
    copies = [way(env) for way in COPIES.values()]
    expected = steps(env, 2, 1)
    assert all(steps(item, 2, 1) == expected for item in copies)
    env.close()


@pytest.mark.slow
def test_a_copy_may_be_made_at_any_time() -> None:
    """Before a reset, after it, and after steps and a picture; new episodes and pictures are the same too."""
    env = gymnasium.make(
        "catheter_sim/NeuroendoscopeSectionReach-v0", render_mode="rgb_array", width=48, height=32
    )
    copies = [way(env) for way in COPIES.values()]
    for item in (env, *copies):
        item.reset(seed=2)
    copies += [way(env) for way in COPIES.values()]
    expected = steps(env, 3, 0), env.reset()[0].tolist()
    assert all((steps(item, 3, 0), item.reset()[0].tolist()) == expected for item in copies)
    env.step(np.zeros(env.action_space.shape, np.float32))  # type: ignore[arg-type]
    picture = env.render()
    copies = [way(env) for way in COPIES.values()]
    expected = steps(env, 4, 1)
    assert all(steps(item, 4, 1) == expected for item in copies)
    env.close()
    for item in copies:
        item.reset(seed=2)
        steps(item, 3, 0)
        item.reset()
        item.step(np.zeros(env.action_space.shape, np.float32))
        assert np.array_equal(item.render(), picture)
        item.close()


def test_an_open_renderer_is_not_copied() -> None:
    """A copy opens its own for its next picture; the original keeps the one that it has."""
    env = ReachEnv("neuroendoscope_section")
    env.reset(seed=0)
    env._picture = open_one = (line for line in "no such thing can be pickled")  # type: ignore[assignment]
    copies = [way(env) for way in COPIES.values()]
    assert [item._picture for item in copies] == [None, None]
    assert steps(copies[0], 1, 0) == steps(copies[1], 1, 0)
    assert env._picture is open_one
    env._picture = None
