"""What is drawn at a reset: points away from rest, levels, ways, settings; on robots that are made up."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pytest
from scipy.stats import kstest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.posture import Array
from catheter_sim.envs.draws import random_level, random_levels, random_targets
from catheter_sim.envs.plant import Plant
from catheter_sim.envs.randomised import check_randomised, drawn_settings
from catheter_sim.errors import InputError

STEPS = 100


@pytest.fixture(scope="module")
def plant() -> Plant:
    return Plant(load_robot("neuroendoscope_section"), "tension", (0.0, 0.0, 0.0))


class Straight:
    """Robots whose tips stand aside by what their drives' levels differ by [m]."""

    native_s = 0.0

    def __init__(self, count: int) -> None:
        self.level = np.full((count, 2), np.nan)

    def reset(self, chosen: Array) -> None:
        self.level[chosen] = 0.0

    def move(self, chosen: Array, level: Array, duration_s: float) -> None:
        self.level[chosen] = level

    def settle(self, chosen: Array) -> None:
        pass

    def finite(self, chosen: Array) -> np.ndarray:
        return np.ones(len(chosen), bool)

    def tips(self, chosen: Array) -> tuple[Array, Array, Array]:
        tip = np.zeros((len(chosen), 3))
        tip[:, 0] = self.level[chosen, 0] - self.level[chosen, 1]
        return tip, np.tile(np.eye(3), (len(chosen), 1, 1)), self.level[chosen]


@pytest.mark.parametrize("clearance_m", [0.1, 0.3])
def test_targets_lie_away_from_rest(plant: Plant, clearance_m: float) -> None:
    """Each of 200 at least so far, some hardly farther; the levels that are told reach the point."""
    count = 200
    rngs = [np.random.default_rng(seed) for seed in range(count)]
    found = random_targets(plant, Straight(count), np.arange(count), rngs, clearance_m)
    away = np.array([np.linalg.norm(item.tip_m) for item in found])
    assert (away >= clearance_m).all()
    assert away.min() < clearance_m + 0.05
    for item in found:
        assert item.tip_m[0] == pytest.approx(item.level[0] - item.level[1])
    alone = random_targets(plant, Straight(1), np.arange(1), [np.random.default_rng(7)], clearance_m)
    assert np.array_equal(alone[0].level, found[7].level)  # each goes on with its own generator


def test_points_that_no_draw_reaches_are_refused(plant: Plant) -> None:
    """One line that names the robot and the distance."""
    with pytest.raises(InputError, match="never came to 1500 mm"):
        random_targets(plant, Straight(1), np.arange(1), [np.random.default_rng(0)], 1.5)


def test_half_of_the_tensions_of_a_draw_are_slack(plant: Plant) -> None:
    """The others lie evenly between slack and the largest, each tendon by itself."""
    rng = np.random.default_rng(1)
    levels = np.array([random_level(plant, rng) for _ in range(2000)])
    pulled = levels > 0.0
    assert pulled.mean(axis=0) == pytest.approx([0.5, 0.5], abs=0.05)
    assert (pulled.all(axis=1)).mean() == pytest.approx(0.25, abs=0.04)
    assert kstest(levels[pulled], "uniform").pvalue > 0.001


def test_a_way_begins_and_ends_gently(plant: Plant) -> None:
    """Rest first; no level moves by more than 0.047 a step; a way's largest step is pi / 2 times its legs'
    mean step, and its first and last steps are next to nothing (if its legs are not very short)."""
    rng = np.random.default_rng(2)
    ends = []
    for _ in range(50):
        levels = random_levels(plant, rng, STEPS)
        if levels is None:
            continue
        assert levels.shape == (STEPS + 1, 2)
        assert not levels[0].any()
        assert (levels >= 0.0).all()
        assert (levels <= 1.0).all()
        step = np.abs(np.diff(levels, axis=0)).max(axis=1)
        assert step.max() <= 0.047
        assert step.max() == pytest.approx(math.pi / 2.0 * step.mean(), rel=0.1)
        ends.append(step[[0, -1]] / step.max())
    assert len(ends) > 20
    assert np.median(ends, axis=0).max() < 0.1


def values_of(settings: Mapping[str, float] | Sequence[str]) -> dict[str, float]:
    """Return settings, a mapping or texts `KEY=VALUE`, as numbers by key."""
    pairs = settings.items() if isinstance(settings, Mapping) else (text.split("=") for text in settings)
    return {key: float(value) for key, value in pairs}


def test_settings_are_drawn_evenly_between_their_bounds() -> None:
    """By their keys, each of its own bounds; equal bounds give that value."""
    bounds = check_randomised({"friction.mu": (0.1, 0.5), "stiffness_scale": (2.0, 2.0)})
    rng = np.random.default_rng(3)
    drawn = [values_of(drawn_settings(bounds, rng)) for _ in range(1000)]
    assert kstest([(item["friction.mu"] - 0.1) / 0.4 for item in drawn], "uniform").pvalue > 0.001
    assert {item["stiffness_scale"] for item in drawn} == {2.0}
