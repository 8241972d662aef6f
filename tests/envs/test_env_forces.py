"""What a clinical task makes of forces on tissue: each step's own, the episode's largest, their cost and end.

The forces are planted where the simulation takes them down, so that each claim stands by itself.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest

from catheter_sim.anatomy.anatomies import Ventricles, median_of
from catheter_sim.envs.clinical.insert_and_tumour import LIMIT_N, REGIONS, TumourEnv
from catheter_sim.envs.tip import DIVERGED_REWARD

STILL = np.zeros(6, dtype=np.float32)


@pytest.fixture(scope="module")
def made() -> TumourEnv:
    env = gymnasium.make("catheter_sim/NeuroendoscopeTumour-v0").unwrapped
    assert isinstance(env, TumourEnv)
    return env


@pytest.fixture
def env(made: TumourEnv) -> TumourEnv:
    """A robot in its sheath, untouched, which stays where it is unless it is moved."""
    made.reset(seed=0, options={"anatomy": median_of(Ventricles)})
    return made


def pressed(env: TumourEnv, **shares: float) -> tuple[float, bool, dict[str, Any]]:
    """Return reward, end and info of a step at rest in which regions felt these shares of the limit."""
    tissue = env.plant.simulator.tissue
    assert tissue is not None
    if shares:  # otherwise what the simulation takes down stands: nothing, if what was before is forgotten
        tissue.peak_N = np.array([shares.get(name, 0.0) * LIMIT_N for name in tissue.regions])
    _, reward, terminated, _, info = env.step(STILL)
    return float(reward), terminated, info


def shares_of(forces_N: dict[str, float]) -> dict[str, float]:
    return {name: force / LIMIT_N for name, force in forces_N.items() if force}


@pytest.mark.slow
def test_a_force_costs_a_tenth_of_a_length_at_the_limit(env: TumourEnv) -> None:
    """Of the regions the one nearest to its limit counts; half of the limit costs half as much."""
    free, _, _ = pressed(env)
    for shares, cost in (({"third": 0.5, "foramen": 0.2}, 0.05), ({"lateral": 1.0}, 0.1), ({}, 0.0)):
        reward, terminated, _ = pressed(env, **shares)
        assert not terminated
        assert free - reward == pytest.approx(cost, abs=1e-5)


@pytest.mark.slow
def test_force_is_the_last_steps_and_peak_the_episodes(env: TumourEnv) -> None:
    """Pressed hard, then less, then not at all: the force goes, the peak stays; each region has its own."""
    told = [pressed(env, **shares)[2] for shares in ({"third": 0.6}, {"third": 0.2, "tumour": 0.4}, {})]
    assert [shares_of(info["force_N"]) for info in told] == [
        pytest.approx({"third": 0.6}),
        pytest.approx({"third": 0.2, "tumour": 0.4}),
        {},
    ]
    assert shares_of(told[0]["peak_force_N"]) == pytest.approx({"third": 0.6})
    for info in told[1:]:
        assert shares_of(info["peak_force_N"]) == pytest.approx({"third": 0.6, "tumour": 0.4})


@pytest.mark.slow
def test_one_region_beyond_its_limit_ends_the_episode(env: TumourEnv) -> None:
    """A little below it goes on, a little above it ends, at a divergence's cost; the sheath bears all."""
    for region in REGIONS:
        env.peak_N = np.zeros(len(env.peak_N))  # as at an episode's start
        assert pressed(env, **{region: 0.98, "sheath": 50.0})[1] is False
        reward, terminated, info = pressed(env, **{region: 1.02})
        assert terminated
        assert info["pressed_too_hard"]
        assert not info["is_success"]
        assert reward == DIVERGED_REWARD


@pytest.mark.slow
def test_a_new_episode_has_felt_nothing(env: TumourEnv) -> None:
    """After an episode that pressed too hard: no force, no peak, nothing too hard, and it goes on."""
    assert pressed(env, third=3.0, tumour=0.5)[1]
    _, info = env.reset(options={"anatomy": median_of(Ventricles)})
    assert shares_of(info["peak_force_N"]) == shares_of(info["force_N"]) == {}
    assert not info["pressed_too_hard"]
    _, terminated, info = pressed(env, tumour=0.25)
    assert not terminated
    assert shares_of(info["peak_force_N"]) == pytest.approx({"tumour": 0.25})
