"""The drives' ranges, and the steering, against arithmetic and against the simulated robot."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.robot import Friction
from catheter_sim.envs.robots import Plant, change_toward, quick_model
from catheter_sim.errors import InputError
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon
from catheter_sim.robots.continuum.steering import tip_jacobian

STILL = (0.0, 0.0, 0.0)
QUARTER = math.pi / 2.0


def three_tendons(angle_deg: float = 0.0) -> ContinuumRobot:
    """Return a frictionless robot that bends in any direction, its tendons 120 deg apart."""
    angles = [math.radians(angle_deg + 120.0 * k) for k in range(3)]
    return ContinuumRobot(
        name="three",
        description="for the tests",
        segments=(Segment("only", 0.1, 10, 4e-3, 1e-3, 0.002),),
        tendons=tuple(Tendon(f"t{k}", 3e-3, angle, "only") for k, angle in enumerate(angles)),
        friction=Friction(0.0),
    )


def shortfall_deg(cell_m: float, cells: int, bend_deg: float, arm_m: float) -> float:
    """Return by what a bend stays behind the one asked of pulled tendons [deg].

    A tendon straight between disks is shorter than one along an arc by cell (1 - cos(t/2)) in each
    cell bent by t, which leaves as much slack.
    """
    slack_m = cells * cell_m * (1.0 - math.cos(math.radians(bend_deg) / cells / 2.0))
    return math.degrees(slack_m / arm_m)


def settled_bends(plant: Plant, level: list[float]) -> np.ndarray:
    plant.reset()
    plant.move(np.array(level), 1.0)
    plant.settle()
    return np.degrees(plant.segment_bends())


def test_tension_ranges_of_the_neuroendoscope() -> None:
    """A channel's range ends where T r = K theta for a quarter turn in 30 cells of 8.6e-3 N m/rad."""
    drives = quick_model(load_robot("neuroendoscope"), "tension", QUARTER).drives
    moment = 8.6e-3 * QUARTER / 30
    distal, proximal = moment / 1.4e-3, moment / (1.4e-3 * math.cos(math.radians(35.0)))
    assert drives.names == (
        "tension_distal_right_N",
        "tension_distal_left_N",
        "tension_proximal_right_N",
        "tension_proximal_left_N",
    )
    assert drives.tendon.sum(axis=0) == pytest.approx([distal, distal, proximal, proximal])
    assert drives.tension == pytest.approx([distal] * 2 + [proximal / 2] * 4)
    assert (drives.lowest == 0.0).all()


def test_full_tension_bends_a_frictionless_section_by_a_quarter_turn_and_a_little() -> None:
    """Level 1 is a quarter turn by the eyelets' distance; a straight tendon's longer arm adds 2 to 3 %."""
    plant = Plant(load_robot("neuroendoscope_section", ["friction.mu=0"]), "tension", STILL, QUARTER)
    bend = settled_bends(plant, [1.0, 0.0])[0, 0]
    # K t = T (d cos(t/2) + a sin(t/2)), a half a cell: t = t0 (1 + a/(2 d) t0 ...) in first order of t0
    angle = math.radians(90.0) / 30
    for _ in range(20):
        arm = 1.4e-3 * math.cos(angle / 2) + 1e-3 * math.sin(angle / 2)
        angle = math.radians(90.0) / 30 * arm / 1.4e-3
    assert bend == pytest.approx(math.degrees(30 * angle), abs=0.01)
    assert 1.01 < bend / 90.0 < 1.03


@pytest.mark.slow
def test_full_pull_bends_a_frictionless_section_by_a_quarter_turn() -> None:
    """Level 1 of a bend is a quarter turn, but for the slack of tendons straight between eyelets."""
    plant = Plant(load_robot("neuroendoscope_section", ["friction.mu=0"]), "displacement", STILL, QUARTER)
    missing = 90.0 - settled_bends(plant, [1.0])[0, 0]
    assert missing == pytest.approx(shortfall_deg(2e-3, 30, 90.0, 1.4e-3), abs=0.1)


