"""The mitral environments: the contract that the other robots' keep, on catheters of torsion and bending."""

from __future__ import annotations

import gc
import math
import warnings
import weakref
from typing import Any

import gymnasium
import numpy as np
import pytest
from episodes import episode, random_target, same
from gymnasium.utils.env_checker import check_env

from catheter_sim.core.inputs import Inputs
from catheter_sim.envs.reach_and_track import ReachEnv
from catheter_sim.envs.tip import (
    CONTROL_STEP_S,
    DIVERGED_REWARD,
    RATE_PER_S,
    nearest,
    require_reachable,
    tip_at,
)
from catheter_sim.errors import InputError
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.theory.static_models import STATIC_MODELS
from reference import steering
from reference.steering import resolved_rate

pytestmark = pytest.mark.slow

TRANSSEPTAL = "catheter_sim/MitralTransseptalReach-v0"
FOUR_DOF = "catheter_sim/Mitral4dofReach-v0"
BOTH = [pytest.param(TRANSSEPTAL, marks=pytest.mark.slow), FOUR_DOF]  # one in the fast set
# Nayar 2022, Table I, and Nayar 2023, Section III-C, each with 60 mm of stroke
LENGTH_M = {TRANSSEPTAL: 57.34e-3 + 60e-3, FOUR_DOF: 48.18e-3 + 60e-3}
LEVEL_STEP = RATE_PER_S * CONTROL_STEP_S


def reach(name: str, **arguments: Any) -> ReachEnv:
    env = gymnasium.make(name, **arguments).unwrapped
    assert isinstance(env, ReachEnv)
    return env


def action(*values: float) -> np.ndarray:
    return np.array(values, dtype=np.float32)


@pytest.mark.parametrize("name", [TRANSSEPTAL, FOUR_DOF])
def test_gymnasium_finds_nothing_to_complain_about(name: str) -> None:
    """`check_env` passes, warnings taken as errors."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(reach(name))


@pytest.mark.parametrize("name", BOTH)
def test_same_seed_gives_the_same_episode_bit_for_bit(name: str) -> None:
    """In the same object and in another one; another seed gives another."""
    env = reach(name)
    first = episode(env, 3)
    assert same(first, episode(env, 3))
    assert same(first, episode(reach(name), 3))
    assert not same(first, episode(env, 4))


@pytest.mark.parametrize("name", BOTH)
def test_observation_holds_what_its_layout_says(name: str) -> None:
    """Every part, in its unit, is the simulator's own; of each joint its value, of the tube its stroke."""
    env = reach(name)
    env.reset(seed=2)
    rates = np.array([0.8, -0.5, 0.3, 1.0])
    for _ in range(8):
        before = env.plant.posture().p_w[-1]
        observation, reward, _, _, info = env.step(rates.astype(np.float32))
    part = {key: observation[place] for key, place in env.layout.items()}
    posture, length = env.plant.posture(), LENGTH_M[name]
    assert env.length_m == pytest.approx(length)
    assert part["target"] == pytest.approx(env.target_m / length, abs=1e-6)
    assert part["tip"] == pytest.approx(posture.p_w[-1] / length, abs=1e-6)
    assert part["tip_direction"] == pytest.approx(posture.R_w[-1][:, 2], abs=1e-6)
    assert part["tip_velocity"] == pytest.approx(
        (posture.p_w[-1] - before) / CONTROL_STEP_S / length, abs=1e-5
    )
    assert part["level"] == pytest.approx(8 * LEVEL_STEP * rates, abs=1e-6)
    assert info["commanded_displacement_mm"] == pytest.approx(
        1e3 * np.diag(env.drives.tendon) * 8 * LEVEL_STEP * rates, rel=1e-6
    )
    angles = posture.joint_angles
    advance = float(env.plant.simulator.data.joint("advance").qpos[0])
    gaps = {TRANSSEPTAL: (slice(0, 1), slice(1, 12)), FOUR_DOF: (slice(0, 4), slice(4, 11))}[name]
    values = [angles[gaps[0]].sum(), angles[gaps[1]].sum(), advance, angles[-1]]
    expected = np.array(values) / [math.pi, math.pi, 60e-3, math.pi]
    assert np.abs(expected).min() > 0.03
    assert part["bend"] == pytest.approx(expected, abs=1e-6)
    assert part["tension"] == pytest.approx(posture.actuator_tension / env.drives.tension, abs=1e-6)
    assert part["tension"][0] > 0.1
    assert reward == pytest.approx(-np.linalg.norm(posture.p_w[-1] - env.target_m) / length)


