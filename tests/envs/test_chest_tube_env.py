"""The chest-tube environments: the contract that the neuroendoscope's keep, on robots of rolling joints."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
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
from catheter_sim.theory.static_models import STATIC_MODELS
from reference.steering import resolved_rate

pytestmark = pytest.mark.slow

FULL = "catheter_sim/ChestTubeReach-v0"
SECTION = "catheter_sim/ChestTubeSectionReach-v0"
LONG_FULL = pytest.param(FULL, marks=pytest.mark.long)
STRAIGHT = (0.0, 0.0, 0.225)  # the section's tip at rest
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


@pytest.mark.parametrize("name", [SECTION, LONG_FULL])
def test_gymnasium_finds_nothing_to_complain_about(name: str) -> None:
    """`check_env` passes, warnings taken as errors."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(reach(name))


@pytest.mark.parametrize("name", [SECTION, LONG_FULL])
def test_same_seed_gives_the_same_episode_bit_for_bit(name: str) -> None:
    """In the same object, in another one, and while pictures are drawn; another seed gives another."""
    env = reach(name)
    first = episode(env, 3)
    assert same(first, episode(env, 3))
    drawn = reach(name, render_mode="rgb_array", width=64, height=48)
    assert same(first, episode(drawn, 3, draw=True))
    drawn.close()
    assert not same(first, episode(env, 4))


def test_observation_of_the_full_robot_holds_what_its_layout_says() -> None:
    """Every part, in its unit, is the simulator's own; a segment's bend is the sum of its joints'."""
    env = reach(FULL)
    env.reset(seed=2)
    rates = np.array([1.0, 0.0, 0.3, 0.0, 0.0, 0.5, 1.0, 0.0])
    for _ in range(8):
        before = env.plant.posture().p_w[-1]
        observation, reward, _, _, info = env.step(rates.astype(np.float32))
    part = {name: observation[place] for name, place in env.layout.items()}
    posture = env.plant.posture()
    assert part["target"] == pytest.approx(env.target_m / 0.375, abs=1e-6)
    assert part["tip"] == pytest.approx(posture.p_w[-1] / 0.375, abs=1e-6)
    assert part["tip_direction"] == pytest.approx(posture.R_w[-1][:, 2], abs=1e-6)
    assert part["tip_velocity"] == pytest.approx(
        (posture.p_w[-1] - before) / CONTROL_STEP_S / 0.375, abs=1e-5
    )
    assert part["level"] == pytest.approx(8 * LEVEL_STEP * rates, abs=1e-6)
    assert part["tension"] == pytest.approx(8 * LEVEL_STEP * rates, abs=1e-6)
    assert info["commanded_tension_N"] == pytest.approx(env.drives.tension * 8 * LEVEL_STEP * rates, rel=1e-6)
    angles = posture.joint_angles / math.pi
    tip = angles[18:]  # toward +x and +y in turn
    expected = [angles[:15].sum(), 0.0, angles[15:18].sum(), 0.0, tip[::2].sum(), tip[1::2].sum()]
    assert part["bend"] == pytest.approx(expected, abs=1e-6)
    assert reward == pytest.approx(-np.linalg.norm(posture.p_w[-1] - env.target_m) / 0.375)


def test_ranges_are_those_of_the_datasheet(section: ReachEnv) -> None:
    """In newtons, as the class's text has them; targets count within 2 mm and 5 mm."""
    full = reach(FULL)
    ranges = [24.0, 26.6, 24.0, 26.6, 19.5, 19.5, 44.3, 44.3]
    assert full.drives.tension == pytest.approx(ranges, abs=0.05)
    assert section.drives.tension == pytest.approx([50.2], abs=0.05)
    assert (section.tolerance_m, full.tolerance_m) == (2e-3, 5e-3)
    assert all(f"{value:.1f} N" in str(ReachEnv.__doc__) for value in (*ranges, 50.2))


