"""Inverse kinematics of the mitral catheters: back to the joints, branches, limits, the straight pose."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from catheter_sim.catalogue import robots_of
from catheter_sim.errors import InputError
from catheter_sim.robots.catheter.description import moving
from catheter_sim.robots.catheter.kinematics import inverse, tool_frame, within_limits
from catheter_sim.robots.catheter.spec import CatheterRobot

ROBOTS = {
    name: make() for name, make in robots_of("catheter").items() if "@" not in name
}  # one of each design


def poses(robot: CatheterRobot, count: int, seed: int) -> np.ndarray:
    """Return joint values drawn evenly within the limits, shape (count, m)."""
    draw = np.random.default_rng(seed)
    parts = [robot.segments[index] for index in moving(robot)]
    low = [0.0 if part.joint == "prismatic" else -part.limit_rad for part in parts]
    high = [part.stroke_m if part.joint == "prismatic" else part.limit_rad for part in parts]
    return draw.uniform(low, high, (count, len(parts)))


def comes_back(robot: CatheterRobot, count: int, seed: int) -> None:
    """Assert that the inverse of the forward kinematics is unique and exact, away from straight."""
    q = poses(robot, count, seed)
    if "torsion_proximal" in [segment.name for segment in robot.segments]:
        q = q[np.abs(q[:, 1]) > math.radians(0.01)]
    for row, tool in zip(q, tool_frame(robot, q), strict=True):
        found = inverse(robot, tool)
        assert found.unique, (row, found)
        np.testing.assert_allclose(found.solutions[0], row, atol=1e-9, rtol=0.0)
        assert found.distance_m[0] < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_inverse_of_forward_is_the_pose(name: str) -> None:
    """500 random poses come back to 1e-9 (rad, m), one solution each."""
    comes_back(ROBOTS[name], 500, 5)


@pytest.mark.long
@pytest.mark.parametrize("name", ROBOTS)
def test_inverse_of_forward_is_the_pose_10000_times(name: str) -> None:
    """10,000 random poses come back to 1e-9 (rad, m), one solution each."""
    comes_back(ROBOTS[name], 10_000, 6)


def test_transseptal_branches_are_mirror_images() -> None:
    """Both branches reach the pose: the bend reversed, both torsions turned by half a turn."""
    robot = ROBOTS["mitral_transseptal"]
    q = np.array([0.4, 1.1, 0.03, -0.7])
    found = inverse(robot, tool_frame(robot, q))
    assert len(found.branches) == 2
    other = next(branch for branch in found.branches if branch[1] < 0.0)
    np.testing.assert_allclose(tool_frame(robot, other), tool_frame(robot, q), atol=1e-12)
    assert not within_limits(robot, other)


def test_four_dof_branches_reach_one_orientation() -> None:
    """Both branches have the asked orientation; only one also reaches the position."""
    robot = ROBOTS["mitral_4dof"]
    q = np.array([0.4, 1.1, 0.03, -0.7])
    tool = tool_frame(robot, q)
    first, second = inverse(robot, tool).branches
    np.testing.assert_allclose(tool_frame(robot, first), tool, atol=1e-12)
    np.testing.assert_allclose(tool_frame(robot, second)[:3, :3], tool[:3, :3], atol=1e-12)
    assert np.linalg.norm((tool_frame(robot, second) - tool)[:3, 3]) > 1e-3


@pytest.mark.parametrize("bend", [0.0, 1e-9, -1e-9])
def test_straight_pose_is_a_family(bend: float) -> None:
    """Straight, only the torsions' sum is known; every member of the family reaches the pose."""
    robot = ROBOTS["mitral_transseptal"]
    tool = tool_frame(robot, np.array([0.9, bend, 0.02, 0.7]))
    found = inverse(robot, tool)
    assert not found.unique
    assert found.family is not None
    assert found.family.sum_rad == pytest.approx(1.6, abs=1e-9)
    assert f"{math.degrees(1.6):.6g} deg" in found.message
    limit = robot.segments[0].limit_rad
    assert found.family.proximal_rad == pytest.approx((1.6 - limit, limit))
    for proximal in np.linspace(*found.family.proximal_rad, 5):
        member = np.array([proximal, 0.0, found.solutions[0][2], 1.6 - proximal])
        assert within_limits(robot, member)
        np.testing.assert_allclose(tool_frame(robot, member), tool, atol=1e-8)