@pytest.mark.parametrize("name", BOTH)
def test_full_action_takes_two_seconds_to_the_joints_limits_and_no_further(name: str) -> None:
    """The tube is out by 60 mm after 2 s, the angles at the papers' limits; levels and inputs stay there."""
    env = reach(name)
    robot = env.plant.simulator.robot
    assert isinstance(robot, CatheterRobot)
    limits = {part.name: part.limit_rad for part in robot.segments}
    env.reset(options={"target": (0.0, 0.0, LENGTH_M[name])})
    for way in (1.0, -1.0):
        steps = 20 if way > 0.0 else 40
        for _ in range(steps):
            info = env.step(np.full(4, way, dtype=np.float32))[4]
        full = info["commanded_displacement_mm"]
        env.step(np.full(4, way, dtype=np.float32))
        info = env.step(np.full(4, way, dtype=np.float32))[4]
        assert info["commanded_displacement_mm"] == pytest.approx(full, abs=1e-9)
        assert info["commanded_displacement_mm"][3] == pytest.approx(60.0 if way > 0.0 else 0.0, abs=1e-9)
        env.plant.settle()
        values = env.plant.segment_bends()
        order = [part.name for part in robot.segments if part.joint != "rigid"]
        for pair in robot.tendons[:3]:
            assert values[order.index(pair.moves)] == pytest.approx(way * limits[pair.moves], rel=1e-3)


def test_ranges_are_those_of_the_datasheet() -> None:
    """In millimetres, as the class's text has them."""
    ranges = {TRANSSEPTAL: [3.82, 3.12, 3.29, 60.0], FOUR_DOF: [3.38, 4.49, 2.75, 60.0]}
    for name, expected in ranges.items():
        env = reach(name)
        assert np.diag(env.drives.tendon) * 1e3 == pytest.approx(expected, abs=0.005)
        assert all(f"{value:g} mm" in str(ReachEnv.__doc__) for value in expected)
        assert env.tolerance_m == 2e-3
        assert list(env.drives.lowest) == [-1.0, -1.0, -1.0, 0.0]


@pytest.mark.parametrize("name", [TRANSSEPTAL, FOUR_DOF])
def test_the_last_torsion_does_not_move_the_tip(name: str) -> None:
    """Turned to and fro alone it leaves the tip within a micrometre: three drives matter for reaching."""
    env = reach(name)
    last = env.drives.names.index(
        {TRANSSEPTAL: "displacement_torsion_distal_mm", FOUR_DOF: "displacement_torsion_mm"}[name]
    )
    tip = tip_at(env.plant, np.array([0.6, 0.4, 0.5, 0.5]))
    axes = env.plant.posture().R_w[-1]
    level = np.array([0.6, 0.4, 0.5, 0.5])
    level[last] = -0.5
    assert tip_at(env.plant, level) == pytest.approx(tip, abs=1e-6)
    assert np.linalg.norm(env.plant.posture().R_w[-1] - axes) > 0.5


@pytest.mark.parametrize("name", [TRANSSEPTAL, FOUR_DOF])
def test_random_steps_stay_finite(name: str) -> None:
    """500 random steps: finite, in the space, no divergence."""
    env = reach(name)
    rng = np.random.default_rng(0)
    env.reset(seed=0)
    for _ in range(500):
        observation, reward, terminated, _, info = env.step(rng.uniform(-1.0, 1.0, 4).astype(np.float32))
        assert observation in env.observation_space
        assert -2.0 <= reward <= 0.0
        assert not info["diverged"]
        if terminated:
            env.reset()