@pytest.mark.slow
def test_displacement_drives_bend_each_segment_by_itself() -> None:
    """Asked for +45 and -30 deg, the two frictionless sections bend so; no tendon is torn at."""
    plant = Plant(load_robot("neuroendoscope", ["friction.mu=0"]), "displacement", STILL, QUARTER)
    assert plant.drives.names == ("bend_proximal_x", "bend_distal_x")
    bend = settled_bends(plant, [0.5, -1.0 / 3.0])
    least_arm = 1.4e-3 * math.cos(math.radians(35.0))
    slack = shortfall_deg(2e-3, 30, 45.0, least_arm) + shortfall_deg(2e-3, 30, 30.0, least_arm)
    assert bend[:, 0] == pytest.approx([45.0, -30.0], abs=2.0 * slack)
    needed = 8.6e-3 * math.radians(45.0 + 30.0) / 30 / 1.4e-3
    assert plant.posture().actuator_tension.max() < 1.5 * needed


@pytest.mark.parametrize("angle_deg", [0.0, 50.0])
def test_displacement_drives_bend_in_the_asked_direction_whatever_the_tendons_angles(
    angle_deg: float,
) -> None:
    """Three tendons 120 deg apart bend the robot toward +x, or +y, when asked to."""
    plant = Plant(three_tendons(angle_deg), "displacement", STILL, QUARTER)
    assert plant.drives.names == ("bend_only_x", "bend_only_y")
    slack = 2.0 * shortfall_deg(10e-3, 10, 36.0, 3e-3)  # in whatever direction slack tendons leave it
    assert settled_bends(plant, [0.4, 0.0])[0] == pytest.approx([36.0, 0.0], abs=slack)
    assert settled_bends(plant, [0.0, 0.4])[0] == pytest.approx([0.0, 36.0], abs=slack)


def test_tendons_that_end_together_bend_their_segments_together() -> None:
    """With tendons at the tip only, one drive bends both sections, in proportion to their lengths."""
    robot = load_robot("neuroendoscope")
    distal_only = replace(robot, tendons=robot.tendons[:2])
    drives = quick_model(distal_only, "displacement", QUARTER).drives
    assert drives.names == ("bend_distal_x",)
    assert drives.bend[:, 0, 0] == pytest.approx([QUARTER, QUARTER])
    assert drives.tendon[:, 0] == pytest.approx([1.4e-3 * math.pi, -1.4e-3 * math.pi])


def test_a_tendon_in_the_neutral_plane_is_refused() -> None:
    """A tendon that bends nothing cannot drive the robot, and the message names it."""
    robot = load_robot("neuroendoscope_section")
    neutral = replace(robot, tendons=(replace(robot.tendons[0], angle_rad=QUARTER), robot.tendons[1]))
    with pytest.raises(InputError, match="tension_right_N: bends no segment"):
        quick_model(neutral, "tension", QUARTER)
    with pytest.raises(InputError, match="action_type 'force'; choices: tension, displacement"):
        quick_model(robot, "force", QUARTER)


def test_straight_robot_moves_its_tip_by_the_lever_to_each_segments_middle() -> None:
    """d(tip x)/d(bend) of a straight robot is the distance from the segment's middle to the tip."""
    jacobian = tip_jacobian(np.zeros((2, 2)), np.array([0.06, 0.04]))
    expected = np.zeros((3, 2, 2))
    expected[0, :, 0] = expected[1, :, 1] = [0.03 + 0.04, 0.02]
    assert jacobian == pytest.approx(expected, abs=1e-9)


def test_steering_stays_in_its_bounds_and_rests_at_the_target() -> None:
    """No way to go, no change; else the tip comes nearer, and no drive leaves its room."""
    model = quick_model(load_robot("neuroendoscope"), "tension", QUARTER)
    bend, level = np.array([[0.5, 0.0], [-0.3, 0.0]]), np.full(4, 0.5)
    slopes = model.tip_slopes(level, bend)
    room = np.array([-0.02, 0.0, -0.05, 0.0]), np.array([0.03, 0.05, 0.0, 0.05])
    still = change_toward(np.zeros(3), slopes, 0.12, *room)
    assert still == pytest.approx(np.zeros(4), abs=1e-12)
    rng = np.random.default_rng(1)
    for _ in range(20):
        way = rng.normal(size=3) * [0.01, 0.0, 0.01]
        change = change_toward(way, slopes, 0.12, *room)
        assert (change >= room[0]).all()
        assert (change <= room[1]).all()
        tips, _ = model.reach(np.array([np.zeros(4), change]), bend)
        moved = tips[1] - tips[0]
        assert np.linalg.norm(way - moved) <= np.linalg.norm(way) + 1e-9