def test_a_straight_pose_beyond_both_torsions_has_no_member() -> None:
    """A turn of 170 deg is more than both torsion joints together: no solution, an empty family."""
    robot = ROBOTS["mitral_transseptal"]
    turn = math.radians(170.0)
    found = inverse(robot, tool_frame(robot, np.array([turn, 0.0, 0.0, 0.0])))
    assert found.solutions == ()
    assert found.family is not None
    assert np.isnan(found.family.proximal_rad).all()


def test_straight_is_no_singularity_of_the_four_dof_robot() -> None:
    """Its straight pose comes back, where the printed Eq. 11 divides by zero."""
    robot = ROBOTS["mitral_4dof"]
    q = np.array([0.0, 0.0, 0.02, 0.3])
    found = inverse(robot, tool_frame(robot, q))
    assert found.unique
    np.testing.assert_allclose(found.solutions[0], q, atol=1e-12)


@pytest.mark.parametrize("distal", [1.0, -1.0])
@pytest.mark.parametrize("proximal", [0.0, 1.2, -1.5])
def test_position_decides_at_a_right_angle(distal: float, proximal: float) -> None:
    """At +-90 deg of distal bending the orientation has a family, the pose still has one answer."""
    robot = ROBOTS["mitral_4dof"]
    q = np.array([proximal, distal * math.pi / 2.0, 0.03, -0.5])
    found = inverse(robot, tool_frame(robot, q))
    assert found.unique
    np.testing.assert_allclose(found.solutions[0], q, atol=1e-9)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_pose_off_the_robot_is_told_by_its_distance(name: str) -> None:
    """Moved across the tool's axis by 2 mm, the pose is missed by 2 mm; along it, the advance follows."""
    robot = ROBOTS[name]
    q = np.array([0.3, 0.8, 0.02, -0.4])
    tool = tool_frame(robot, q)
    tool[:3, 3] += 2e-3 * tool[:3, 0] + 5e-3 * tool[:3, 2]
    found = inverse(robot, tool)
    assert found.distance_m[0] == pytest.approx(2e-3, abs=1e-12)
    np.testing.assert_allclose(found.solutions[0], q + np.array([0.0, 0.0, 5e-3, 0.0]), atol=1e-9)


@pytest.mark.parametrize("name", ROBOTS)
def test_beyond_the_limits_nothing_is_offered(name: str) -> None:
    """An advance above the stroke, or below zero, leaves branches but no solution."""
    robot = ROBOTS[name]
    for advance in (70e-3, -5e-3):
        found = inverse(robot, tool_frame(robot, np.array([0.3, 0.8, advance, -0.4])))
        assert found.solutions == ()
        assert not found.unique
        assert "no joint values" in found.message
        assert any(branch[2] == pytest.approx(advance) for branch in found.branches)


def test_inverse_refuses_what_it_cannot_take() -> None:
    """A reflection, or a row of joints of another design, is one line."""
    robot = ROBOTS["mitral_4dof"]
    mirrored = np.diag([1.0, 1.0, -1.0, 1.0])
    with pytest.raises(InputError, match="a rotation and a position"):
        inverse(robot, mirrored)
    with pytest.raises(InputError, match="no inverse kinematics for this row of joints"):
        inverse(replace(robot, segments=robot.segments[1:]), np.eye(4))


@pytest.mark.slow
def test_any_orientation_within_the_limits_is_reached() -> None:
    """Each random orientation that a branch has within the angles' limits is reached exactly."""
    robot = ROBOTS["mitral_transseptal"]
    for R in Rotation.random(200, random_state=np.random.default_rng(3)).as_matrix():
        tool = np.eye(4)
        tool[:3, :3], tool[:3, 3] = R, [0.01, 0.02, 0.03]
        for q in inverse(robot, tool).branches:
            np.testing.assert_allclose(tool_frame(robot, q)[:3, :3], R, atol=1e-12)