@pytest.mark.parametrize("name", [TRANSSEPTAL, pytest.param(FOUR_DOF, marks=pytest.mark.long)])
def test_the_baseline_reaches_targets_and_chance_does_not(name: str) -> None:
    """Resolved rates reach 29 of 30 targets or more, random actions 1 of 30 at most."""
    env = reach(name)
    reached = {"baseline": 0, "random": 0}
    for seed in range(30):
        for policy in reached:
            observation, info = env.reset(seed=seed)
            rng = np.random.default_rng(seed)
            for _ in range(100):
                move = rng.uniform(-1.0, 1.0, 4).astype(np.float32)
                if policy == "baseline":
                    move = resolved_rate(env, observation)
                observation, _, terminated, _, info = env.step(move)
                if terminated:
                    break
            reached[policy] += info["is_success"]
    assert reached["baseline"] >= 29, reached
    assert reached["random"] <= 1, reached


def test_the_baseline_finds_the_way_to_a_target_behind_the_base() -> None:
    """Seed 8: straight to it, the proximal joint turns the wrong way and ends at its limit, 17 mm off."""
    env = reach(FOUR_DOF)
    observation, info = env.reset(seed=8)
    assert info["target_mm"][2] < 0.0
    for _ in range(55):
        observation, _, terminated, _, info = env.step(resolved_rate(env, observation))
        if terminated:
            break
    assert info["is_success"]


@pytest.mark.parametrize("name", [TRANSSEPTAL, FOUR_DOF])
def test_random_targets_are_where_the_kinematics_put_them_and_are_found_again(name: str) -> None:
    """PK holds the tip within 0.1 mm of each; the search refuses none of 15; another simulator agrees."""
    plant, other = reach(name).plant, reach(name).plant
    rng = np.random.default_rng(5)
    advances = []
    for _ in range(15):
        found = random_target(plant, rng, 0.1 * LENGTH_M[name])
        tendon = (plant.drives.tendon @ found.level)[np.newaxis]
        inputs = Inputs(np.ones(1), "displacement", tendon, np.zeros((1, 3)), np.zeros((1, 3)))
        static = STATIC_MODELS["pk"].solve(plant.simulator.robot, inputs, np.zeros(3))
        assert np.linalg.norm(static.postures[0].p_w[-1] - found.tip_m) < 0.1e-3
        again = nearest(plant, found.tip_m, 2e-3)
        assert np.linalg.norm(again.tip_m - found.tip_m) <= 2e-3
        assert tip_at(other, found.level) == pytest.approx(found.tip_m, abs=1e-12)
        advances.append(found.level[3])
    assert min(advances) > 0.0  # a tube is not drawn as a tendon that may be slack


def test_points_out_of_reach_are_refused() -> None:
    """Beyond the length with the tube all out, or inside the base: one line says so."""
    plant = reach(FOUR_DOF).plant
    with pytest.raises(InputError, match=r"111\.0 mm from the base, it is 108\.18 mm long"):
        require_reachable(plant, (0.0, 0.0, 0.111), 2e-3)
    with pytest.raises(InputError, match="the tip was brought no nearer than"):
        require_reachable(plant, (0.0, 0.0, -0.02), 2e-3)


def test_a_simulation_that_diverges_ends_the_episode_and_a_reset_heals_it() -> None:
    """With a state that is not finite: terminated; after a reset as before."""
    env = reach(FOUR_DOF)
    first = episode(env, 3)
    env.reset(seed=0)
    before, *_ = env.step(np.ones(4, dtype=np.float32))
    env.plant.simulator.data.qvel[3] = math.nan
    observation, reward, terminated, _, info = env.step(np.ones(4, dtype=np.float32))
    assert (terminated, info["diverged"], info["is_success"], reward) == (True, True, False, DIVERGED_REWARD)
    assert np.array_equal(observation, before)
    assert same(first, episode(env, 3))