def test_pulling_the_rod_bends_the_section_toward_it_and_friction_holds_it(section: ReachEnv) -> None:
    """Out to half the range and back to a quarter: bent toward +x, and farther than on the way out."""
    section.reset(options={"target": STRAIGHT})
    bends = []
    for move in [1.0] * 10 + [-1.0] * 5:
        section.step(np.array([move], dtype=np.float32))
        bends.append(float(section.plant.segment_bends()[0, 0]))
    assert (np.diff(bends[:10]) > 0.0).all()
    assert bends[-1] > bends[4] + 0.2


def test_random_steps_of_the_full_robot_stay_finite() -> None:
    """40 random steps with all eight rods: finite, in the space, no divergence."""
    env = reach(FULL)
    rng = np.random.default_rng(0)
    env.reset(seed=0)
    for _ in range(40):
        observation, reward, _, _, info = env.step(rng.uniform(-0.5, 1.0, 8).astype(np.float32))
        assert observation in env.observation_space
        assert -2.0 <= reward <= 0.0
        assert not info["diverged"]


@pytest.mark.parametrize("name", [SECTION, LONG_FULL])
def test_the_baseline_reaches_targets_and_chance_does_not(name: str) -> None:
    """Resolved rates reach all of 10 targets, random actions one at most."""
    env = reach(name)
    reached = {"baseline": 0, "random": 0}
    for seed in range(10):
        for policy in reached:
            observation, info = env.reset(seed=seed)
            rng = np.random.default_rng(seed)
            for _ in range(100):
                move = rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)
                if policy == "baseline":
                    move = resolved_rate(env, observation)
                observation, _, terminated, _, info = env.step(move)
                if terminated:
                    break
            reached[policy] += info["is_success"]
    assert reached["baseline"] == 10, reached
    assert reached["random"] <= 1, reached


def test_a_simulation_that_diverges_ends_the_episode_and_a_reset_heals_it(section: ReachEnv) -> None:
    """With a state that is not finite, hinges and links are placed nowhere; after a reset as before."""
    first = episode(section, 3)
    section.reset(seed=0)
    before, *_ = section.step(np.ones(1, dtype=np.float32))
    section.plant.simulator.data.qvel[3] = math.nan
    observation, reward, terminated, _, info = section.step(np.ones(1, dtype=np.float32))
    assert (terminated, info["diverged"], info["is_success"], reward) == (True, True, False, DIVERGED_REWARD)
    assert np.array_equal(observation, before)
    assert same(first, episode(section, 3))


@pytest.mark.parametrize("name", [SECTION, LONG_FULL])
def test_random_targets_are_reached_again_by_the_levels_that_made_them(name: str) -> None:
    """Another simulator under the same inputs ends at the same points, far enough from rest."""
    first, second = reach(name).plant, reach(name).plant
    length = float(first.segment_length.sum())
    rng = np.random.default_rng(5)
    for _ in range(3):
        found = random_target(first, rng, 0.1 * length)
        assert np.array_equal(tip_at(second, found.level), found.tip_m)
        assert np.linalg.norm(found.tip_m - [0.0, 0.0, length]) >= 0.1 * length


def test_random_targets_of_the_section_are_where_theory_puts_them(section: ReachEnv) -> None:
    """The complete statics, friction and its history included, hold the tip within 0.25 mm of them."""
    plant = section.plant
    rng = np.random.default_rng(5)
    for _ in range(4):
        found = random_target(plant, rng, 0.02)
        tension = (plant.drives.tendon @ found.level)[np.newaxis]
        inputs = Inputs(np.ones(1), "tension", tension, np.zeros((1, 3)), np.zeros((1, 3)))
        static = STATIC_MODELS["complete"].solve(plant.simulator.robot, inputs, np.zeros(3))
        assert np.linalg.norm(static.postures[0].p_w[-1] - found.tip_m) < 0.25e-3, found


