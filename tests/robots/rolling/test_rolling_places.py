"""Claims about where links roll to and how rods turn in them, by points on circles alone."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.robots.rolling.description import RollingJoint, rolling_joints
from catheter_sim.robots.rolling.laws import RodTurns
from catheter_sim.robots.rolling.spec import RollingRobot
from catheter_sim.simulation.simulator import Simulator

SHORT_LINKS = ("segments.section.joints=3", "segments.section.length_mm=45")
HOLE_M = 2e-3  # of the pulled rod, from the axis toward +x
ANGLES = pytest.mark.parametrize("theta", [(0.02, -0.015, 0.03), (0.25, 0.2, -0.1), (-0.12, 0.3, 0.22)])


def short() -> tuple[RollingRobot, Simulator]:
    robot = load_robot("chest_tube_section", SHORT_LINKS)
    assert isinstance(robot, RollingRobot)
    return robot, Simulator(robot)


def rolled(joint: RollingJoint, theta: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Return origin and turn of a link's frame (on the axis, at its joint's line) on the flat below, x and z.

    The arc's centre, at the height R over the contact, has moved by R theta; the link turns about it.
    """
    radius = joint.radius_positive_m if theta >= 0.0 else joint.radius_negative_m
    turn = np.array([[np.cos(theta), np.sin(theta)], [-np.sin(theta), np.cos(theta)]])
    centre = np.array([joint.line_m + radius * theta, radius])
    return centre + turn @ -np.array([joint.line_m, radius]), turn, radius


@pytest.mark.slow
@ANGLES
def test_links_stand_where_they_have_rolled_to(theta: tuple[float, ...]) -> None:
    """Faces of three links at angles to both sides, to a nanometre."""
    robot, simulator = short()
    simulator.data.qpos[:] = theta
    place, turned = np.zeros(2), np.eye(2)
    expected = []
    for joint, angle in zip(rolling_joints(robot), theta, strict=True):
        origin, turn, _ = rolled(joint, angle)
        place, turned = place + turned @ origin, turned @ turn
        place = place + turned @ np.array([0.0, joint.link_length_m])
        expected.append((place[0], 0.0, place[1]))
    assert simulator.posture().p_w == pytest.approx(np.array(expected), abs=1e-9)


@ANGLES
def test_rod_turns_by_the_angle_at_the_centre_of_the_circle_it_touches(theta: tuple[float, ...]) -> None:
    """chest_tube_2025, Eqs 2-4: a circle through the far ends of both holes and the upper mouth, aside by
    the clearance; the turn is seen from its centre, in the link below a gap, and none is in the base.
    """
    robot, simulator = short()
    simulator.data.qpos[:] = theta
    mujoco.mj_forward(simulator.model, simulator.data)
    clearance = robot.clearance_m
    expected = [0.0]
    for joint, angle in zip(rolling_joints(robot)[:2], theta, strict=False):
        origin, turn, _ = rolled(joint, angle)
        away = HOLE_M - joint.line_m
        own = joint.radius_positive_m  # the mouth lies on the arc of the rod's own side
        mouth = own - np.sqrt(own**2 - away**2)
        points = np.array(
            [
                origin + turn @ np.array([HOLE_M + clearance, joint.link_length_m]),
                origin + turn @ np.array([HOLE_M - clearance, mouth]),
                np.array([HOLE_M + clearance, -joint.link_length_m]),
            ]
        )
        # The centre is as far from all three points.
        centre = np.linalg.solve(
            2.0 * (points[1:] - points[0]), (points[1:] ** 2).sum(axis=1) - (points[0] ** 2).sum()
        )
        first, second = points[0] - centre, points[1] - centre
        cosine = first @ second / np.linalg.norm(first) / np.linalg.norm(second)
        expected.append(float(np.arccos(cosine)))
    found = RodTurns(robot, simulator.place)(simulator.data)[0]
    assert found == pytest.approx(expected, abs=1e-6)
    assert max(expected) > 0.01
