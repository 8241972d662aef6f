"""Effects act in an environment as they do elsewhere: on the robot, its inputs and what is seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from catheter_sim.envs.reach_and_track import ReachEnv
from catheter_sim.errors import InputError
from catheter_sim.mechanics.hysteresis import lagged

STRAIGHT = (0.0, 0.0, 0.06)


def tips(settings: Sequence[str], moves: Sequence[float], start: tuple[float, ...] = STRAIGHT) -> np.ndarray:
    """Return the true tips after each move of the right tendon, the one at rest first, shape (n, 3) [m]."""
    env = ReachEnv("neuroendoscope_section", settings)
    _, info = env.reset(options={"target": start})
    rows = [info["tip_mm"]]
    for move in moves:
        rows.append(env.step(np.array([move, 0.0], dtype=np.float32))[4]["tip_mm"])
    return 1e-3 * np.array(rows)


@pytest.mark.slow
def test_an_effect_on_the_robot_is_the_changed_robot() -> None:
    """Friction taken away as an effect is friction taken out of the specification."""
    moves = [1.0] * 8 + [-1.0] * 4
    effect = tips(["effects.tendon_friction.mu=0"], moves)
    assert np.array_equal(effect, tips(["friction.mu=0"], moves))
    assert not np.allclose(effect, tips([], moves), atol=1e-4)


def test_backlash_loses_the_first_motion() -> None:
    """Nothing moves until the tension has crossed half the dead-band; from then on it does."""
    step_N = 0.05 * 0.3216  # of the section's right tendon in a full action
    rows = tips([f"effects.backlash.width_N={4 * step_N}"], [1.0] * 6)
    moved = np.linalg.norm(np.diff(rows, axis=0), axis=1)
    assert (moved[:2] < 1e-6).all()
    assert (moved[3:] > 1e-3).all()


@pytest.mark.slow
def test_backlash_in_an_environment_is_the_effect_on_the_whole_history() -> None:
    """What arrives at the robot, step by step, is what the effect makes of all commands at once."""
    env = ReachEnv("neuroendoscope_section", ["effects.backlash.width_N=0.05"])
    env.reset(options={"target": STRAIGHT})
    rng = np.random.default_rng(4)
    arrived, commanded = [], [np.zeros(2)]
    for _ in range(20):
        info = env.step(rng.uniform(-1.0, 1.0, 2).astype(np.float32))[4]
        commanded.append(info["commanded_tension_N"])
        arrived.append(env.plant.simulator.data.ctrl.copy())
    now, expected = np.zeros(2), []
    for value in commanded[1:]:
        now = np.clip(now, value - 0.025, value + 0.025)
        expected.append(now)
    assert np.array(arrived) == pytest.approx(np.array(expected), abs=1e-12)


@pytest.mark.slow
def test_a_load_that_the_model_does_not_know_acts_before_the_first_step() -> None:
    """Under a payload the episode starts where the robot hangs, and stays there."""
    start = tips(["effects.payload.force_x_N=0.01"], [0.0] * 3, (0.0, 0.0, 0.0595))
    assert start[0, 0] > 1e-3
    assert np.abs(start - start[0]).max() < 1e-6


def test_weight_acts_before_the_first_step() -> None:
    """Under gravity the episode starts at rest, bent down."""
    env = ReachEnv("neuroendoscope_section", gravity_mps2=(9.81, 0.0, 0.0))
    _, info = env.reset(seed=0)
    # nominal value of the specification: the tip at 7.154 mm under gravity along +x
    assert info["tip_mm"][0] == pytest.approx(7.154, abs=0.3)
    assert env.step(np.zeros(2, dtype=np.float32))[4]["speed_mm_per_s"] < 0.1


@pytest.mark.slow
def test_a_measurement_frame_moves_what_is_seen_and_not_what_is_true() -> None:
    """The observed tip is shifted; distance, reward and the true tip are not."""
    shifted = ReachEnv("neuroendoscope_section", ["effects.measurement_frame.translation_x_mm=6"])
    plain = ReachEnv("neuroendoscope_section")
    (seen, info), (_, plain_info) = shifted.reset(seed=1), plain.reset(seed=1)
    place = shifted.layout["tip"]
    assert seen[place] == pytest.approx((info["tip_mm"] + [6.0, 0.0, 0.0]) / 60.0, abs=1e-6)
    assert np.array_equal(info["tip_mm"], plain_info["tip_mm"])
    assert info["distance_mm"] == plain_info["distance_mm"]


def test_unknown_effects_are_refused() -> None:
    """An unknown effect ends in one line with the choices."""
    with pytest.raises(InputError, match="unknown effect 'slack'; choices: "):
        ReachEnv("neuroendoscope_section", ["effects.slack.width_N=0.1"])


@pytest.mark.slow
def test_effects_on_inputs_take_the_unit_of_the_actions() -> None:
    """Under displacement a backlash is a length, and one given as a force is refused."""
    ReachEnv("neuroendoscope_section", ["effects.backlash.width_mm=0.1"], "displacement")
    with pytest.raises(InputError, match="width_N"):
        ReachEnv("neuroendoscope_section", ["effects.backlash.width_N=0.1"], "displacement")


def test_a_tracker_that_lags_shows_the_tip_late() -> None:
    """What is seen is the true tip's first-order lag, from the start; reward and truth are not late."""
    late = ReachEnv("neuroendoscope_section", ["effects.rate.output_lag_s=0.3"])
    plain = ReachEnv("neuroendoscope_section")
    (seen, info), _ = late.reset(seed=1), plain.reset(seed=1)
    place = late.layout["tip"]
    time_s, true, shown = [0.0], [info["tip_mm"]], [seen[place] * 60.0]
    for action in ([1.0, 0.0], [1.0, -0.5], [0.0, 0.0], [-1.0, 1.0], [0.0, 0.0], [0.0, 0.0]):
        moved = np.array(action, dtype=np.float32)
        seen, reward, *_, info = late.step(moved)
        _, plain_reward, *_, plain_info = plain.step(moved)
        assert np.array_equal(info["tip_mm"], plain_info["tip_mm"])
        assert info["speed_mm_per_s"] == plain_info["speed_mm_per_s"]
        assert reward == plain_reward
        time_s.append(time_s[-1] + 0.1)
        true.append(info["tip_mm"])
        shown.append(seen[place] * 60.0)
    expected = lagged(np.array(time_s), np.array(true), 0.3, rest=true[0])
    np.testing.assert_allclose(shown, expected, atol=1e-5)
    assert np.abs(np.array(shown) - true).max() > 0.5
    again, info = late.reset(seed=1)
    assert again[place] * 60.0 == pytest.approx(info["tip_mm"], abs=1e-5)  # the last episode is forgotten
