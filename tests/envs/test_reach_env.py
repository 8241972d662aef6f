"""The reaching task: Gymnasium's contract, and the claims of its datasheet."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from episodes import episode, same
from gymnasium.utils.env_checker import check_env

from catheter_sim.catalogue import load_robot, robot_toml
from catheter_sim.envs.reach_and_track import ReachEnv
from catheter_sim.envs.tip import CONTROL_STEP_S, DIVERGED_REWARD, RATE_PER_S
from catheter_sim.errors import InputError
from reference.steering import resolved_rate

FULL = "catheter_sim/NeuroendoscopeReach-v0"
SECTION = "catheter_sim/NeuroendoscopeSectionReach-v0"
STRAIGHT = (0.0, 0.0, 0.06)  # the section's tip at rest
LEVEL_STEP = RATE_PER_S * CONTROL_STEP_S


def reach(name: str = SECTION, **arguments: Any) -> ReachEnv:
    env = gymnasium.make(name, **arguments).unwrapped
    assert isinstance(env, ReachEnv)
    return env


@pytest.fixture(scope="module")
def section() -> Iterator[ReachEnv]:
    env = reach()
    yield env
    env.close()


def action(*values: float) -> np.ndarray:
    return np.array(values, dtype=np.float32)


@pytest.mark.parametrize(
    ("name", "action_type"),
    [
        (SECTION, "tension"),
        pytest.param(SECTION, "displacement", marks=pytest.mark.slow),
        pytest.param(FULL, "tension", marks=pytest.mark.slow),
        pytest.param(FULL, "displacement", marks=pytest.mark.long),
    ],
)
def test_gymnasium_finds_nothing_to_complain_about(name: str, action_type: str) -> None:
    """`check_env` passes, warnings taken as errors."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(reach(name, action_type=action_type))


@pytest.mark.slow
def test_same_seed_gives_the_same_episode_bit_for_bit(section: ReachEnv) -> None:
    """In the same object, in another one, and while pictures are drawn; another seed gives another."""
    first = episode(section, 3)
    assert same(first, episode(section, 3))
    drawn = reach(render_mode="rgb_array", width=64, height=48)
    assert same(first, episode(drawn, 3, draw=True))
    drawn.close()
    assert not same(first, episode(section, 4))


@pytest.mark.slow
def test_targets_of_the_section_count_within_2_mm_and_of_the_whole_robot_within_5_mm(
    section: ReachEnv,
) -> None:
    """As the class's text says."""
    assert (section.tolerance_m, reach(FULL).tolerance_m) == (2e-3, 5e-3)


@pytest.mark.slow
def test_reset_without_seed_goes_on_with_the_generator(section: ReachEnv) -> None:
    """After one seed, the sequence of targets is fixed, and no two are alike."""
    other = reach()
    sequences = []
    for env in (section, other):
        env.reset(seed=11)
        targets = [1e3 * env.target_m] + [env.reset()[1]["target_mm"] for _ in range(3)]
        sequences.append(np.array(targets))
    assert np.array_equal(*sequences)
    assert len(np.unique(sequences[0], axis=0)) == 4


def run_at_random(env: ReachEnv, steps: int, seed: int) -> None:
    """Take random steps; everything stays finite and in its space."""
    rng = np.random.default_rng(seed)
    env.reset(seed=seed)
    for step in range(steps):
        moved = rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)
        observation, reward, terminated, _, info = env.step(moved)
        assert np.isfinite(observation).all(), step
        assert observation in env.observation_space, step
        assert -2.0 <= reward <= 0.0, step
        assert not info["diverged"], step
        if terminated or step % 100 == 99:
            env.reset()


@pytest.mark.slow
@pytest.mark.parametrize("action_type", ["tension", "displacement"])
def test_random_steps_stay_finite(action_type: str) -> None:
    """100 random steps of the section; the slow test takes 1500 of the whole robot."""
    run_at_random(reach(action_type=action_type), 100, seed=0)


@pytest.mark.long
def test_random_steps_of_the_whole_robot_stay_finite() -> None:
    """1500 random steps, in 15 episodes, give no NaN."""
    run_at_random(reach(FULL), 1_500, seed=0)


def test_observation_holds_what_its_layout_says(section: ReachEnv) -> None:
    """Every part of the observation, in its unit, is the simulator's own."""
    section.reset(seed=2)
    for _ in range(12):
        before = section.plant.posture().p_w[-1]
        observation, _, _, _, info = section.step(action(1.0, 0.3))
    part = {name: observation[place] for name, place in section.layout.items()}
    posture = section.plant.posture()
    assert part["target"] == pytest.approx(section.target_m / 0.06, abs=1e-6)
    assert part["tip"] == pytest.approx(posture.p_w[-1] / 0.06, abs=1e-6)
    assert part["tip_direction"] == pytest.approx(posture.R_w[-1][:, 2], abs=1e-6)
    velocity = (posture.p_w[-1] - before) / CONTROL_STEP_S
    assert part["tip_velocity"] == pytest.approx(velocity / 0.06, abs=1e-5)
    assert part["level"] == pytest.approx([0.6, 0.18], abs=1e-6)
    assert part["tension"] == pytest.approx([0.6, 0.18], abs=1e-6)
    assert info["commanded_tension_N"] == pytest.approx(section.drives.tension * [0.6, 0.18], abs=1e-6)
    half_turns = posture.joint_angles.sum() / math.pi
    assert part["bend"] == pytest.approx([half_turns, 0.0], abs=1e-6)
    assert math.atan2(part["tip_direction"][0], part["tip_direction"][2]) == pytest.approx(
        half_turns * math.pi, abs=1e-5
    )


