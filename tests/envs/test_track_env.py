"""The following task: Gymnasium's contract, and the claims of its datasheet."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from episodes import episode, same
from gymnasium.utils.env_checker import check_env

from catheter_sim.envs import EPISODE_STEPS
from catheter_sim.envs.reach_and_track import DIRECTION_TOLERANCE_RAD, DIRECTION_WEIGHT, TrackEnv
from catheter_sim.envs.tip import CONTROL_STEP_S, DIVERGED_REWARD, RATE_PER_S, TARGET_CLEARANCE
from catheter_sim.errors import InputError, SimulationDiverged
from catheter_sim.robots.catheter.kinematics import tool_frame
from reference.steering import following

SECTION = "catheter_sim/NeuroendoscopeSectionTrack-v0"
OTHERS = tuple(
    f"catheter_sim/{robot}Track-v0"
    for robot in ("Neuroendoscope", "ChestTube", "ChestTubeSection", "MitralTransseptal", "Mitral4dof")
)
EVERY = (SECTION, *(pytest.param(name, marks=pytest.mark.slow) for name in OTHERS))
# Those that run apart: a smaller robot of the kind stays, or the same robot's other task.
LONG_CHECKED = ("Neuroendoscope", "ChestTube", "ChestTubeSection")
LONG_FOLLOWED = ("Neuroendoscope", "ChestTube", "Mitral4dof")
STEP = RATE_PER_S * CONTROL_STEP_S  # largest change of a level


def all_but_long(robots: tuple[str, ...]) -> list[Any]:
    """Return every task, those of the robots given marked to run apart."""
    long = {f"catheter_sim/{robot}Track-v0" for robot in robots}
    return [
        pytest.param(name, marks=[pytest.mark.long] if name in long else []) for name in (SECTION, *OTHERS)
    ]


def track(name: str = SECTION, **arguments: Any) -> TrackEnv:
    env = gymnasium.make(name, **arguments).unwrapped
    assert isinstance(env, TrackEnv)
    return env


def run(env: TrackEnv, policy: Callable[[np.ndarray], np.ndarray], seed: int) -> list[tuple[float, dict]]:
    """Return rewards and infos of a whole episode."""
    observation, _ = env.reset(seed=seed)
    seen = []
    for step in range(1, EPISODE_STEPS + 1):
        observation, reward, terminated, truncated, info = env.step(policy(observation))
        assert not terminated
        assert truncated == (step == EPISODE_STEPS)
        seen.append((reward, info))
    return seen


def still(env: TrackEnv) -> Callable[[np.ndarray], np.ndarray]:
    return lambda _: np.zeros(env.action_space.shape, np.float32)


@pytest.mark.slow
@pytest.mark.parametrize("name", all_but_long(LONG_CHECKED))
def test_gymnasium_finds_nothing_to_complain_about(name):
    """`check_env` passes, warnings taken as errors."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(track(name))


@pytest.mark.slow
def test_same_seed_gives_the_same_episode_bit_for_bit():
    """In the same object and in another one; another seed gives another."""
    env = track()
    first = episode(env, 3)
    assert same(first, episode(env, 3))
    assert same(first, episode(track(), 3))
    assert not same(first, episode(env, 4))


@pytest.mark.slow
@pytest.mark.parametrize("name", EVERY)
def test_drives_that_made_the_way_follow_it(name):
    """From rest, through friction and all, to the rounding of actions: the way can be followed."""
    env = track(name)
    env.reset(seed=1)
    changes = np.diff(env.path.level, axis=0) / STEP
    assert np.abs(changes).max() * STEP < 0.0472
    for change in changes:
        info = env.step(change.astype(np.float32))[-1]
    assert info["rms_distance_mm"] < 0.1 * env.length_m
    assert info["rms_angle_deg"] < math.degrees(1e-3)
    assert info["is_success"]


@pytest.mark.slow
def test_target_starts_at_rest_and_goes_far_enough():
    """It starts where the tip stands, straight up, and comes a tenth of the length away."""
    env = track()
    for seed in range(5):
        _, info = env.reset(seed=seed)
        assert info["distance_mm"] == info["angle_deg"] == 0.0
        assert np.array_equal(info["target_mm"], info["tip_mm"])
        away = np.linalg.norm(env.path.tip_m - env.path.tip_m[0], axis=1)
        assert away.max() >= TARGET_CLEARANCE * env.length_m


