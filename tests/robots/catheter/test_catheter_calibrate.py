"""Calibration of MK from loops, plays with dead zones, and the stiffness of the robot with the tube."""

from __future__ import annotations

import math

import numpy as np
import pytest

from catheter_sim.arrays import Array
from catheter_sim.errors import InputError
from catheter_sim.robots.catheter.description import hinge_heights_m, joint_stiffness
from catheter_sim.robots.catheter.measured import (
    BENDING,
    TORSION_DISTAL,
    bending_rad,
    calibrate_bending,
    calibrate_torsion,
    identify,
    torsion_rad,
)
from catheter_sim.robots.catheter.published import mitral_transseptal, mitral_transseptal_tube

TORSION, BEND = mitral_transseptal().segments[0], mitral_transseptal().segments[1]


def there_and_back(top_m: float, times: int = 2, steps: int = 60) -> Array:
    up = np.linspace(0.0, top_m, steps + 1)
    return np.concatenate([up[:1], *times * (up[1:], up[-2::-1])])


def test_bending_calibration_recovers_the_printed_one() -> None:
    """From loops that Eq. 25 made with the printed parameters, the parameters come back."""
    way = there_and_back(6e-3)
    found = calibrate_bending(BEND, way, bending_rad(BEND, way))
    assert found.turn_m == pytest.approx(BENDING.turn_m, abs=0.1e-3)  # the rows lie 0.1 mm apart
    assert found.alpha == pytest.approx(BENDING.alpha, rel=1e-9)
    assert found.beta_mm == pytest.approx(BENDING.beta_mm, rel=1e-9)


def test_torsion_calibration_recovers_the_printed_one() -> None:
    """From noisy loops of Eq. 26 both plateaus and the dead-band come back."""
    segment = mitral_transseptal().segments[3]
    way = there_and_back(3.6e-3)
    noise = np.random.default_rng(3).normal(0.0, math.radians(0.3), len(way))
    found = calibrate_torsion(segment, way, torsion_rad(segment, way, TORSION_DISTAL) + noise)
    assert found.upper_rad == pytest.approx(TORSION_DISTAL.upper_rad, abs=math.radians(0.3))
    assert found.lower_rad == pytest.approx(TORSION_DISTAL.lower_rad, abs=math.radians(0.3))
    assert found.width_m == pytest.approx(TORSION_DISTAL.width_m, abs=0.02e-3)


@pytest.mark.parametrize("calibrate", [calibrate_bending, calibrate_torsion])
def test_loops_that_say_nothing_are_refused(calibrate) -> None:
    """A missing value, a displacement to the other side, and a joint that never moves."""
    way = there_and_back(2e-3)
    angle = way * 100.0
    with pytest.raises(InputError, match="finite"):
        calibrate(TORSION, np.where(way > 1e-3, np.nan, way), angle)
    with pytest.raises(InputError, match="0 or more"):
        calibrate(TORSION, -way, angle)
    with pytest.raises(InputError, match=r"too few|does not move"):
        calibrate(TORSION, np.zeros(20), np.zeros(20))


def test_dead_zones_tell_slack_that_plays_cannot() -> None:
    """A joint that is slack about zero, with no loop: plays alone miss it, with dead zones they do not."""
    way = np.concatenate([there_and_back(6.0, 1), there_and_back(-5.0, 1)[1:], there_and_back(4.0, 1)[1:]])
    truth = np.copysign(np.maximum(np.abs(way) - 1.2, 0.0), way)
    alone, behind = identify(way, truth), identify(way, truth, dead_zones=4)
    assert alone.rmse > 0.04 * np.ptp(truth)
    assert behind.rmse < 1e-9
    assert behind(way) == pytest.approx(truth, abs=1e-8)


def test_dead_zones_keep_what_plays_can() -> None:
    """Where plays made the data, dead zones besides change nothing."""
    way = there_and_back(5.0, 3)
    plain = identify(way, way + np.sin(way))
    truth = plain(way)
    assert identify(way, truth, dead_zones=3)(way) == pytest.approx(truth, abs=1e-6)


def test_tube_robot_meets_the_two_published_figures() -> None:
    """Virtual work over the gaps at 90 deg gives 1.814 mm/N and MK's second slope back.

    The tip, pushed across its axis, bends each gap against its stiffness and against the tendon that
    runs through all of them.
    """
    robot = mitral_transseptal_tube()
    segment, pair = robot.segments[1], robot.tendons[0]
    joint, tendon = joint_stiffness(robot, segment), pair.stiffness_N_per_m
    slope = segment.arm_m + joint / (segment.arm_m * tendon)  # m/rad
    assert math.radians(slope * 1e3) == pytest.approx(BENDING.alpha[1] * segment.arm_m * 1e3, rel=1e-9)
    heights = hinge_heights_m(segment)
    gaps, bend = len(heights), math.pi / 2.0
    way = np.diff(np.concatenate([[0.0], heights, [segment.length_m]]))
    direction = bend / gaps * np.arange(gaps + 1)
    ends = np.cumsum(way[:, None] * np.stack([np.sin(direction), np.cos(direction)], axis=1), axis=0)
    tip = ends[-1] + sum(item.length_m for item in robot.segments[2:]) * np.array(
        [math.sin(bend), math.cos(bend)]
    )
    reach = tip - ends[:-1]
    push = np.array([-math.cos(bend), math.sin(bend)])
    lever = -(reach[:, 1] * push[0] - reach[:, 0] * push[1])
    arm = segment.arm_m * math.cos(0.5 * bend / gaps) + segment.half_gap_m * math.sin(0.5 * bend / gaps)
    stiffness = joint * gaps * np.eye(gaps) + tendon * arm**2
    turns = np.linalg.solve(stiffness, lever)
    assert 1e3 * float(lever @ turns) / (tendon * arm * turns.sum()) == pytest.approx(1.814, rel=1e-3)
