"""Claims about a curved exposed tube, a bending joint's rest bend, and the law of the tube as a beam."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import Inputs
from catheter_sim.errors import InputError
from catheter_sim.robots.catheter import kinematics
from catheter_sim.robots.catheter.description import bending_tubes, joint_stiffness, moving
from catheter_sim.robots.catheter.kinematics import (
    chord_share,
    end_turn,
    end_twist_rad,
    inverse,
    pk,
    tool_frame,
    tool_jacobian,
)
from catheter_sim.robots.catheter.spec import CatheterRobot, CatheterSegment
from reference.catheter import element_frames, tube_end

ROBOTS = ("mitral_transseptal", "mitral_4dof")


def catheter(name: str, *settings: str) -> CatheterRobot:
    robot = load_robot(name, settings)
    assert isinstance(robot, CatheterRobot)
    return robot


def curved(name: str, x: float = 18.0, y: float = -9.0) -> CatheterRobot:
    return catheter(
        name, *(f"segments.advance.tube_curvature_{a}_per_m={k}" for a, k in (("x", x), ("y", y)))
    )


def some_values(robot: CatheterRobot) -> Array:
    """Return five random sets of joint values within the limits (seed 5), shape (5, 4)."""
    parts = [robot.segments[index] for index in moving(robot)]
    low = [-part.limit_rad for part in parts]
    high = [part.limit_rad + part.stroke_m for part in parts]
    return np.random.default_rng(5).uniform(low, high, size=(5, 4))


def bending(rest_deg: float = 0.0) -> CatheterSegment:
    segment = catheter("mitral_transseptal").segments[1]
    return replace(segment, rest_rad=math.radians(rest_deg))


def test_unloaded_tube_is_a_circle_of_its_curvature() -> None:
    """In each direction: (1 - cos k s) / k across, sin(k s) / k along; its end turned by k s; 0 at s = 0."""
    for toward in np.radians([0.0, 40.0, 200.0]):
        direction = np.array([math.cos(toward), math.sin(toward), 0.0])
        segment = next(
            part
            for part in curved("mitral_4dof", *(25.0 * direction[:2])).segments
            if part.joint == "prismatic"
        )
        for s in (0.0, 0.01, 0.06):
            place, R = tube_end(segment, s)
            across, along = (1 - math.cos(25 * s)) / 25, math.sin(25 * s) / 25
            assert place == pytest.approx(across * direction + [0, 0, along], abs=1e-12)
            end = math.sin(25 * s) * direction + [0.0, 0.0, math.cos(25 * s)]
            assert R[:, 2] == pytest.approx(end, abs=1e-12)


@pytest.mark.parametrize("name", ROBOTS)
def test_twists_and_frames_place_the_tool_alike(name: str) -> None:
    """Product of exponentials and frames in a row, two ways to one tool; straight tubes are the limit."""
    robot = curved(name)
    q = some_values(robot)
    p_w, R_w = element_frames(robot, q)
    tool = tool_frame(robot, q)
    assert tool[:, :3, 3] == pytest.approx(p_w[:, -1], abs=1e-14)
    assert tool[:, :3, :3] == pytest.approx(R_w[:, -1], abs=1e-13)
    straight = tool_frame(catheter(name), q)
    assert tool_frame(curved(name, 1e-7, 1e-7), q) == pytest.approx(straight, abs=1e-8)
    assert np.abs(tool - straight)[:, :3, 3].max() > 5e-3


@pytest.mark.parametrize("name", ROBOTS)
def test_jacobian_is_the_derivative_of_the_tool(name: str) -> None:
    """Central differences of the tip and of the tool's turn, with a curved tube, to 1e-8 m and rad."""
    robot = curved(name)
    q, step = some_values(robot), 1e-6
    jacobian = tool_jacobian(robot, q)
    for joint in range(4):
        moved = step * np.eye(4)[joint]
        there, back = tool_frame(robot, q + moved), tool_frame(robot, q - moved)
        tip = (there - back)[:, :3, 3] / (2 * step)
        turned = Rotation.from_matrix(there[:, :3, :3] @ back[:, :3, :3].swapaxes(1, 2)).as_rotvec()
        assert jacobian[:, :3, joint] == pytest.approx(tip, abs=1e-8)
        assert jacobian[:, 3:, joint] == pytest.approx(turned / (2 * step), abs=1e-8)


def test_inverse_refuses_a_curved_tube() -> None:
    """The papers' inverse takes the tube for straight: no answer rather than a wrong one."""
    robot = curved("mitral_transseptal")
    with pytest.raises(InputError, match=r"segments\.advance\.tube_curvature: .* choices: 0 per m"):
        inverse(robot, tool_frame(robot, some_values(robot)[0]))


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (0.3, 0.0), (0.2, -0.7), (-1.1, 0.9), (4e-4, 3e-4)])
def test_universal_joint_is_a_turn_across_and_a_twist(x: float, y: float) -> None:
    """Two hinges in a row = the turn vector, then the twist; the slopes are the turn's (differences)."""
    about_x, about_y = Rotation.from_rotvec([0, x, 0]), Rotation.from_rotvec([-y, 0, 0])
    (toward_x, toward_y), slopes = end_turn(x, y)
    swing = Rotation.from_rotvec([-toward_y, toward_x, 0.0])
    twist = Rotation.from_rotvec([0.0, 0.0, end_twist_rad(x, y)])
    assert (swing * twist).as_matrix() == pytest.approx((about_x * about_y).as_matrix(), abs=1e-12)
    step = 1e-6
    by_x = np.subtract(end_turn(x + step, y)[0], end_turn(x - step, y)[0]) / (2 * step)
    by_y = np.subtract(end_turn(x, y + step)[0], end_turn(x, y - step)[0]) / (2 * step)
    assert slopes == pytest.approx([by_x[0], by_y[0], by_x[1], by_y[1]], abs=1e-8)


