"""Claims about NeuroendoscopeTumour: what it asks for, what it forbids, and that it can be done."""

from __future__ import annotations

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from catheter_sim.anatomy.anatomies import Ventricles, median_of, tumour
from catheter_sim.envs.clinical.insert_and_tumour import (
    LIMIT_N,
    POINTS,
    REGIONS,
    TumourEnv,
)
from catheter_sim.envs.clinical.insert_and_tumour import (
    TUMOUR_STROKE_M as STROKE_M,
)
from catheter_sim.envs.tip import DIVERGED_REWARD
from catheter_sim.errors import InputError
from reference.steering import tumour_rates
from tests.envs.episodes import episode, same

ID = "catheter_sim/NeuroendoscopeTumour-v0"
STRAIGHT_ON = np.array([0, 0, 0, 0, 1, 0], dtype=np.float32)


@pytest.fixture(scope="module")
def env() -> TumourEnv:
    made = gymnasium.make(ID).unwrapped
    assert isinstance(made, TumourEnv)
    return made


@pytest.mark.slow
def test_starts_in_the_sheath_untouched(env: TumourEnv) -> None:
    """The tip stands at the sheath's end, no tissue feels anything, all points are left, none is reached."""
    observation, info = env.reset(seed=0)
    assert info["tip_mm"] == pytest.approx(np.zeros(3), abs=1e-3)
    assert set(info["peak_force_N"]) == {*REGIONS, "sheath"}
    assert max(info["peak_force_N"].values()) == 0.0
    assert not info["is_success"]
    assert not info["pressed_too_hard"]
    assert observation[env.layout["points_left"]] == pytest.approx(1.0)
    assert observation[env.layout["target"]] == pytest.approx(env.points_m[0] / env.length_m, abs=1e-6)
    assert observation[env.layout["foramen_axis"]] @ observation[env.layout["foramen_axis"]] == (
        pytest.approx(1.0, abs=1e-5)
    )


def test_limit_is_the_pressure_under_a_retractor_on_the_tips_face() -> None:
    """20 mmHg on a disc of 3.4 mm: 24.2 mN."""
    assert pytest.approx(20 * 133.322 * np.pi * 1.7e-3**2) == LIMIT_N
    assert pytest.approx(24.2e-3, rel=2e-3) == LIMIT_N


@pytest.mark.slow
def test_pushing_straight_on_presses_too_hard(env: TumourEnv) -> None:
    """Without steering the robot ends at the third ventricle's wall: the limit is passed, the episode ends
    without success and costs more than it could have saved; the observation shows the force.
    """
    env.reset(seed=3)
    for _ in range(round(STROKE_M / 2e-3)):
        observation, reward, terminated, truncated, info = env.step(STRAIGHT_ON)
        if terminated:
            break
    assert terminated
    assert not truncated
    assert info["pressed_too_hard"]
    assert not info["is_success"]
    assert reward == DIVERGED_REWARD
    assert max(info["peak_force_N"][name] for name in REGIONS) > LIMIT_N
    assert observation[env.layout["force"]].max() > 1.0
    assert info["insertion_mm"] < 1e3 * STROKE_M


def test_base_moves_as_it_is_asked_and_no_farther(env: TumourEnv) -> None:
    """Full insertion is 2 mm a step, full roll 3 deg, and the sheath's end is where it cannot draw back."""
    env.reset(seed=0)
    _, _, _, _, info = env.step(np.array([0, 0, 0, 0, 1, -1], dtype=np.float32))
    assert (info["insertion_mm"], info["roll_deg"]) == pytest.approx((2.0, -3.0))
    assert info["tip_mm"][2] == pytest.approx(2.0, abs=0.02)
    for _ in range(2):
        _, _, _, _, info = env.step(np.array([0, 0, 0, 0, -1, 1], dtype=np.float32))
    assert (info["insertion_mm"], info["roll_deg"]) == pytest.approx((0.0, 3.0))


