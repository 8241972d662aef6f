"""The quick model of rolling joints, against other statics, arcs and the simulated robot."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import joint_names
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.published import QuickModel
from catheter_sim.core.robot import RobotSpec
from catheter_sim.envs.robots import Plant, quick_model
from catheter_sim.errors import InputError
from catheter_sim.robots.continuum.steering import tip_jacobian
from catheter_sim.theory.static_models import STATIC_MODELS

STILL = np.zeros(3)
QUARTER = math.pi / 2.0
SECTION, PROTOTYPE, FULL = "chest_tube_section", "chest_tube_section@prototype", "chest_tube"
# The full robot's 25 joints, 15 mm apart from z = 0 on: mean distance of each segment's from the tip.
LEVERS_M = np.array([0.375 - 0.105, 0.375 - 0.240, 0.375 - 0.315])


def bends_by_virtual_work(robot: RobotSpec, tension: np.ndarray) -> np.ndarray:
    """Return the segments' bends under tensions without friction, shape (r, s, 2) [rad]."""
    rows = len(tension)
    inputs = Inputs(
        np.arange(rows, dtype=float), "tension", tension, np.zeros((rows, 3)), np.zeros((rows, 3))
    )
    run = STATIC_MODELS["virtual_work"].solve(robot, inputs, STILL)
    angles = np.array([posture.joint_angles for posture in run.postures])
    segment = np.repeat(np.arange(len(robot.segments)), [item.joints for item in robot.segments])
    bends = np.zeros((rows, len(robot.segments), 2))
    for k, name in enumerate(joint_names(robot)):
        bends[:, segment[k], "xy".index(name[0])] += angles[:, k]
    return bends


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "largest_rad"), [(SECTION, 3.0), pytest.param(FULL, QUARTER, marks=pytest.mark.slow)]
)
def test_each_range_ends_where_the_rod_alone_bends_a_segment_by_the_largest_bend(
    name: str, largest_rad: float
) -> None:
    """By virtual work, other code than the ranges come from: to 1e-6 rad; no range passes 100 N."""
    robot = load_robot(name, ["friction.mu=0"])
    drives = quick_model(load_robot(name), "tension", largest_rad).drives
    bends = bends_by_virtual_work(robot, drives.tendon.T)
    assert np.hypot(bends[..., 0], bends[..., 1]).max(axis=1) == pytest.approx(largest_rad, abs=1e-6)
    assert drives.bend == pytest.approx(np.moveaxis(bends, 0, -1), abs=1e-6)
    assert (drives.lowest == 0.0).all()
    assert drives.tension.max() < 100.0


def test_drives_of_the_chest_tube_robots_are_their_rods() -> None:
    """One drive for each rod, in the channels' order, and mirrored rods of equal arms pull alike."""
    drives = quick_model(load_robot(FULL), "tension", QUARTER).drives
    sides = [("base", "right"), ("base", "left"), ("middle", "right"), ("middle", "left")]
    sides += [("tip", "right"), ("tip", "left"), ("tip", "front"), ("tip", "back")]
    assert drives.names == tuple(f"tension_{segment}_{side}_N" for segment, side in sides)
    assert drives.tension[6] == pytest.approx(drives.tension[7], rel=1e-6)
    assert drives.bend[2, 1, 6] == pytest.approx(-drives.bend[2, 1, 7], rel=1e-6)


def test_no_range_passes_the_largest_tension() -> None:
    """Asked for more than closed gaps allow, a range ends at 100 N, and the gaps are open there."""
    model = quick_model(load_robot(SECTION), "tension", 20.0)
    assert model.drives.tension == pytest.approx([100.0], rel=1e-12)
    assert QUARTER < model.drives.bend[0, 0, 0] < math.radians(395.0)  # 395 deg closes every gap


def without_friction(name: str, *settings: str) -> Plant:
    return Plant(load_robot(name, ["friction.mu=0", *settings]), "tension", tuple(STILL), QUARTER)


def settle_at(plant: Plant, level: np.ndarray) -> np.ndarray:
    """Return where the simulated tip comes to rest, shape (3,) [m]."""
    plant.reset()
    plant.move(level, 0.5)
    plant.settle()
    return plant.posture().p_w[-1]


@pytest.mark.slow
@pytest.mark.parametrize("name", [SECTION, PROTOTYPE, FULL])
def test_quick_model_is_the_simulated_robot_without_friction(name: str) -> None:
    """Tips within 0.25 mm and bends within 0.2 deg of the simulation, soft links included."""
    plant = without_friction(name)
    rng = np.random.default_rng(3)
    levels = rng.uniform(0.0, 1.0, (3, len(plant.drives.names)))
    tips, bends = plant.quick.reach(levels, plant.rest_bends)
    for level, tip, bend in zip(levels, tips, bends, strict=True):
        assert settle_at(plant, level) == pytest.approx(tip, abs=0.25e-3)
        assert plant.segment_bends() == pytest.approx(bend, abs=math.radians(0.2))


