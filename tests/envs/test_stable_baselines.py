"""The vector environments in the form of Stable-Baselines3, with it and without."""

from __future__ import annotations

import importlib.util

import gymnasium
import numpy as np
import pytest

import catheter_sim  # noqa: F401 - registers the environments
from catheter_sim.envs.stable_baselines import as_stable_baselines, vec_env
from catheter_sim.errors import InputError

SECTION = "catheter_sim/NeuroendoscopeSectionReach-v0"
INSTALLED = importlib.util.find_spec("stable_baselines3") is not None


def test_an_episodes_end_comes_with_its_last_observation_and_info() -> None:
    """Where an episode was cut short: what it ended with; the observation is already the next one's."""
    env = gymnasium.make_vec(
        SECTION, 2, "vector_entry_point", threads=1, max_episode_steps=2, autoreset_mode="SameStep"
    )
    env.reset(seed=0)
    action = np.ones(env.action_space.shape, np.float32)
    _, reward, ended, infos = as_stable_baselines(*env.step(action))
    assert reward.dtype == np.float32
    assert not ended.any()
    assert infos == [{}, {}]
    observation, _, ended, infos = as_stable_baselines(*env.step(action))
    assert ended.all()
    level = env.unwrapped.layout["level"]  # type: ignore[attr-defined]
    for one, info in enumerate(infos):
        assert info["TimeLimit.truncated"]
        assert not info["is_success"]
        assert info["distance_mm"] > 0.0
        assert info["terminal_observation"][level] == pytest.approx([0.1, 0.1])
        assert not observation[one, level].any()
    env.close()


def test_another_way_to_start_anew_is_refused() -> None:
    """Stable-Baselines3 wants the next episode in the step that ends one."""
    env = gymnasium.make_vec(SECTION, 1, "vector_entry_point", threads=1)
    with pytest.raises(InputError, match="needs environments with autoreset_mode='SameStep'"):
        vec_env(env)
    env.close()


@pytest.mark.skipif(INSTALLED, reason="Stable-Baselines3 is installed")
def test_without_stable_baselines_the_extra_is_named() -> None:
    """One line says what to install."""
    env = gymnasium.make_vec(SECTION, 1, "vector_entry_point", threads=1, autoreset_mode="SameStep")
    with pytest.raises(InputError, match=r"pip install 'catheter-sim\[train\]'"):
        vec_env(env)
    env.close()


@pytest.mark.skipif(not INSTALLED, reason="Stable-Baselines3 is not installed")
@pytest.mark.slow
def test_stable_baselines_learns_on_it() -> None:
    """PPO takes some rollouts; seeds are those of Gymnasium."""
    from stable_baselines3 import PPO

    env = gymnasium.make_vec(
        SECTION, 2, "vector_entry_point", threads=1, max_episode_steps=5, autoreset_mode="SameStep"
    )
    expected, _ = env.reset(seed=4)
    adapted = vec_env(env)
    adapted.seed(4)
    assert np.array_equal(adapted.reset(), expected)
    model = PPO("MlpPolicy", adapted, n_steps=8, batch_size=8, n_epochs=1, device="cpu")
    assert model.learn(32).num_timesteps == 32
    adapted.close()