def test_levels_move_at_their_rate_and_stay_in_their_range(section: ReachEnv) -> None:
    """A full action moves a level by a twentieth; a tension ends at slack and at its largest value."""
    section.reset(options={"target": STRAIGHT})
    for step in range(25):
        _, _, _, _, info = section.step(action(3.0, -1.0))  # beyond the space: taken as 1
        assert section.plant.level == pytest.approx([min(1.0, (step + 1) * LEVEL_STEP), 0.0])
    assert info["commanded_tension_N"] == pytest.approx([section.drives.tension[0], 0.0])


def test_pulling_toward_the_target_shortens_the_way_and_pulling_away_lengthens_it(
    section: ReachEnv,
) -> None:
    """With the target on the right, ten steps of the right tendon come nearer, of the left do not."""
    target = (0.025, 0.0, 0.0525)
    for pulled, nearer in ((action(1.0, 0.0), True), (action(0.0, 1.0), False)):
        _, info = section.reset(options={"target": target})
        distances = [info["distance_mm"]]
        for _ in range(10):
            _, reward, _, _, info = section.step(pulled)
            distances.append(info["distance_mm"])
            assert reward == pytest.approx(-info["distance_mm"] / 60.0)
        change = np.diff(distances)
        assert (change < 0.0).all() if nearer else (change > 0.0).all()


def test_success_needs_nearness_and_rest() -> None:
    """Passing the target at speed is no success; standing at it is, and so is nothing else."""
    env = reach(hold_steps=1)
    env.reset(options={"target": (0.025, 0.0, 0.0525)})
    passed = 0
    for _ in range(20):
        _, _, terminated, truncated, info = env.step(action(1.0, 0.0))
        near, slow = info["distance_mm"] <= 2.0, info["speed_mm_per_s"] < 2.0
        assert terminated == info["is_success"] == (near and slow)
        assert not truncated
        passed += near and not slow
    assert passed >= 1
    env.reset(options={"target": STRAIGHT})
    assert env.step(action(0.0, 0.0))[2]


def test_success_is_held_for_half_a_second(section: ReachEnv) -> None:
    """Five steps in a row at rest at the target; a motion begins the count anew; the observation tells it."""
    _, info = section.reset(options={"target": STRAIGHT})
    assert not info["is_success"]
    held = []
    for pull in (0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0):
        before = len(held) and held[-1]
        observation, _, terminated, _, info = section.step(action(pull, 0.0))
        there = info["distance_mm"] <= 2.0 and info["speed_mm_per_s"] < 2.0
        held.append(before + 1 if there else 0)
        assert observation[section.layout["held"]] == pytest.approx(held[-1] / 5)
        assert terminated == info["is_success"] == (held[-1] == 5)
        if terminated:
            break
    assert held[2] == 0  # it moved
    assert held[-5:] == [1, 2, 3, 4, 5]


@pytest.mark.slow
def test_chance_reaches_next_to_no_target_of_a_section() -> None:
    """Random actions: of 20 targets one at most (of 100: none)."""
    env = reach()
    reached = 0
    for seed in range(20):
        env.reset(seed=seed)
        rng = np.random.default_rng(seed)
        ends = (env.step(rng.uniform(-1.0, 1.0, 2).astype(np.float32)) for _ in range(100))
        reached += any(terminated for _, _, terminated, _, _ in ends)
    assert reached <= 1


@pytest.mark.slow
def test_friction_makes_the_way_matter() -> None:
    """Out to full tension and halfway back: with friction the tip stays behind, without it does not."""
    gaps = []
    for settings in ((), ("friction.mu=0",)):
        env = reach(settings=settings)
        env.reset(options={"target": STRAIGHT})
        tips = []
        for moved in [1.0] * 10 + [0.0] * 5 + [1.0] * 10 + [-1.0] * 10 + [0.0] * 5:
            tips.append(env.step(action(moved, 0.0))[4]["tip_mm"])
        gaps.append(float(1e-3 * np.linalg.norm(tips[14] - tips[-1])))
    assert gaps[0] > 3e-3
    assert gaps[1] < 0.05e-3


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "action_type"),
    [
        (SECTION, "tension"),
        pytest.param(SECTION, "displacement", marks=pytest.mark.slow),
        pytest.param(FULL, "tension", marks=pytest.mark.slow),
        pytest.param(FULL, "displacement", marks=pytest.mark.long),
    ],
)
def test_the_baseline_reaches_targets(name: str, action_type: str) -> None:
    """Resolved rates on the frictionless Jacobian reach 8 of 10 targets or more, to 2 mm."""
    env = reach(name, action_type=action_type, tolerance_m=2e-3)
    reached, steps = 0, 0
    for seed in range(10):
        observation, info = env.reset(seed=seed)
        for _ in range(100):
            observation, _, terminated, _, info = env.step(resolved_rate(env, observation))
            steps += 1
            if terminated:
                break
        reached += info["is_success"]
    assert reached >= 8, f"{reached} of 10 in {steps} steps"


