"""Claims about ChestTubeInsert: what it asks for, what it forbids, and that it can be done."""

from __future__ import annotations

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from catheter_sim.envs.clinical.insert_and_tumour import ORGAN_LIMIT_N, WALL_LIMIT_N, InsertEnv
from catheter_sim.errors import InputError
from reference.steering import insert_rates
from tests.envs.episodes import episode, same

ID = "catheter_sim/ChestTubeInsert-v0"
LIMITS_N = {"wall": WALL_LIMIT_N, "lung": ORGAN_LIMIT_N, "diaphragm": ORGAN_LIMIT_N}


@pytest.fixture(scope="module")
def env() -> InsertEnv:
    made = gymnasium.make(ID).unwrapped
    assert isinstance(made, InsertEnv)
    return made


@pytest.mark.slow
def test_starts_at_the_skin_untouched(env: InsertEnv) -> None:
    """The tip stands a wall's thickness before the pleura; nothing is felt; the target is the point."""
    observation, info = env.reset(seed=0)
    assert info["tip_mm"] == pytest.approx([0.0, 0.0, -1e3 * env.anatomy.wall_m], abs=1e-3)
    assert max(info["peak_force_N"].values()) == 0.0
    assert observation[env.layout["wall"]] == pytest.approx(env.anatomy.wall_m / 0.375, rel=1e-5)
    assert info["distance_mm"] == pytest.approx(np.linalg.norm(1e3 * env.target_m - info["tip_mm"]))


@pytest.mark.slow
def test_straight_robot_goes_through_the_wall_and_touches_nothing(env: InsertEnv) -> None:
    """The channel is wide enough: pushed straight through the whole wall, no region feels anything."""
    env.reset(seed=1)
    action = np.zeros(10, dtype=np.float32)
    action[8] = 1.0
    for _ in range(int(env.anatomy.wall_m / 3e-3) + 5):
        _, _, terminated, _, info = env.step(action)
    assert not terminated
    assert info["tip_mm"][2] > 0.0
    assert max(info["peak_force_N"].values()) == 0.0


@pytest.mark.slow
def test_pushing_straight_on_presses_on_the_lung(env: InsertEnv) -> None:
    """Without a turn the robot runs into the lung: its limit is passed, the episode ends without success."""
    env.reset(seed=0)
    action = np.zeros(10, dtype=np.float32)
    action[8] = 1.0
    for _ in range(90):
        _, reward, terminated, _, info = env.step(action)
        if terminated:
            break
    assert terminated
    assert info["pressed_too_hard"]
    assert info["peak_force_N"]["lung"] > ORGAN_LIMIT_N
    assert not info["is_success"]
    assert reward == -200.0


@pytest.mark.slow
def test_controller_reaches_the_point_within_all_limits(env: InsertEnv) -> None:
    """Resolved rates turn the robot in the pleural space; no organ and not the wall bears too much."""
    _, info = env.reset(seed=3)
    for _ in range(200):
        _, _, terminated, _, info = env.step(insert_rates(env))
        if terminated:
            break
    assert info["is_success"]
    assert 1e-3 * info["distance_mm"] <= env.tolerance_m == 10e-3
    assert all(info["peak_force_N"][name] <= limit for name, limit in LIMITS_N.items())


@pytest.mark.slow
def test_environment_checker_passes_and_seeds_decide() -> None:
    """Gymnasium's own checks without a warning; the same seed, the same trajectory."""
    made = gymnasium.make(ID)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(made.unwrapped, skip_render_check=True)
    first, again, other = (_flat(made.unwrapped, seed) for seed in (4, 4, 5))
    assert same(first, again)
    assert not same(first, other)


def test_rods_know_tension_only() -> None:
    """Displacement actions are refused, in one line with the choices."""
    with pytest.raises(InputError, match=r"displacement.*tension"):
        InsertEnv("chest_tube", action_type="displacement")


def _flat(made: gymnasium.Env, seed: int) -> list[np.ndarray]:
    """Return an episode as bare numbers, the forces' names left out."""
    return [np.asarray(item) for item in episode(made, seed, 6) if np.asarray(item).dtype != object]  # type: ignore[arg-type]
