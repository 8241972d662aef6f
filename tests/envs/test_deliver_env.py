"""The delivery to the mitral valve: Gymnasium's contract, and the claims of its datasheet."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from episodes import same
from gymnasium.utils.env_checker import check_env

from catheter_sim.catalogue import load_robot, robot_toml
from catheter_sim.envs.clinical.deliver import HELD_STEPS, LIMIT_N, DeliverEnv, from_valve
from catheter_sim.envs.tip import DIVERGED_REWARD
from catheter_sim.errors import InputError, SimulationDiverged
from catheter_sim.procedure.heart import FLOW_N, PRINTED_FLOW_N, SIDES, scallop
from catheter_sim.procedure.plan import random_case, ranges
from catheter_sim.robots.catheter.picture import holder_length_m
from reference.steering import deliver

TRANSSEPTAL = "catheter_sim/MitralTransseptalDeliver-v0"
FOUR_DOF = "catheter_sim/Mitral4dofDeliver-v0"
BOTH = (TRANSSEPTAL, FOUR_DOF)
ONE = (TRANSSEPTAL, pytest.param(FOUR_DOF, marks=pytest.mark.long))  # where the other runs apart
PUSH = np.array([0.0, 0.0, 0.0, 0.0, 1.0], dtype=np.float32)


def made(name: str = TRANSSEPTAL, **arguments: Any) -> DeliverEnv:
    env = gymnasium.make(name, **arguments).unwrapped
    assert isinstance(env, DeliverEnv)
    return env


def delivered(env: DeliverEnv, seed: int) -> dict[str, Any]:
    """Return the last info of an episode of the controller."""
    observation, info = env.reset(seed=seed)
    for _ in range(200):
        observation, _, terminated, _, info = env.step(deliver(env, observation))
        if terminated:
            break
    return info


@pytest.fixture(scope="module")
def env() -> Iterator[DeliverEnv]:
    one = made()
    yield one
    one.close()


@pytest.mark.slow
def test_start_is_before_the_septum_and_the_observation_says_where_things_are(env: DeliverEnv) -> None:
    """Implant 3 mm before the puncture, straight; places in robot lengths, unit vectors, no force."""
    observation, info = env.reset(seed=2)
    part = {name: observation[place] for name, place in env.layout.items()}
    length, robot = 117.34e-3, env.known
    end = holder_length_m(robot) + 9.5e-3 - robot.segments[-1].length_m
    assert info["tip_mm"] == pytest.approx((0.0, 0.0, -3.0 - 1e3 * end), abs=1e-6)
    assert part["tip"] == pytest.approx(1e-3 * info["tip_mm"] / length, abs=1e-6)
    assert part["target"] == pytest.approx(env.target_m / length, abs=1e-6)
    assert part["tip_direction"] == pytest.approx((0.0, 0.0, 1.0))
    assert part["tip_side"] == pytest.approx((1.0, 0.0, 0.0))
    assert np.linalg.norm(part["target_side"]) == pytest.approx(1.0)
    assert part["target_direction"] @ part["target_side"] == pytest.approx(0.0, abs=1e-6)
    below = (part["target"] - part["annulus"]) @ part["target_direction"] * length
    anatomy = env.anatomy.plan.anatomy
    assert below == pytest.approx(-env.anatomy.plan.target[2, 3] + env.anatomy.plan.below_m, abs=1e-6)
    assert part["atrium"] * length == pytest.approx(
        (anatomy.atrium_x_m, anatomy.atrium_y_m, anatomy.atrium_height_m), rel=1e-5
    )
    assert not part["force"].any()
    assert part["base"] == part["held"] == 0.0
    assert math.atan2(part["beat"][1], part["beat"][0]) % math.tau == pytest.approx(
        math.radians(info["beat_deg"])
    )


@pytest.mark.slow
def test_ramming_the_wall_ends_the_episode_without_success(env: DeliverEnv) -> None:
    """Straight on at full speed: the force rises past its limit on the wall opposite, which costs 200."""
    env.reset(seed=0, options={"anatomy": env.anatomy})
    for _ in range(60):
        observation, reward, terminated, _, info = env.step(PUSH)
        if terminated:
            break
        assert info["force_N"]["wall"] <= LIMIT_N
        assert -1.0 < reward < 0.0
    assert terminated
    assert info["pressed_too_hard"]
    assert not info["is_success"]
    assert not info["diverged"]
    assert reward == DIVERGED_REWARD
    assert LIMIT_N < info["peak_force_N"]["wall"] < 3.0 * LIMIT_N
    assert observation[env.layout["force"]][0] == pytest.approx(info["force_N"]["wall"] / LIMIT_N, rel=1e-6)
    anatomy = env.anatomy.plan.anatomy
    assert info["tip_mm"][2] > 1e3 * anatomy.atrium_x_m  # beyond the middle of the atrium


@pytest.mark.slow
def test_a_simulation_that_diverges_ends_the_episode(
    env: DeliverEnv, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the last finite observation, no success, and the cost of 200."""
    before, _ = env.reset(seed=0, options={"anatomy": env.anatomy})

    def diverge(*_: object) -> None:
        raise SimulationDiverged("planted")

    monkeypatch.setattr(env.plant, "move", diverge)
    observation, reward, terminated, _, info = env.step(PUSH)
    assert terminated
    assert info["diverged"]
    assert not info["is_success"]
    assert reward == DIVERGED_REWARD
    assert same([observation], [before])


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"robot": "neuroendoscope"}, "neuroendoscope: delivers no implant; choices: mitral_transseptal"),
        ({"robot": "nothing"}, "unknown robot 'nothing'"),
        ({"angle_deg": 0.0}, "angle_deg = 0: must be above 0"),
        ({"angle_deg": math.nan}, "angle_deg = nan"),
        ({"flow_N": (2.0, 1.0)}, r"flow_N = \(2.0, 1.0\): two amplitudes are needed, the lower first"),
        ({"flow_N": 1.0}, "flow_N = 1.0: two amplitudes"),
        ({"flow_N": (0.0, math.inf)}, "flow_N"),
        ({"settings": ["segments.advance.stroke_mm=5"]}, "stroke is shorter"),
    ],
)
def test_bad_arguments_are_told_in_a_line(arguments: dict[str, Any], told: str) -> None:
    """What was given, and what can be."""
    with pytest.raises(InputError, match=told) as caught:
        DeliverEnv(**{"robot": "mitral_transseptal", **arguments})
    assert "\n" not in str(caught.value)


