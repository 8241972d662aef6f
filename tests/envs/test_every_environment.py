"""What holds of every registered environment, one or many: no warning, an end, the same by its seed."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import gymnasium
import numpy as np
import pytest

import catheter_sim  # noqa: F401 - registers the environments
from catheter_sim.envs.stable_baselines import as_stable_baselines
from catheter_sim.resources import assets_folder

IDS = sorted(name for name in gymnasium.registry if name.startswith("catheter_sim/"))
ALWAYS = {"tip_mm", "target_mm", "distance_mm", "speed_mm_per_s", "is_success", "diverged"}
EXAMPLES = sorted(path for path in (assets_folder() / "examples").glob("*.toml"))


@contextmanager
def no_warning() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def same(one: Any, other: Any) -> bool:
    """Return whether two observations or infos are equal bit for bit."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[name], other[name]) for name in one)
    return np.array_equal(np.asarray(one), np.asarray(other))


def test_the_registry_is_found() -> None:
    """Every robot's Track has a version that sees the time."""
    tracks = [name.removesuffix("-v0") for name in IDS if name.endswith("Track-v0")]
    assert [name.removesuffix("-v1") for name in IDS if name.endswith("-v1")] == tracks
    assert len(tracks) == 7


@pytest.mark.slow
@pytest.mark.parametrize("name", IDS)
def test_one_goes_over_its_end_and_is_the_same_by_its_seed(name: str) -> None:
    """Truncated after two steps, which the clock alone brings about; names of `info` stay the same."""
    with no_warning():
        env = gymnasium.make(name, max_episode_steps=2, render_mode="rgb_array")
        first = env.reset(seed=3)
        action = np.zeros(env.action_space.shape, np.float32)
        ends = [env.step(action) for _ in range(2)]
        again = env.reset(seed=3)
        env.close()
    assert same(first[0], again[0])
    assert same(first[1], again[1])
    assert [(end[2], end[3]) for end in ends] == [(False, False), (False, True)]
    assert all(end[4].keys() == first[1].keys() >= ALWAYS for end in ends)
    assert ("time_left" in env.unwrapped.layout) == name.endswith("-v1")


@pytest.mark.slow
@pytest.mark.parametrize("name", IDS)
def test_copies_go_over_their_end_and_are_the_same_by_their_seed(name: str) -> None:
    """Two copies, stepped over an end; the last `info` of each has plain numbers and its own regions."""
    with no_warning():
        env = gymnasium.make_vec(
            name, 2, "vector_entry_point", threads=1, max_episode_steps=2, autoreset_mode="SameStep"
        )
        first = env.reset(seed=3)
        action = np.zeros(env.action_space.shape, np.float32)
        seen = [as_stable_baselines(*env.step(action)) for _ in range(3)]
        again = env.reset(seed=3)
        env.close()
    assert same(first[0], again[0])
    assert same(first[1], again[1])
    assert [ended.tolist() for _, _, ended, _ in seen] == [[False, False], [True, True], [False, False]]
    for info in seen[1][3]:
        assert info.keys() >= ALWAYS | {"terminal_observation", "TimeLimit.truncated"}
        assert info["tip_mm"].shape == (3,)
        assert info["TimeLimit.truncated"] is True
        for force in info.get("peak_force_N", {}).values():
            assert np.shape(force) == ()
    assert not same(seen[1][3][0]["target_mm"], seen[1][3][1]["target_mm"])


@pytest.mark.slow
def test_one_draws() -> None:
    """A picture of the size that is asked for, not of one colour, and without a warning."""
    with no_warning():
        env = gymnasium.make(
            "catheter_sim/NotchedWristReach-v0", render_mode="rgb_array", width=64, height=48
        )
        env.reset(seed=0, options={"target": (0.0, 0.0, 0.006)})
        picture = env.render()
        env.close()
    assert isinstance(picture, np.ndarray)
    assert picture.shape == (48, 64, 3)
    assert len(np.unique(picture)) > 10


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_environment_of_a_shipped_example_warns_of_nothing(path: Any) -> None:
    """Every robot file that comes with the package, driven in Reach."""
    with no_warning():
        env = gymnasium.make("catheter_sim/NeuroendoscopeReach-v0", robot=path)
        assert env.action_space.shape is not None
        assert env.action_space.shape[0] >= 1
