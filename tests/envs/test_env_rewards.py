"""The pure parts of rewards and ends, on both sides of every bound."""

from __future__ import annotations

import math

import numpy as np
import pytest

from catheter_sim.envs import EPISODE_STEPS
from catheter_sim.envs.reach_and_track import angle_between, arrived, cost_of, followed
from catheter_sim.envs.tip import CONTROL_STEP_S, DIVERGED_REWARD, RATE_PER_S


@pytest.mark.parametrize("angle", [0.0, 1e-7, 0.3, math.pi / 2.0, 3.0, math.pi])
def test_angle_between_directions_is_exact_for_small_and_large_ones(angle: float) -> None:
    """Not the chord, and not an arccosine, which loses small angles; for many directions at once."""
    rng = np.random.default_rng(2)
    one = rng.normal(size=(5, 3))
    one /= np.linalg.norm(one, axis=1)[:, np.newaxis]
    across = np.cross(one, [0.3, -0.5, 0.8])
    across /= np.linalg.norm(across, axis=1)[:, np.newaxis]
    other = math.cos(angle) * one + math.sin(angle) * across
    assert angle_between(one, other) == pytest.approx(np.full(5, angle), rel=1e-6, abs=1e-15)


def test_following_costs_the_way_in_lengths_and_a_tenth_for_half_a_turn() -> None:
    """Each alone and both together."""
    assert cost_of(0.03, 0.0, 0.06) == pytest.approx(0.5)
    assert cost_of(0.0, math.pi, 0.06) == pytest.approx(0.1)
    assert cost_of(0.0, math.pi / 4.0, 0.06) == pytest.approx(0.025)
    assert cost_of(0.03, math.pi, 0.06) == pytest.approx(0.6)


@pytest.mark.parametrize(
    ("distance_mm", "angle_deg", "expected"), [(1.9, 9.9, True), (2.1, 9.9, False), (1.9, 10.1, False)]
)
def test_a_way_is_followed_in_place_and_in_direction(
    distance_mm: float, angle_deg: float, expected: bool
) -> None:
    """2 mm, and 10 degrees."""
    assert bool(followed(distance_mm * 1e-3, math.radians(angle_deg), 2e-3)) is expected


@pytest.mark.parametrize(
    ("distance_mm", "speed_mm_per_s", "expected"),
    [(1.9, 1.9, True), (2.1, 0.0, False), (0.0, 2.1, False), (3.9, 1.9, False)],
)
def test_a_tip_has_arrived_where_it_is_near_and_at_rest(
    distance_mm: float, speed_mm_per_s: float, expected: bool
) -> None:
    """Within the tolerance, and slower than one tolerance a second."""
    assert bool(arrived(distance_mm * 1e-3, speed_mm_per_s * 1e-3, 2e-3)) is expected


def test_to_diverge_costs_as_much_as_the_worst_episode() -> None:
    """The tip is never farther than two lengths from a target: nothing is saved by an end."""
    worst = EPISODE_STEPS * (2.0 + cost_of(0.0, 0.0, 1.0))
    assert pytest.approx(-worst) == DIVERGED_REWARD


def test_full_action_takes_a_drive_through_its_range_in_two_seconds() -> None:
    """A step is a tenth of a second and moves a level by a twentieth."""
    assert pytest.approx(2.0) == 1.0 / RATE_PER_S
    assert pytest.approx(0.05) == RATE_PER_S * CONTROL_STEP_S