@pytest.mark.parametrize(("alpha", "beta"), [(0.04, 0.04), (0.05, -0.02), (0.03, 0.0), (0.02, 0.06)])
def test_chord_is_shorter_by_the_slope_of_the_beams_cubic(alpha: float, beta: float) -> None:
    """Half the integral of the squared slope of the cubic with these end slopes, to its fourth power."""

    def slope(t: float) -> float:
        return -alpha * (1 - 4 * t + 3 * t * t) + beta * (3 * t * t - 2 * t)

    lost, _ = quad(lambda t: 0.5 * slope(t) ** 2, 0.0, 1.0)
    share, _, _ = chord_share(abs(alpha + beta), abs(alpha - beta))
    assert 1.0 - share == pytest.approx(lost, rel=2e-3)


def test_chord_share_of_an_arc_and_its_slopes() -> None:
    """Without skew 2 sin(b / 2) / b at any bend; the slopes are those of the share (differences)."""
    for bend in (1e-4, 0.3, 2.5):
        assert chord_share(bend, 0.0)[0] == pytest.approx(2 * math.sin(bend / 2) / bend, abs=1e-15)
        share, on_bend, on_skew = chord_share(bend, 0.4)
        step = 1e-3 * bend
        by_bend = (chord_share(bend + step, 0.4)[0] - chord_share(bend - step, 0.4)[0]) / (2 * step)
        by_skew = (chord_share(bend, 0.4 + 1e-5)[0] - chord_share(bend, 0.4 - 1e-5)[0]) / 2e-5
        assert on_bend * bend == pytest.approx(by_bend, rel=1e-5, abs=1e-9)
        assert on_skew * 0.4 == pytest.approx(by_skew, rel=1e-8)
        assert share < 1.0


def test_tube_of_finite_stiffness_stiffens_the_joints_before_it() -> None:
    """EI / length adds to the wires'; a rigid tube adds nothing; the scale multiplies the sum."""
    rigid = catheter("mitral_4dof", "stiffness_scale=1.5")
    robot = catheter("mitral_4dof", "stiffness_scale=1.5", "segments.advance.tube_stiffness_N_mm2=60")
    assert not bending_tubes(rigid)
    assert [part.name for part in bending_tubes(robot)] == ["advance"]
    for index, length in ((0, 8.52e-3), (2, 15.66e-3)):
        assert joint_stiffness(rigid, rigid.segments[index]) == pytest.approx(1.5 * 5.6e-3)
        found = joint_stiffness(robot, robot.segments[index])
        assert found == pytest.approx(1.5 * (5.6e-3 + 60e-6 / length))


@pytest.mark.parametrize("rest", [-20.0, 0.0, 12.0])
def test_displacement_from_a_rest_bend_and_back(rest: float) -> None:
    """None at rest; each tendon keeps Eq. 3 counted from straight; the angle's inverse and the arm agree."""
    segment = bending(rest)
    gaps, t, a = 2 * (segment.rings + 1), segment.half_gap_m, segment.arm_m

    def wound(angle: float) -> float:  # of the tendon on the side of positive angles
        return gaps * (t * (1 - math.cos(angle / gaps)) + a * math.sin(angle / gaps))

    home = math.radians(rest)
    assert float(kinematics.pulled_m(segment, home)) == 0.0
    for angle in np.radians([-110.0, -30.0, -5.0, 4.0, 25.0, 110.0]):
        side = 1.0 if angle > home else -1.0
        moved = float(kinematics.pulled_m(segment, angle))
        assert moved == pytest.approx(side * (wound(side * angle) - wound(side * home)), abs=1e-15)
        assert float(kinematics.angle_rad(segment, moved)) == pytest.approx(angle, abs=1e-13)
        stretched = moved + 2e-4 * (angle - home)
        assert float(kinematics.elastic_angle_rad(segment, stretched, 2e-4)) == pytest.approx(
            angle, abs=1e-12
        )
        slope = (
            kinematics.pulled_m(segment, angle + 1e-6) - kinematics.pulled_m(segment, angle - 1e-6)
        ) / 2e-6
        assert float(kinematics.arm_m(segment, angle)) == pytest.approx(float(slope), rel=1e-8)
        other = wound(-side * home) - wound(-side * angle)
        assert float(kinematics.released_m(segment, angle)) == pytest.approx(other, abs=1e-15)
    most = float(kinematics.pulled_m(segment, kinematics.largest_angle_rad(segment)))
    assert math.isnan(float(kinematics.angle_rad(segment, most * 1.01)))


def test_pure_kinematics_rests_bent_and_without_tension() -> None:
    """At zero input the joint has its rest bend and no tension; 1 mm bends it on from there."""
    robot = catheter("mitral_transseptal", "segments.bending.rest_deg=12")
    rows = np.array([(0.0, 0.0, 0.0, 0.0), (1e-3, 0.0, 0.0, 0.0)])
    zeros = np.zeros((2, 3))
    run = pk(robot, Inputs(np.arange(2.0), "displacement", rows, zeros, zeros), np.zeros(3))
    bends = [math.degrees(posture.joint_angles[1:12].sum()) for posture in run.postures]
    assert bends[0] == pytest.approx(12.0, abs=1e-10)
    assert bends[1] == pytest.approx(12.0 + 31.7, abs=0.2)
    assert run.postures[0].actuator_tension == pytest.approx(np.zeros(4), abs=1e-12)
    expected = 5.6e-3 * math.radians(bends[1] - 12.0) / 1.8e-3
    assert run.postures[1].actuator_tension[0] == pytest.approx(expected)
    assert run.residual.max() < 1e-12
