"""The vector environments in the form of Stable-Baselines3, with it and without."""

from __future__ import annotations

import importlib.util
import sys
from types import ModuleType, SimpleNamespace
from typing import Any

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
    with pytest.raises(InputError, match=r"pip install stable-baselines3"):
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


class _VecEnv:
    """What Stable-Baselines3's abstract class does that the adapter stands on."""

    def __init__(self, num_envs: int, observation_space: Any, action_space: Any) -> None:
        self.num_envs, self.observation_space, self.action_space = num_envs, observation_space, action_space
        self._reset_seeds()
        self.render_mode = self.get_attr("render_mode")[0]  # type: ignore[attr-defined]

    def _reset_seeds(self) -> None:
        self._seeds = [None] * self.num_envs

    def _get_indices(self, indices: Any) -> Any:
        return range(self.num_envs) if indices is None else [indices] if isinstance(indices, int) else indices

    def step(self, actions: np.ndarray) -> Any:
        self.step_async(actions)  # type: ignore[attr-defined]
        return self.step_wait()  # type: ignore[attr-defined]


@pytest.fixture
def stand_in(monkeypatch: pytest.MonkeyPatch) -> None:
    """Put a class in the place of Stable-Baselines3's."""
    module: Any = ModuleType("stable_baselines3.common.vec_env")
    module.VecEnv = _VecEnv
    for name in ("stable_baselines3", "stable_baselines3.common"):
        monkeypatch.setitem(sys.modules, name, SimpleNamespace())  # type: ignore[arg-type]
    monkeypatch.setitem(sys.modules, module.__name__, module)


def adapted(task: str, count: int = 2, **arguments: Any) -> Any:
    """Return copies of a task in Stable-Baselines3's form."""
    name = f"catheter_sim/{task}-v0"
    given = {"threads": 1, "autoreset_mode": "SameStep", **arguments}
    return vec_env(gymnasium.make_vec(name, count, "vector_entry_point", **given))


@pytest.mark.slow
@pytest.mark.usefixtures("stand_in")
@pytest.mark.parametrize("task", ["NotchedWristReach", "ChestTubeInsert"])
def test_every_task_steps_over_its_end(task: str) -> None:
    """Stepped together or one by one; what is told of each region of tissue is a number."""
    env = adapted(task, max_episode_steps=2)
    env.reset()
    assert env.reset_infos[1].keys() >= {"tip_mm", "distance_mm"}
    for step in range(1, 4):
        _, _, ended, infos = env.step(np.zeros((2, *env.action_space.shape), np.float32))
        assert ended.tolist() == [step == 2] * 2
        if step == 2:
            forces = [info.get("force_N", {"none": 0.0}) for info in infos]
            assert all(isinstance(float(value), float) for force in forces for value in force.values())
            assert all("_" not in name[:1] for force in forces for name in force)
    env.close()


@pytest.mark.slow
@pytest.mark.usefixtures("stand_in")
@pytest.mark.parametrize(
    "drawn", [{}, {"randomised": {"friction.mu": (0.1, 0.5)}}], ids=["together", "one by one"]
)
def test_pictures_attributes_and_methods_are_passed_on(drawn: dict[str, Any]) -> None:
    """A picture of each copy; an attribute that is set is had, and counts; an unknown one is none."""
    env = adapted("NeuroendoscopeSectionReach", render_mode="rgb_array", width=32, height=24, **drawn)
    assert env.render_mode == "rgb_array"
    env.reset()
    for pictures in (env.get_images(), env.env_method("render")):
        assert [picture.shape for picture in pictures] == [(24, 32, 3)] * 2
    env.set_attr("tolerance_m", 1.0)  # farther than the tip can be: at the target wherever it stands
    assert env.get_attr("tolerance_m") == [1.0, 1.0]
    assert env.get_attr("tolerance_m", [1]) == [1.0]
    assert np.shape(env.get_attr("target_m")) == (2, 3)
    assert not np.array_equal(*env.get_attr("target_m"))
    for _ in range(5):
        _, _, ended, infos = env.step(np.zeros((2, 2), np.float32))
    assert ended.all()
    assert all(info["is_success"] for info in infos)
    with pytest.raises(AttributeError):
        env.get_attr("smell")
    env.close()


@pytest.mark.slow
@pytest.mark.usefixtures("stand_in")
def test_copies_that_are_stepped_together_say_what_they_share() -> None:
    """One value for all; some of them cannot be chosen; one by one they can."""
    together = adapted("NeuroendoscopeSectionReach")
    with pytest.raises(InputError, match=r"indices = \[0\]: choices: None, for all"):
        together.set_attr("tolerance_m", 1e-3, [0])
    with pytest.raises(InputError, match="indices = 0: choices: None"):
        together.env_method("render", indices=0)
    with pytest.raises(InputError, match="tolerance_m = -1: must be above zero"):
        together.set_attr("tolerance_m", -1.0)
    with pytest.raises(
        InputError, match=r"unknown attribute of copies .*'length_m'; choices: tolerance_m, hold"
    ):
        together.set_attr("length_m", 1.0)
    with pytest.raises(
        AttributeError, match="step_: not of copies that are stepped together; choices: render"
    ):
        together.env_method("step_")
    together.close()
    single = adapted("NeuroendoscopeSectionReach", randomised={"friction.mu": (0.1, 0.5)})
    single.set_attr("tolerance_m", 1e-4, [1])
    assert single.get_attr("tolerance_m") == [2e-3, 1e-4]
    single.close()
