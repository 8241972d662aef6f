"""A new episode knows nothing of the last one: alone, and among copies that start anew by themselves."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest

from catheter_sim.envs.reach_and_track import ReachEnv

SECTION = "catheter_sim/NeuroendoscopeSectionReach-v0"
STRAIGHT = (0.0, 0.0, 0.06)  # the section's tip at rest
STILL = np.zeros(2, dtype=np.float32)


def held(env: Any, observation: np.ndarray) -> np.ndarray:
    """Return the share of the steps for which the tip has been at its target."""
    return observation[..., env.layout["held"]][..., 0]


def test_a_reset_begins_to_count_anew() -> None:
    """Three steps at rest at the target, a reset, and it is the first step again, also after a success."""
    env = ReachEnv("neuroendoscope_section", tolerance_m=2e-3)
    for steps in (3, 5, 2):
        observation, info = env.reset(options={"target": STRAIGHT})
        assert held(env, observation) == 0.0
        assert not info["is_success"]
        for step in range(1, steps + 1):
            observation, _, terminated, _, _ = env.step(STILL)
            assert np.isclose(held(env, observation), step / 5)
            assert terminated == (step == 5)


@pytest.mark.slow
def test_copies_that_start_anew_begin_to_count_anew() -> None:
    """Two copies at rest at their targets end after five steps; the next step starts them anew, with other
    targets, nothing held and no step counted, so that they are not truncated before their time."""
    many = gymnasium.make_vec(SECTION, num_envs=2, max_episode_steps=7)
    many.reset(seed=3, options={"target": STRAIGHT})
    actions = np.zeros((2, 2), dtype=np.float32)
    for step in range(1, 6):
        observation, _, terminated, truncated, _ = many.step(actions)
        assert np.allclose(held(many, observation), step / 5)
        assert (terminated == (step == 5)).all()
        assert not truncated.any()
    for step in range(8):  # the first starts them anew
        observation, _, terminated, truncated, info = many.step(actions)
        assert not held(many, observation).any()
        assert not terminated.any()
        assert not info["is_success"].any()
        assert (truncated == (step == 7)).all()
    many.close()


@pytest.mark.slow
def test_copies_go_on_with_their_generators() -> None:
    """Four resets after one seed: each copy has another target each time, and so has each copy each time;
    the second copy's are those of a single environment with the next seed."""
    many = gymnasium.make_vec(SECTION, num_envs=2)
    one = ReachEnv("neuroendoscope_section", tolerance_m=2e-3)
    places = []
    for index in range(4):
        seeds = {"seed": 11} if index == 0 else {}
        observation, _ = many.reset(**seeds)
        alone, _ = one.reset(**({"seed": 12} if index == 0 else {}))
        targets = observation[:, many.layout["target"]]
        np.testing.assert_allclose(targets[1], alone[one.layout["target"]], atol=1e-6)
        places += [tuple(target.round(9)) for target in targets]
    assert len(set(places)) == 8
    many.close()