@pytest.mark.long
def test_every_reachable_point_of_the_full_robot_is_found_again() -> None:
    """The search refuses none of 8 points that the robot has been to, to 5 mm."""
    plant = reach(FULL).plant
    rng = np.random.default_rng(5)
    for _ in range(8):
        target = random_target(plant, rng, 0.0375).tip_m
        found = nearest(plant, target, 5e-3)
        assert np.linalg.norm(found.tip_m - target) <= 5e-3, (target, found)


@pytest.mark.parametrize(
    ("target", "message"),
    [
        ((0.0, 0.0, 0.235), r"235\.0 mm from the base, it is 225 mm long"),
        ((0.05, 0.02, 0.2), "y must be 0, as it bends in the xz plane only"),
        ((-0.1, 0.0, 0.19), "the tip was brought no nearer than"),  # its one rod bends it toward +x
    ],
)
def test_points_out_of_the_sections_reach_are_refused(
    section: ReachEnv, target: tuple[float, ...], message: str
) -> None:
    """Too far, off the plane, or on the side to which no rod pulls: one line says which."""
    with pytest.raises(InputError, match=message) as caught:
        require_reachable(section.plant, target, 5e-3)
    assert "\n" not in str(caught.value)


def test_displacement_is_refused() -> None:
    """Rods are pulled by tension only, in the line that names the choices."""
    for name in (SECTION, FULL):
        with pytest.raises(InputError, match=r"unknown action_type 'displacement'; choices: tension$"):
            reach(name, action_type="displacement")


def test_an_effect_on_the_robot_is_the_changed_robot() -> None:
    """Friction taken away as an effect is friction taken out of the specification."""
    tips = []
    for settings in (["effects.tendon_friction.mu=0"], ["friction.mu=0"], []):
        env = reach(settings=settings)
        env.reset(options={"target": STRAIGHT})
        for _ in range(8):
            info = env.step(np.ones(1, dtype=np.float32))[4]
        tips.append(1e-3 * info["tip_mm"])
    assert np.array_equal(tips[0], tips[1])
    assert np.linalg.norm(tips[0] - tips[2]) > 5e-3


def test_effects_on_inputs_and_outputs_act_step_by_step() -> None:
    """Backlash holds back half its width of tension; a measurement frame shifts what is seen only."""
    env = reach(
        settings=["effects.backlash.width_N=4", "effects.measurement_frame.translation_x_mm=10"],
    )
    observation, info = env.reset(options={"target": STRAIGHT})
    assert observation[env.layout["tip"]] == pytest.approx([10.0 / 225.0, 0.0, 1.0], abs=1e-6)
    assert 1e-3 * info["tip_mm"] == pytest.approx(STRAIGHT, abs=1e-6)
    for _ in range(4):
        info = env.step(np.ones(1, dtype=np.float32))[4]
    assert env.plant.simulator.data.ctrl == pytest.approx(info["commanded_tension_N"] - 2.0, abs=1e-9)


@pytest.mark.parametrize("name", [SECTION, LONG_FULL])
def test_a_picture_shows_the_rolled_robot_as_it_was_seen(name: str) -> None:
    """Drawn with the joints placed as the state has them, whatever the simulation's model says since."""
    env = reach(name, render_mode="rgb_array", width=320, height=240)
    env.reset(seed=0)
    at_rest = env.render()
    for _ in range(8):
        info = env.step(np.linspace(1.0, 0.2, len(env.drives.names)).astype(np.float32))[4]
    image = env.render()
    assert image is not None
    assert not np.array_equal(image, at_rest)
    red, green, blue = image.astype(int).transpose(2, 0, 1)
    assert ((green > red + 40) & (green > blue + 40)).sum() > 4  # the target
    drawn = env._picture._data.site("tip").xpos  # type: ignore[union-attr]
    assert drawn == pytest.approx(1e-3 * info["tip_mm"], abs=1e-9)
    hinges = env.plant.simulator.model.jnt_pos
    hinges[:] = 0.0
    assert np.array_equal(env.render(), image)
    assert not hinges.any()  # drawing leaves the simulation's model alone
    env.close()