@pytest.mark.slow
def test_observation_shows_the_target_and_where_it_goes():
    """Place and direction are of now, the velocity leads to the next place; at the end it is zero."""
    env = track()
    observation, _ = env.reset(seed=2)
    for step in range(EPISODE_STEPS):
        part = {name: observation[place] for name, place in env.layout.items()}
        assert part["target"] * env.length_m == pytest.approx(env.path.tip_m[step], abs=1e-7)
        assert part["target_direction"] == pytest.approx(env.path.direction[step], abs=1e-6)
        following_m = (part["target"] + CONTROL_STEP_S * part["target_velocity"]) * env.length_m
        assert following_m == pytest.approx(env.path.tip_m[step + 1], abs=1e-7)
        observation = env.step(np.zeros(env.action_space.shape, np.float32))[0]
    assert not observation[env.layout["target_velocity"]].any()


@pytest.mark.slow
@pytest.mark.parametrize("limit", [None, 3])
def test_the_clock_truncates_and_the_later_version_sees_it(limit: int | None) -> None:
    """v1 is v0 with one number more, the share of the way that is left; neither terminates by time."""
    arguments = {} if limit is None else {"max_episode_steps": limit}
    first, later = (
        gymnasium.make(SECTION.replace("-v0", version), **arguments) for version in ("-v0", "-v1")
    )
    seen, _ = first.reset(seed=2)
    more, _ = later.reset(seed=2)
    assert later.unwrapped.layout.keys() - first.unwrapped.layout.keys() == {"time_left"}
    still_ = np.zeros(2, np.float32)
    for step in range(1, (limit or EPISODE_STEPS) + 1):
        assert np.array_equal(more[:-1], seen)
        assert more[-1] == pytest.approx(1.0 - (step - 1) / EPISODE_STEPS)
        seen, _, terminated, truncated, _ = first.step(still_)
        more, *_, ended, late, _ = later.step(still_)
        assert not terminated
        assert not ended
        assert truncated == late == (step == (limit or EPISODE_STEPS))
    if limit is None:
        assert more[-1] == 0.0


@pytest.mark.slow
def test_copies_see_the_time_left_and_are_truncated() -> None:
    """As single ones, with and without a limit of steps."""
    many = gymnasium.make_vec(SECTION.replace("-v0", "-v1"), 2, "vector_entry_point", threads=1)
    many.reset(seed=2)
    still_ = np.zeros(many.action_space.shape, np.float32)
    for step in range(1, EPISODE_STEPS + 1):
        seen, _, terminated, truncated, _ = many.step(still_)
        assert seen[:, -1] == pytest.approx(1.0 - step / EPISODE_STEPS)
        assert not terminated.any()
        assert truncated.tolist() == [step == EPISODE_STEPS] * 2
    many.close()


def test_what_is_neither_true_nor_false_is_refused() -> None:
    """One line with the choices."""
    with pytest.raises(InputError, match="time_left = 1: choices: True, False"):
        track(time_left=1)


@pytest.mark.slow
def test_reward_and_success_are_those_of_the_text():
    """Distance and angle of every step, and their root mean squares at the end."""
    env = track()
    seen = run(env, still(env), seed=5)
    distance = 1e-3 * np.array([info["distance_mm"] for _, info in seen])
    angle = np.radians([info["angle_deg"] for _, info in seen])
    rewards = [reward for reward, _ in seen]
    assert rewards == pytest.approx(-distance / env.length_m - DIRECTION_WEIGHT * angle / math.pi)
    end = seen[-1][1]
    assert end["rms_distance_mm"] == pytest.approx(1e3 * np.sqrt(np.mean(distance**2)))
    assert end["rms_angle_deg"] == pytest.approx(np.degrees(np.sqrt(np.mean(angle**2))))
    cosine = [env.path.direction[step + 1] @ env.path.direction[0] for step in range(EPISODE_STEPS)]
    assert angle == pytest.approx(np.arccos(np.clip(cosine, -1, 1)), abs=1e-6)  # it stands still, straight
    assert not any(info["is_success"] for _, info in seen)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("away_m", "angle_rad", "success"),
    [(0.0, 0.0, True), (2.1e-3, 0.0, False), (0.0, 1.01 * DIRECTION_TOLERANCE_RAD, False)],
    ids=["both", "too far", "looking elsewhere"],
)
def test_success_needs_place_and_direction(away_m, angle_rad, success):
    """A tip that goes its own way again fails where the target is moved or turned by what is too much."""
    env = track()
    env.reset(seed=1)
    changes = np.diff(env.path.level, axis=0) / STEP
    cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
    turn = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
    env.path.direction[:] = env.path.direction @ turn.T
    env.path.tip_m[:, 1] += away_m
    for change in changes:
        info = env.step(change.astype(np.float32))[-1]
    assert info["is_success"] is success