def test_reward_is_the_way_left_and_the_force(env: TumourEnv) -> None:
    """Distance to the next point and on through the others, in robot lengths; no force, no more cost."""
    env.reset(seed=5)
    _, reward, _, _, info = env.step(STRAIGHT_ON)
    legs = np.linalg.norm(np.diff(env.points_m, axis=0), axis=1).sum()
    assert max(info["force_N"][name] for name in REGIONS) == 0.0
    assert reward == pytest.approx(-(1e-3 * info["distance_mm"] + legs) / env.length_m)


@pytest.mark.slow
def test_controller_reaches_all_points_within_the_limit(env: TumourEnv) -> None:
    """Resolved rates bring the tip to all three points; no region bears more than its limit on the way."""
    _, info = env.reset(seed=1)
    reached = []
    for _ in range(200):
        _, _, terminated, _, info = env.step(tumour_rates(env))
        reached.append(info["points_reached"])
        if terminated:
            break
    assert info["is_success"]
    assert sorted(set(reached)) == list(range(POINTS + 1))  # one after the other
    assert info["distance_mm"] <= 1e3 * env.tolerance_m
    assert max(info["peak_force_N"][name] for name in REGIONS) <= LIMIT_N
    assert np.linalg.norm(info["tip_mm"] - 1e3 * tumour(env.anatomy)) > 10.0  # outside the tumour


@pytest.mark.slow
def test_environment_checker_passes_without_a_warning() -> None:
    """Gymnasium's own checks, spaces and seeding among them."""
    made = gymnasium.make(ID)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(made.unwrapped, skip_render_check=True)


@pytest.mark.slow
def test_same_seed_same_trajectory() -> None:
    """Also in an environment made anew, and after another episode; another seed goes another way."""
    one, other = (gymnasium.make(ID).unwrapped for _ in range(2))
    first = _flat(one, 7)
    assert same(first, _flat(other, 7))
    assert same(first, _flat(one, 7))
    assert not same(first, _flat(one, 8))


def test_given_anatomy_is_used_and_others_are_refused(env: TumourEnv) -> None:
    """A value of the task's kind; one line of error for anything else, with the choices."""
    env.reset(seed=0, options={"anatomy": median_of(Ventricles)})
    assert env.anatomy == median_of(Ventricles)
    with pytest.raises(InputError, match="anatomy = 3: a Ventricles is needed"):
        env.reset(options={"anatomy": 3})
    with pytest.raises(InputError, match="unknown option of reset 'target'"):
        env.reset(options={"target": (0, 0, 0)})


@pytest.mark.slow
def test_settings_are_drawn_within_their_bounds() -> None:
    """Friction and an effect are drawn anew at every reset, by the seed; impossible bounds are refused."""
    bounds = {"friction.mu": (0.1, 0.5), "effects.actuation_gain.scale": (0.9, 1.1)}
    made = TumourEnv("neuroendoscope", randomised=bounds)
    drawn = []
    for seed in (0, 1, 0):
        made.reset(seed=seed)
        robot = made.plant.specified
        drawn.append((robot.friction.mu, robot.effects["actuation_gain"]["scale"]))
    assert drawn[0] == drawn[2] != drawn[1]
    assert all(0.1 <= mu <= 0.5 and 0.9 <= scale <= 1.1 for mu, scale in drawn)
    with pytest.raises(InputError, match=r"randomised friction\.mu"):
        TumourEnv("neuroendoscope", randomised={"friction.mu": (0.5, 0.1)})
    with pytest.raises(InputError, match="mu"):
        TumourEnv("neuroendoscope", randomised={"friction.mu": (-0.1, 0.1)})


@pytest.mark.slow
def test_displacement_drives_bend_and_base_in_the_same_order() -> None:
    """Two bends, then insertion and roll."""
    made = TumourEnv("neuroendoscope", action_type="displacement")
    assert made.drives.names == ("bend_proximal_x", "bend_distal_x")
    assert made.action_space.shape == (4,)


def _flat(made: gymnasium.Env, seed: int) -> list[np.ndarray]:
    """Return an episode as bare numbers, the forces' names left out."""
    return [np.asarray(item) for item in episode(made, seed, 8) if np.asarray(item).dtype != object]  # type: ignore[arg-type]
