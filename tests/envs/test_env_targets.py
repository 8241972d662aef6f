"""Targets: reachable by construction, and what is out of reach is said to be so."""

from __future__ import annotations

import math

import numpy as np
import pytest
from episodes import random_target

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.envs.robots import Plant
from catheter_sim.envs.tip import nearest, require_reachable, tip_at
from catheter_sim.errors import InputError
from catheter_sim.theory.static_models import STATIC_MODELS

STILL = np.zeros(3)
SEED = 5
TOLERANCE_M = 2e-3


def plant(robot: str, actuation: str = "tension") -> Plant:
    return Plant(load_robot(robot), actuation, tuple(STILL), math.pi / 2.0)


@pytest.fixture(scope="module")
def section() -> Plant:
    return plant("neuroendoscope_section")


@pytest.mark.slow
@pytest.mark.parametrize("actuation", ["tension", "displacement"])
def test_generating_inputs_bring_the_robot_back_to_the_target(actuation: str) -> None:
    """Another simulator under the inputs of ten random targets ends at the same points."""
    first, second = plant("neuroendoscope_section", actuation), plant("neuroendoscope_section", actuation)
    rng = np.random.default_rng(SEED)
    for _ in range(10):
        found = random_target(first, rng, 6e-3)
        assert np.array_equal(tip_at(second, found.level), found.tip_m)
        assert np.linalg.norm(found.tip_m - [0.0, 0.0, 0.06]) >= 6e-3


@pytest.mark.slow
def test_random_targets_are_where_theory_puts_them() -> None:
    """The exact-arm statics, its own code, holds the tip within 0.6 mm (0.5 %) of each target."""
    robot = plant("neuroendoscope")
    rng = np.random.default_rng(SEED)
    for _ in range(6):
        found = random_target(robot, rng, 12e-3)
        tension = (robot.drives.tendon @ found.level)[np.newaxis]
        inputs = Inputs(np.ones(1), "tension", tension, np.zeros((1, 3)), np.zeros((1, 3)))
        static = STATIC_MODELS["fkm_exact_arm"].solve(robot.simulator.robot, inputs, STILL)
        assert np.linalg.norm(static.postures[0].p_w[-1] - found.tip_m) < 0.6e-3, found


@pytest.mark.long
@pytest.mark.parametrize("actuation", ["tension", "displacement"])
def test_every_reachable_point_is_found_again(actuation: str) -> None:
    """The search refuses none of 30 points that the robot has been to, to 2 mm."""
    robot = plant("neuroendoscope", actuation)
    rng = np.random.default_rng(SEED)
    for _ in range(30):
        target = random_target(robot, rng, 12e-3).tip_m
        found = nearest(robot, target, TOLERANCE_M)
        assert np.linalg.norm(found.tip_m - target) <= TOLERANCE_M, (target, found)
        assert np.array_equal(tip_at(robot, found.level), found.tip_m)


@pytest.mark.slow
def test_a_single_section_reaches_its_curve_and_nothing_beside_it(section: Plant) -> None:
    """A single section's tip moves on a curve: points on it are in reach, points off it are not."""
    angle = math.radians(40.0)  # of an arc of 60 mm
    radius = 0.06 / angle
    on_arc = np.array([radius * (1.0 - math.cos(angle)), 0.0, radius * math.sin(angle)])
    assert np.array_equal(require_reachable(section, tuple(on_arc), TOLERANCE_M), on_arc)
    inside = on_arc - 8e-3 * np.array([math.sin(angle / 2), 0.0, math.cos(angle / 2)])
    with pytest.raises(InputError, match=r"out of reach .* no nearer than [4-9]\.\d mm") as caught:
        require_reachable(section, tuple(inside), TOLERANCE_M)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("target", "message"),
    [
        ((0.0, 0.0, 0.065), r"65\.0 mm from the base, it is 60 mm long"),
        ((0.01, 0.003, 0.055), "y must be 0, as it bends in the xz plane only"),
        ((0.0, 0.0, 0.03), "the tip was brought no nearer than"),
        ((0.0, 0.0), "three finite numbers are needed"),
        ((0.0, math.nan, 0.05), "three finite numbers are needed"),
        ("here", "three finite numbers are needed"),
        (None, "three finite numbers are needed"),
    ],
)
def test_points_out_of_reach_are_refused_in_one_line(section: Plant, target: object, message: str) -> None:
    """Too far, off the plane, near the base, or no point at all: one line says which."""
    with pytest.raises(InputError, match=message) as caught:
        require_reachable(section, target, TOLERANCE_M)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_a_robot_that_hardly_moves_has_no_targets_far_away() -> None:
    """Where no draw ends far enough from rest, that is said, not searched for without end."""
    robot = Plant(load_robot("neuroendoscope_section"), "tension", tuple(STILL), 1e-3)
    with pytest.raises(InputError, match="never came to 6 mm or more"):
        random_target(robot, np.random.default_rng(SEED), 6e-3)