def test_option_of_reset_is_refused():
    """There are none."""
    with pytest.raises(InputError, match="unknown option of reset 'target'"):
        track().reset(options={"target": (0.0, 0.0, 0.05)})


@pytest.mark.slow
def test_diverging_simulation_ends_the_episode_without_success(monkeypatch):
    """With the last finite observation and the reward that the text says."""
    env = track()
    env.reset(seed=1)

    def diverges(*_: Any) -> None:
        raise SimulationDiverged("diverged on purpose")

    monkeypatch.setattr(env.plant, "move", diverges)
    observation, reward, terminated, _, info = env.step(np.zeros(env.action_space.shape, np.float32))
    assert (reward, terminated, info["diverged"], info["is_success"]) == (DIVERGED_REWARD, True, True, False)
    assert observation in env.observation_space


@pytest.mark.parametrize("name", [SECTION, "catheter_sim/ChestTubeSectionTrack-v0"])
def test_directions_of_planar_robots_turn_by_the_sum_of_their_bends(name):
    """In the plane the tip looks along (sin b, 0, cos b) of all bends b, which the levels change."""
    quick = track(name).plant.quick
    level = np.full(len(quick.drives.names), 0.3)
    step = 1e-4 * np.eye(len(level))
    none = np.zeros_like(quick.bend_unit)
    bends = quick.reach(np.concatenate([level[np.newaxis], level + step, level - step]), none)[1][..., 0]
    total = bends.sum(axis=1)
    up, down = np.split(total[1:], 2)
    expected = np.outer([math.cos(total[0]), 0.0, -math.sin(total[0])], (up - down) / 2e-4)
    found = quick.direction_slopes(level, quick.reach(level[np.newaxis], none)[1][0])
    assert found == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())


def test_directions_of_catheters_turn_with_their_joints():
    """By differences of the tool's frame between postures that the drives bring about."""
    quick = track("catheter_sim/Mitral4dofTrack-v0").plant.quick
    level, none = np.array([0.3, -0.4, 0.2, 0.5]), np.zeros(4)
    step = 1e-5 * np.eye(4)
    values = quick.reach(np.concatenate([level + step, level - step]), none)[1]
    axes = tool_frame(quick.robot, values)[:, :3, 2]
    found = quick.direction_slopes(level, quick.reach(level[np.newaxis], none)[1][0])
    assert found == pytest.approx(((axes[:4] - axes[4:]) / 2e-5).T, abs=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("name", all_but_long(LONG_FOLLOWED))
def test_simple_controller_follows(name):
    """Of five ways, four or all; `scripts/baselines.py` counts more."""
    env = track(name)
    ends = [run(env, lambda seen: following(env, seen), seed)[-1][1] for seed in range(5)]
    assert sum(info["is_success"] for info in ends) >= 4


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [SECTION, pytest.param("catheter_sim/ChestTubeSectionTrack-v0", marks=pytest.mark.long)]
)
def test_chance_does_not_follow(name):
    """Random actions follow none of five ways of the robots whose tips go on a curve only."""
    env = track(name)
    rng = np.random.default_rng(0)
    for seed in range(5):
        end = run(env, lambda _: rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32), seed)[-1]
        assert not end[1]["is_success"]