def test_quick_model_starts_from_the_rest_that_an_effect_gives() -> None:
    """A precurved section, of which the quick model knows the rest bends only: tip within 1 mm."""
    plant = without_friction(SECTION, "effects.precurvature.curvature_x_per_m=2")
    assert plant.rest_bends[0] == pytest.approx([0.45, 0.0], rel=1e-6)  # 2 per m over 225 mm
    tip = plant.quick.reach(np.zeros((1, 1)), plant.rest_bends)[0][0]
    assert settle_at(plant, np.zeros(1)) == pytest.approx(tip, abs=1e-3)


def test_slopes_are_those_of_the_quick_models_own_tips() -> None:
    """At its own bends, inside the ranges and at both ends: the derivative of `reach`, to 0.1 %."""
    model = quick_model(load_robot(FULL), "tension", QUARTER)
    level = np.array([0.3, 0.0, 0.0, 0.4, 1.0, 0.2, 0.6, 0.0])
    none = np.zeros((3, 2))
    slopes = model.tip_slopes(level, model.reach(level[np.newaxis], none)[1][0])
    change = np.where(level > 0.5, -2e-4, 2e-4)
    tips = model.reach(np.concatenate([level[np.newaxis], level + np.diag(change)]), none)[0]
    assert slopes == pytest.approx((tips[1:] - tips[0]).T / change, abs=1e-3 * np.abs(slopes).max())


def bend_slopes(model: QuickModel, level: np.ndarray) -> np.ndarray:
    """Return how the bends change with the levels, shape (s, 2, d) [rad]."""
    change = np.where(level > 0.5, -1e-3, 1e-3)
    rows = np.concatenate([level[np.newaxis], level + np.diag(change)])
    bends = model.reach(rows, np.zeros((len(model.segment_length), 2)))[1]
    return np.moveaxis((bends[1:] - bends[0]) / change[:, np.newaxis, np.newaxis], 0, -1)


def test_slack_straight_robot_moves_its_tip_by_the_levers_of_its_joints() -> None:
    """d(tip)/d(level) is the segments' bends times their joints' mean levers, along x and y: to 1 %."""
    model = quick_model(load_robot(FULL), "tension", QUARTER)
    slopes = model.tip_slopes(np.zeros(8), np.zeros((3, 2)))
    expected = np.einsum("s,sad->ad", LEVERS_M, bend_slopes(model, np.zeros(8)))
    assert slopes[:2] == pytest.approx(expected, abs=0.01 * np.abs(expected).max())
    assert np.abs(slopes[2]).max() < 0.01 * np.abs(expected).max()


def test_slopes_turn_with_the_robot_as_it_stands() -> None:
    """Held bent by friction while its rods are slack: as arcs of these bends move, to 8 %.

    An arc's lever is that of its middle, half a link shorter than that of the joints.
    """
    model = quick_model(load_robot(FULL), "tension", QUARTER)
    for bends in ([[1.2, 0.0], [0.3, 0.0], [-0.4, 0.5]], [[-0.8, 0.0], [0.4, 0.0], [0.9, -0.7]]):
        slopes = model.tip_slopes(np.zeros(8), np.array(bends))
        jacobian = tip_jacobian(np.array(bends), model.segment_length)
        arcs = np.einsum("isa,sad->id", jacobian, bend_slopes(model, np.zeros(8)))
        assert slopes == pytest.approx(arcs, abs=0.08 * np.abs(arcs).max())


def test_only_tension_drives_a_rolling_robot() -> None:
    """Rods know no displacement; the line says what they know."""
    with pytest.raises(InputError, match=r"unknown action_type 'displacement'; choices: tension$"):
        quick_model(load_robot(SECTION), "displacement", QUARTER)


def test_a_rod_in_the_neutral_plane_is_refused() -> None:
    """Between symmetric joints, on their own line: it bends nothing, and is named."""
    robot = load_robot(
        SECTION,
        [
            *(f"segments.section.{size}_radius_mm=3.5" for size in ("larger", "smaller")),
            *(f"segments.section.{size}_arm_mm=2" for size in ("larger", "smaller")),
        ],
    )
    neutral = replace(robot, tendons=(replace(robot.tendons[0], side="+y", countersink_m=1e-3),))
    with pytest.raises(InputError, match="tension_active_N: bends no segment"):
        quick_model(neutral, "tension", QUARTER)
    with pytest.raises(InputError, match="has no tendons"):
        quick_model(replace(robot, tendons=()), "tension", QUARTER)