def test_ranges_cannot_be_asked_for_and_only_displacement_drives() -> None:
    """`largest_bend_rad` and "tension" are refused in one line that says what is there instead."""
    with pytest.raises(InputError, match=r"largest_bend_rad = 1: does not apply .*limit_deg$"):
        reach(FOUR_DOF, largest_bend_rad=1.0)
    with pytest.raises(InputError, match=r"unknown action_type 'tension'; choices: displacement$"):
        reach(FOUR_DOF, action_type="tension")


def test_a_drive_that_an_effect_sends_beyond_its_joint_stops_there() -> None:
    """Twice the torsion's pull asked for would unwind the tendon: it stands at the end, nothing is raised.

    Level 1 is 2.75 mm; the tendon is unwound by 120 deg on its drum of 2.1 mm: at 4.398 mm.
    """
    settings = ["effects.actuation_gain.scale_torsion=2"]
    env = reach(FOUR_DOF, settings=settings)
    env.reset(options={"target": (0.0, 0.0, 0.1)})
    for _ in range(22):
        info = env.step(action(0.0, 0.0, 1.0, 0.0))[4]
    assert not info["diverged"]
    assert info["commanded_displacement_mm"][2] == pytest.approx(2.1 * math.radians(75.0))
    env.plant.settle()
    assert env.plant.segment_bends()[3] == pytest.approx(math.radians(120.0), rel=5e-3)


@pytest.mark.parametrize("robot", ["mitral_4dof@elongation", "mitral_transseptal@tube"])
def test_catheters_as_they_were_measured_are_driven_too(robot: str) -> None:
    """With stretch, slack, play and friction the baseline reaches a seeded target of each, to 2 mm."""
    env = ReachEnv(robot, tolerance_m=2e-3)
    observation, info = env.reset(seed=1)
    for _ in range(90):
        observation, _, terminated, _, info = env.step(resolved_rate(env, observation))
        if terminated:
            break
    assert info["is_success"]


@pytest.mark.parametrize("name", [TRANSSEPTAL, FOUR_DOF])
def test_a_picture_shows_the_bent_robot_and_its_target(name: str) -> None:
    """The picture changes with the posture, holds green pixels, and is drawn where the tip was seen."""
    env = reach(name, render_mode="rgb_array", width=320, height=240)
    env.reset(seed=0)
    at_rest = env.render()
    for _ in range(8):
        info = env.step(action(1.0, 0.5, 0.5, 1.0))[4]
    image = env.render()
    assert image is not None
    assert image.shape == (240, 320, 3)
    assert not np.array_equal(image, at_rest)
    red, green, blue = image.astype(int).transpose(2, 0, 1)
    assert ((green > red + 40) & (green > blue + 40)).sum() > 4
    drawn = env._picture._data.site("tip").xpos  # type: ignore[union-attr]
    assert drawn == pytest.approx(1e-3 * info["tip_mm"], abs=1e-9)
    env.close()


def test_plans_are_kept_with_their_robots(monkeypatch):
    """Two environments in turn plan once each for a target; a plan does not hold a robot that is no more."""
    asked = []

    class Robot:
        rest_bends, quick = None, None

        def reach(self, levels, bends):
            return levels, 2.0 * levels

    def level(robot, target_m):
        asked.append(robot)
        return target_m

    monkeypatch.setattr(steering, "frictionless_level", level)
    robots = [Robot(), Robot()]
    for robot in robots:
        robot.quick = Robot()
    for _ in range(3):
        for robot in robots:
            assert steering._planned_bends(robot, (1.0, 2.0)).tolist() == [2.0, 4.0]
    assert asked == robots
    assert steering._planned_bends(robots[0], (3.0, 0.0)).tolist() == [6.0, 0.0]
    last = weakref.ref(robots[0])
    robots.clear(), asked.clear()
    del robot
    gc.collect()
    assert last() is None
