"""What is drawn at a reset: points away from rest, levels, ways, settings; on robots that are made up."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from scipy.stats import kstest

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.core.robot import Friction
from catheter_sim.envs.robots import Plant, random_level, random_levels, random_targets
from catheter_sim.envs.tip import check_randomised, drawn_settings
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


SECTION = "catheter_sim/NeuroendoscopeSectionReach-v0"
TARGET = {"target": (0.0, 0.0, 0.06)}
DRAWN = {"friction.mu": (0.1, 0.5), "effects.actuation_gain.scale": (0.9, 1.1)}


@pytest.mark.slow
def test_what_was_drawn_is_in_info() -> None:
    """The numbers of the robot that is simulated, within their bounds; other ones at each reset."""
    env = gymnasium.make(SECTION, randomised=DRAWN)
    drawn = []
    for seed in (0, None, None):
        _, info = env.reset(seed=seed, options=TARGET)
        later = env.step(np.zeros(2, np.float32))[4]
        assert info["drawn"] == later["drawn"]
        assert info["drawn"].keys() == DRAWN.keys()
        robot = env.unwrapped.plant.specified  # type: ignore[attr-defined]
        assert info["drawn"]["friction.mu"] == robot.friction.mu
        assert info["drawn"]["effects.actuation_gain.scale"] == robot.effects["actuation_gain"]["scale"]
        assert all(low <= info["drawn"][name] <= high for name, (low, high) in DRAWN.items())
        drawn.append(info["drawn"]["friction.mu"])
    assert len(set(drawn)) == 3
    assert "drawn" not in gymnasium.make(SECTION).reset(options=TARGET)[1]


@pytest.mark.slow
def test_what_was_drawn_for_each_copy_is_in_info() -> None:
    """As Gymnasium has it: an array for each key, and who has it; of an episode that ended, its own."""
    many = gymnasium.make_vec(
        SECTION,
        2,
        "vector_entry_point",
        threads=1,
        randomised=DRAWN,
        max_episode_steps=1,
        autoreset_mode="SameStep",
    )
    _, begun = many.reset(seed=4, options=TARGET)
    one, other = (
        gymnasium.make(SECTION, randomised=DRAWN).reset(seed=seed, options=TARGET)[1] for seed in (4, 5)
    )
    first = begun["drawn"]["friction.mu"]
    assert first.tolist() == [one["drawn"]["friction.mu"], other["drawn"]["friction.mu"]]
    assert begun["_drawn"].all()
    info = many.step(np.zeros((2, 2), np.float32))[4]
    assert np.array_equal(info["final_info"]["drawn"]["friction.mu"], first)
    assert not np.isin(info["drawn"]["friction.mu"], first).any()
    many.close()


@pytest.mark.parametrize("law", [("normal", 0.3, 0.1), {"low": 0.1, "high": 0.5}, lambda rng: 0.3, [0.1]])
def test_other_ways_to_draw_are_refused(law: object) -> None:
    """One line that says what there is."""
    with pytest.raises(InputError, match=r"randomised friction.mu = .*drawn evenly between them$"):
        gymnasium.make(SECTION, randomised={"friction.mu": law})


@pytest.mark.slow
def test_a_robot_is_taken_for_its_id() -> None:
    """The same numbers; settings and draws act on it too; it is checked."""
    robot = load_robot("neuroendoscope_section", {"friction.mu": 0.2})
    name = SECTION
    by_value = gymnasium.make(name, robot=robot)
    by_id = gymnasium.make(name, robot="neuroendoscope_section", settings={"friction.mu": 0.2})
    assert np.array_equal(by_value.reset(seed=1)[0], by_id.reset(seed=1)[0])
    changed = gymnasium.make(name, robot=robot, settings={"friction.mu": 0.1})
    assert changed.unwrapped.plant.specified.friction.mu == 0.1  # type: ignore[attr-defined]
    many = gymnasium.make_vec(name, 2, "vector_entry_point", threads=1, robot=robot)
    assert np.array_equal(many.reset(seed=1)[0][0], by_id.reset(seed=1)[0])
    many.close()
    with pytest.raises(InputError, match=r"neuroendoscope_section: friction.mu = -1"):
        gymnasium.make(name, robot=replace(robot, friction=Friction(-1.0)))