def test_a_simulation_that_diverges_ends_the_episode(section: ReachEnv) -> None:
    """With a state that is not finite: terminated, a finite observation, and a reset heals it."""
    section.reset(seed=0)
    before, *_ = section.step(action(1.0, 0.0))
    section.plant.simulator.data.qvel[3] = math.nan
    observation, reward, terminated, truncated, info = section.step(action(1.0, 0.0))
    assert (terminated, truncated, info["diverged"], info["is_success"]) == (True, False, True, False)
    assert reward == DIVERGED_REWARD
    assert np.array_equal(observation, before)
    assert all(np.isfinite(value).all() for value in info.values())
    assert same(episode(section, 3), episode(reach(), 3))


@pytest.mark.slow
def test_a_robot_pulled_beyond_reason_diverges_and_says_so() -> None:
    """Pulls of half a metre wind the robot up: the episode ends as diverged, not as an exception."""
    env = reach(action_type="displacement", largest_bend_rad=400.0)
    env.reset(options={"target": STRAIGHT})
    for _ in range(20):
        observation, reward, terminated, _, info = env.step(action(1.0))
        assert np.isfinite(observation).all()
        if terminated:
            break
    assert info["diverged"]
    assert reward == DIVERGED_REWARD


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"goal": STRAIGHT}, "unknown option of reset 'goal'; choices: target"),
        ({"target": (0.2, 0.0, 0.0)}, r"200\.0 mm from the base, it is 60 mm long"),
    ],
)
def test_bad_reset_options_are_refused(section: ReachEnv, options: dict[str, Any], message: str) -> None:
    """Unknown options and targets out of reach end in one line."""
    with pytest.raises(InputError, match=message):
        section.reset(options=options)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"robot": "snake"}, "unknown robot 'snake'"),
        ({"action_type": "torque"}, "unknown action_type 'torque'; choices: tension, displacement"),
        ({"tolerance_m": 0.0}, "tolerance_m = 0: must be above zero"),
        ({"largest_bend_rad": math.inf}, "largest_bend_rad = inf: must be above zero and finite"),
        ({"gravity_mps2": (0.0, 9.81)}, "three finite numbers are needed"),
        ({"settings": ["friction.nu=0"]}, "nu"),
        ({"hold_steps": 0}, "hold_steps = 0: must be a whole number, 1 or more"),
        ({"hold_steps": 2.0}, r"hold_steps = 2\.0: must be"),
    ],
)
def test_bad_arguments_are_refused(arguments: dict[str, Any], message: str) -> None:
    """Impossible arguments end in one line that names them and the choices."""
    with pytest.raises(InputError, match=message):
        ReachEnv(**{"robot": "neuroendoscope_section"} | arguments)


def test_an_action_of_the_wrong_kind_is_refused(section: ReachEnv) -> None:
    """Too many numbers, or none, are no action."""
    section.reset(seed=0)
    for bad in (action(1.0, 0.0, 0.0), action(math.nan, 0.0)):
        with pytest.raises(InputError, match="2 numbers are needed"):
            section.step(bad)


def test_an_unknown_render_mode_is_refused() -> None:
    """Only rgb_array, or none."""
    with pytest.raises(InputError, match="unknown render_mode 'human'; choices: rgb_array, None"):
        ReachEnv("neuroendoscope_section", render_mode="human")


def test_a_robot_from_a_file_gives_the_same_episode(section: ReachEnv, tmp_path: Path) -> None:
    """The same robot, by its id or by the path of its .toml."""
    path = tmp_path / "robot.toml"
    path.write_text(robot_toml(load_robot("neuroendoscope_section")), encoding="utf-8")
    assert same(episode(section, 6), episode(ReachEnv(path), 6))


@pytest.mark.slow
def test_a_robot_that_bends_in_space_is_driven_too() -> None:
    """The baseline brings the spacer-disk robot, whose tendons bend it in the yz plane, to a target."""
    env = ReachEnv("spacer_disk", action_type="displacement", largest_bend_rad=0.6)
    assert env.drives.names == ("bend_first_y", "bend_second_y")
    observation, info = env.reset(seed=1)
    for _ in range(35):
        observation, _, terminated, _, info = env.step(resolved_rate(env, observation))
        if terminated:
            break
    assert info["is_success"]


def test_vector_environments_hold_it() -> None:
    """Gymnasium's vector environment steps several at once, each with its own target."""
    many = gymnasium.make_vec(SECTION, num_envs=2)
    observation, info = many.reset(seed=1)
    assert observation.shape == (2, 19)
    assert not np.array_equal(info["target_mm"][0], info["target_mm"][1])
    many.step(np.zeros((2, 2), dtype=np.float32))
    many.close()