def test_bad_options_of_reset_and_actions_are_told_in_a_line(env: DeliverEnv) -> None:
    """An unknown option, an anatomy of another kind, an action of another shape or without a value."""
    with pytest.raises(InputError, match="unknown option of reset 'target'; choices: anatomy"):
        env.reset(options={"target": (0, 0, 0)})
    with pytest.raises(InputError, match="a Case is needed"):
        env.reset(options={"anatomy": {"fossa_y_m": 0.0}})
    for action in (np.zeros(4), np.array([0, 0, 0, 0, math.nan])):
        with pytest.raises(InputError, match="5 numbers are needed"):
            env.step(action)


@pytest.mark.slow
@pytest.mark.parametrize("name", ONE)
def test_gymnasium_finds_nothing_to_complain_about(name: str) -> None:
    """`check_env` passes, warnings taken as errors."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(made(name), skip_render_check=True)


@pytest.mark.slow
def test_same_seed_gives_the_same_episode_bit_for_bit() -> None:
    """In the same object and in another one, robots drawn at reset included; another seed another."""
    options = {"randomised": {"friction.mu": (0.0, 0.1)}}
    env = made(**options)
    first = seeded(env, 3)
    seeded(env, 4)
    assert same(first, seeded(env, 3))
    assert same(first, seeded(made(**options), 3))
    assert not same(first, seeded(env, 4))


def seeded(env: DeliverEnv, seed: int) -> list[np.ndarray]:
    """Return the observations of ten random steps, pushed on."""
    rng = np.random.default_rng(seed)
    seen = [env.reset(seed=seed)[0]]
    for _ in range(10):
        action = np.append(rng.uniform(-1.0, 1.0, 4), 1.0).astype(np.float32)
        observation, reward, *_ = env.step(action)
        seen += [observation, np.float64(reward)]
    return seen


@pytest.mark.slow
@pytest.mark.parametrize("name", ONE)
def test_hearts_and_flows_lie_in_their_ranges(name: str) -> None:
    """Five resets: every number in its range, no two alike; and a given case is taken as it is."""
    env = made(name)
    seen = []
    for seed in range(5):
        env.reset(seed=seed)
        anatomy = env.anatomy.plan.anatomy
        assert all(low <= asdict(anatomy)[key] <= high for key, (low, high) in ranges(env.known).items())
        assert FLOW_N[0] <= env.anatomy.flow.amplitude_N <= FLOW_N[1]
        seen.append(anatomy)
    assert len(set(seen)) == 5
    case = random_case(env.known, np.random.default_rng(9), {"coaptation_rad": 0.1})
    env.reset(options={"anatomy": case})
    assert env.anatomy is case
    assert env.anatomy.plan.anatomy.coaptation_rad == 0.1


@pytest.mark.slow
def test_flow_swings_the_bent_tip_seventy_times_a_minute() -> None:
    """The tip of a bent robot that holds still swings 14 times in 12 s, as far as its statics say (less what
    its lag takes); in still blood not at all, and there is no force before it is through the septum.
    """
    env = made()
    across = replace(env.anatomy.flow, direction=np.array([1.0, 0.0, 0.0]))  # the stiff way is along the tip
    case = replace(env.anatomy, flow=across)
    ways = {}
    for size in (2.0 * PRINTED_FLOW_N, 0.0):
        env.reset(options={"anatomy": replace(case, flow=replace(case.flow, amplitude_N=size))})
        observation, _, _, _, before = env.step(np.zeros(5, dtype=np.float32))
        assert not before["flow_N"].any()
        for _ in range(36):  # above the valve, bent
            observation = env.step(deliver(env, observation))[0]
        tips, forces = [], []
        for _ in range(120):
            info = env.step(np.zeros(5, dtype=np.float32))[4]
            tips.append(1e-3 * info["tip_mm"])
            forces.append(info["flow_N"])
        assert not any(info["peak_force_N"].values())
        assert np.linalg.norm(forces, axis=1).max() == pytest.approx(size, rel=0.02)
        moved = np.array(tips) - np.mean(tips, axis=0)
        spectrum = np.abs(np.fft.rfft(moved, axis=0)).sum(axis=1)
        ways[size] = np.linalg.norm(moved, axis=1).max()
        if size:
            assert int(spectrum[1:].argmax()) + 1 == 14
            simulator, ends = env.plant.simulator, []
            for sign in (1.0, -1.0):
                push = sign * size * (from_valve(case)[:3, :3] @ case.flow.direction)
                simulator.set_inputs(1e-3 * info["commanded_displacement_mm"], push)
                simulator.settle()
                ends.append(simulator.posture().p_w[-1])
            still = 0.5 * float(np.linalg.norm(ends[1] - ends[0]))
    assert still > 0.03e-3
    assert ways[2.0 * PRINTED_FLOW_N] == pytest.approx(still, rel=0.15)
    assert ways[0.0] < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("name", [pytest.param(TRANSSEPTAL, marks=pytest.mark.long), FOUR_DOF])
def test_controller_delivers_and_chance_does_not(name: str) -> None:
    """Seeds 0 to 3: held for a beat, upright between the leaflets, whose edges lie above the implant's
    foot on both sides, no force beyond its limit; random actions deliver nothing.
    """
    env = made(name)
    for seed in range(4):
        info = delivered(env, seed)
        assert info["is_success"], (seed, info)
        assert math.hypot(info["centring_mm"], info["depth_mm"]) <= 1e3 * env.tolerance_m
        assert max(info["tilt_deg"], info["turn_deg"]) <= 3.0
        assert 0.0 < max(info["peak_force_N"].values()) < LIMIT_N
        valve, data = np.linalg.inv(from_valve(env.anatomy)), env.plant.simulator.data
        foot = holder_length_m(env.known) - env.known.segments[-1].length_m
        tip = data.site("tip")
        heights = [foot * tip.xmat.reshape(3, 3)[:, 2] + tip.xpos]
        for side, sign in SIDES.items():
            margin = data.body(f"margin_{side}")
            length = scallop(env.anatomy.plan.anatomy, sign)[1].length_m
            heights.append(margin.xpos + length * margin.xmat.reshape(3, 3)[:, 0])
        implant, *edges = np.array(heights) @ valve[2, :3] + valve[2, 3]
        assert implant < min(edges) < 0.0
        env.reset(seed=seed)
        rng = np.random.default_rng(seed)
        for _ in range(60):
            _, _, terminated, _, info = env.step(rng.uniform(-1.0, 1.0, 5).astype(np.float32))
            assert not info["is_success"]
            if terminated:
                break


@pytest.mark.slow
def test_success_takes_a_whole_beat() -> None:
    """The last nine steps, and no more, were within the tolerances; a larger tolerance ends sooner."""
    env = made()
    assert HELD_STEPS == 9
    counts = []
    for tolerance in (1e-3, 3e-3):
        env = made(tolerance_m=tolerance, angle_deg=10.0)
        observation, info = env.reset(seed=1)
        near = []
        for _ in range(200):
            observation, _, terminated, _, info = env.step(deliver(env, observation))
            place = 1e-3 * math.hypot(info["centring_mm"], info["depth_mm"])
            near.append(place <= tolerance and info["angle_deg"] <= 10.0)
            if terminated:
                break
        assert info["is_success"]
        assert near == [False] * (len(near) - 9) + [True] * 9
        counts.append(len(near))
    assert counts[1] < counts[0]


@pytest.mark.long
def test_controller_delivers_robots_drawn_at_reset_and_a_diagnosed_one(tmp_path: Path) -> None:
    """Friction, gain and dead-band drawn within bounds, two seeds; and a `.toml` with stretching tendons."""
    bounds = {"friction.mu": (0.02, 0.1), "effects.backlash.width_mm": (0.1, 0.3)}
    env = made(randomised=bounds)
    robots = []
    for seed in range(2):
        assert delivered(env, seed)["is_success"]
        robots.append(env.plant.specified)
    assert robots[0].friction.mu != robots[1].friction.mu
    assert all(0.02 <= robot.friction.mu <= 0.1 for robot in robots)
    path = tmp_path / "robot.toml"
    settings = ["effects.tendon_elongation.stiffness_N_per_mm=20", "friction.mu=0.05"]
    path.write_text(robot_toml(load_robot("mitral_transseptal", settings)))
    assert delivered(made(robot=str(path)), 0)["is_success"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ONE)
def test_random_steps_stay_finite_and_the_engine_warns_of_nothing(name: str) -> None:
    """250 steps, the robot pushed in and then moved at random, again and again: finite, in the space."""
    env = made(name)
    rng = np.random.default_rng(0)
    options = {"anatomy": env.anatomy}
    env.reset(seed=0, options=options)
    for step in range(250):
        action = PUSH if step % 50 < 25 else rng.uniform(-1.0, 1.0, 5).astype(np.float32)
        observation, reward, terminated, _, info = env.step(action)
        assert observation in env.observation_space
        assert math.isfinite(reward)
        assert not info["diverged"]
        assert not env.plant.simulator.data.warning.number.any()
        if terminated:
            env.reset(options=options)


@pytest.mark.slow
def test_picture_shows_the_robot_through_the_wall() -> None:
    """(height, width, 3) bytes, the same again; the robot inside the atrium is seen through its wall."""
    env = made(render_mode="rgb_array", width=160, height=120)
    env.reset(seed=0)
    before = env.render()
    assert before is not None
    assert before.shape == (120, 160, 3)
    assert (env.render() == before).all()
    for _ in range(24):
        env.step(PUSH)
    after = env.render()
    assert after is not None
    assert (np.abs(after.astype(int) - before).max(axis=2) > 20).mean() > 0.01
    env.close()
