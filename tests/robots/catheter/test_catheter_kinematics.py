"""Kinematics of the mitral catheters: product of exponentials, closed forms, elements, Jacobian."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

from catheter_sim.catalogue import robots_of
from catheter_sim.robots.catheter import kinematics
from catheter_sim.robots.catheter.description import elements, hinge_counts, moving
from catheter_sim.robots.catheter.kinematics import (
    chord_change,
    screw_chain,
    tool_frame,
    tool_jacobian,
)
from catheter_sim.robots.catheter.spec import CatheterRobot, CatheterSegment
from reference.catheter import element_frames, four_dof_tool_as_printed

ROBOTS = {
    name: make() for name, make in robots_of("catheter").items() if "@" not in name
}  # one of each design


def poses(robot: CatheterRobot, count: int, seed: int = 11) -> np.ndarray:
    """Return joint values drawn evenly within the limits, shape (count, m)."""
    draw = np.random.default_rng(seed)
    parts = [robot.segments[index] for index in moving(robot)]
    low = [0.0 if part.joint == "prismatic" else -part.limit_rad for part in parts]
    high = [part.stroke_m if part.joint == "prismatic" else part.limit_rad for part in parts]
    return draw.uniform(low, high, (count, len(parts)))


def matrix_of(twist: np.ndarray) -> np.ndarray:
    """Return the 4 x 4 matrix of a twist (v, w)."""
    (x, y, z), matrix = twist[3:], np.zeros((4, 4))
    matrix[:3, :3] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    matrix[:3, 3] = twist[:3]
    return matrix


def by_matrix_exponential(robot: CatheterRobot, q: np.ndarray) -> np.ndarray:
    """Return the tool frame from general matrix exponentials; joint parameters written out anew."""
    result, z = np.eye(4), 0.0
    values = iter(q)
    for segment in robot.segments:
        about = [0, 1, 0] if segment.bends_toward == "x" else [-1, 0, 0]
        if segment.joint == "torsion":
            result = result @ expm(matrix_of(np.array([0, 0, 0, 0, 0, 1.0])) * next(values))
        elif segment.joint == "prismatic":
            result = result @ expm(matrix_of(np.array([0, 0, 1.0, 0, 0, 0])) * next(values))
        elif segment.joint == "bending":
            bend, length = next(values), segment.length_m
            chord = 2.0 * length / bend * math.sin(bend / 2.0)
            for part, height in ((bend / 2.0, z), (None, 0.0), (bend / 2.0, z + length)):
                twist = np.array([0, 0, 1.0, 0, 0, 0])
                if part is not None:
                    twist = np.concatenate([-np.cross(about, [0, 0, height]), about])
                result = result @ expm(matrix_of(twist) * (chord - length if part is None else part))
        z += segment.length_m
    home = np.eye(4)
    home[2, 3] = z
    return result @ home


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_product_of_exponentials_is_the_matrix_exponential(name: str) -> None:
    """The tool frame agrees with general matrix exponentials to 1e-12 (m and unitless)."""
    robot = ROBOTS[name]
    q = poses(robot, 100)
    expected = [by_matrix_exponential(robot, row) for row in q]
    np.testing.assert_allclose(tool_frame(robot, q), expected, atol=1e-12, rtol=0.0)


def test_transseptal_closed_form_is_the_product_of_exponentials() -> None:
    """Nayar 2022, Eqs 14-15, turned into the base frame, are Eq. 12, straight poses included."""
    robot = ROBOTS["mitral_transseptal"]
    q = poses(robot, 200)
    q[:5, 1] = [0.0, 1e-9, -1e-5, 1e-3, 2e-3]
    position, R = kinematics.in_base_frame(*kinematics.transseptal_tool(robot, q))
    tool = tool_frame(robot, q)
    np.testing.assert_allclose(position, tool[:, :3, 3], atol=1e-14)
    np.testing.assert_allclose(R, tool[:, :3, :3], atol=1e-14)


def test_corrected_four_dof_closed_form_is_the_product_of_exponentials() -> None:
    """Nayar 2023, Eqs 6-7 with the two corrections, turned into the base frame."""
    robot = ROBOTS["mitral_4dof"]
    q = poses(robot, 200)
    q[:3, 0] = q[2:5, 1] = 0.0
    position, R = kinematics.in_base_frame(*kinematics.four_dof_tool(robot, q))
    tool = tool_frame(robot, q)
    np.testing.assert_allclose(position, tool[:, :3, 3], atol=1e-14)
    np.testing.assert_allclose(R, tool[:, :3, :3], atol=1e-14)


def test_printed_four_dof_closed_form_cannot_be_right() -> None:
    """As printed, R of Nayar 2023 Eq. 6 is no rotation, and p_y of Eq. 7 diverges at zero bending."""
    robot = ROBOTS["mitral_4dof"]
    q = np.array([0.8, 0.9, 0.01, 0.4])
    _, R = four_dof_tool_as_printed(robot, q)
    assert np.abs(R @ R.T - np.eye(3)).max() > 0.1
    bent = np.array([[0.01, 0.9, 0.0, 0.0], [1e-3, 0.9, 0.0, 0.0]])
    near = four_dof_tool_as_printed(robot, bent)[0][:, 1]
    assert near[1] == pytest.approx(10.0 * near[0], rel=0.05)  # grows as 1 / theta_pb
    assert abs(kinematics.four_dof_tool(robot, bent[1])[0][1]) < 1e-4
    # advancing moves the tip along the tool's axis; as printed it moves the other way in y
    ahead, _ = four_dof_tool_as_printed(robot, q + np.array([0.0, 0.0, 1e-3, 0.0]))
    moved = ahead - four_dof_tool_as_printed(robot, q)[0]
    np.testing.assert_allclose(moved * [1.0, -1.0, 1.0], 1e-3 * R[:, 2], atol=1e-15)


@pytest.mark.parametrize(
    ("name", "joint", "axis"),
    [("mitral_transseptal", 1, 0), ("mitral_4dof", 0, 0), ("mitral_4dof", 1, 1)],
)
def test_positive_bends_go_where_promised(name: str, joint: int, axis: int) -> None:
    """The first bending joint bends toward +x, the distal one of the 4-DoF robot toward +y."""
    q = np.zeros(4)
    q[joint] = 0.5
    place = tool_frame(ROBOTS[name], q)[:3, 3]
    assert place[axis] > 5e-3
    assert place[1 - axis] == pytest.approx(0.0, abs=1e-15)
    assert place[2] > 0.0


@pytest.mark.parametrize("name", ROBOTS)
def test_torsion_is_counter_clockwise(name: str) -> None:
    """Positive torsion turns the tool about +z, counter-clockwise seen from the tip."""
    robot = ROBOTS[name]
    for number, index in enumerate(moving(robot)):
        if robot.segments[index].joint == "torsion":
            q = np.zeros(4)
            q[number] = 0.3
            np.testing.assert_allclose(
                tool_frame(robot, q)[:3, 0], [math.cos(0.3), math.sin(0.3), 0.0], atol=1e-15
            )


@pytest.mark.parametrize("name", ROBOTS)
def test_last_element_is_the_tool(name: str) -> None:
    """The tip is the distal face of the last element, by two ways of computing it."""
    robot = ROBOTS[name]
    q = poses(robot, 50)
    p_w, R_w = element_frames(robot, q)
    tool = tool_frame(robot, q)
    assert p_w.shape == (50, len(elements(robot)), 3)
    np.testing.assert_allclose(p_w[:, -1], tool[:, :3, 3], atol=1e-14)
    np.testing.assert_allclose(R_w[:, -1], tool[:, :3, :3], atol=1e-13)


def test_straight_faces_stand_where_the_parts_end() -> None:
    """At rest: 15 mm torsion top, rings of 2.04 mm with gaps of 1.04 mm, 6 mm module, 4.5 mm holder."""
    p_w, _ = element_frames(ROBOTS["mitral_transseptal"], np.zeros(4))
    rings = 15.0 + 3.08 * np.arange(1, 11)
    np.testing.assert_allclose(p_w[:, 2] * 1e3, [15.0, *rings, 52.84, 57.34], atol=1e-12)
    np.testing.assert_allclose(p_w[:, :2], 0.0, atol=1e-15)


def test_rings_lie_on_one_arc() -> None:
    """Bent, the rings' centres keep the distance of the arc's centre from it, length over bend."""
    robot = ROBOTS["mitral_transseptal"]
    p_w, R_w = element_frames(robot, np.array([0.0, 1.9, 0.02, 0.0]))
    radius = robot.segments[1].length_m / 1.9
    centre = np.array([radius, 0.0, 15e-3])
    np.testing.assert_allclose(np.linalg.norm(p_w[1:11] - centre, axis=1), radius, rtol=1e-12)
    outward = (p_w[1:11] - centre) / radius
    np.testing.assert_allclose((outward * R_w[1:11, :, 2]).sum(axis=1), 0.0, atol=1e-12)


def chain_misses_arc_mm(segment: CatheterSegment, links_m: np.ndarray) -> float:
    """Return how far a chain of rigid links, bent alike at its hinges to the limit, ends from the arc."""
    bend = segment.limit_rad
    turned = bend * np.arange(len(links_m)) / (len(links_m) - 1)
    end = np.array([(links_m * np.sin(turned)).sum(), (links_m * np.cos(turned)).sum()])
    arc = segment.length_m / bend * np.array([1.0 - math.cos(bend), math.sin(bend)])
    return 1e3 * float(np.linalg.norm(end - arc))


def test_hinged_rings_miss_the_arc() -> None:
    """A chain of rings with a hinge in each gap is no arc: it ends 0.58 mm from it at 120 deg (10 rings).

    Its end links are half a gap, not half a pitch. As many hinges in the middle of equal links end
    within 0.1 mm: how near a simulation comes to the closed form depends on where it puts the hinges.
    """
    misses = {}
    for robot in ROBOTS.values():
        for segment in robot.segments:
            if segment.joint == "bending":
                half, count = segment.half_gap_m, segment.rings
                rings = np.array([half, *[(segment.length_m - 2.0 * half) / count] * count, half])
                equal = np.array([0.5, *[1.0] * count, 0.5]) * segment.length_m / (count + 1)
                misses[segment.name] = [chain_misses_arc_mm(segment, links) for links in (rings, equal)]
    assert misses["bending"][0] == pytest.approx(0.58, abs=0.01)
    assert max(misses[name][0] for name in ("bending_proximal", "bending_distal")) < 0.25
    assert max(equal for _, equal in misses.values()) < 0.1


@pytest.mark.parametrize("name", ROBOTS)
def test_jacobian_is_the_derivative(name: str) -> None:
    """Tip velocity and tool turn agree with central differences of the tool frame."""
    robot = ROBOTS[name]
    q = poses(robot, 20)
    q[0, :] = 0.0
    jacobian = tool_jacobian(robot, q)
    step = 1e-6
    for joint in range(q.shape[1]):
        shift = step * np.eye(q.shape[1])[joint]
        ahead, behind, here = (tool_frame(robot, q + sign * shift) for sign in (1.0, -1.0, 0.0))
        rate = (ahead - behind) / (2.0 * step)
        np.testing.assert_allclose(jacobian[:, :3, joint], rate[:, :3, 3], atol=1e-9)
        spin = rate[:, :3, :3] @ np.swapaxes(here[:, :3, :3], 1, 2)
        found = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
        np.testing.assert_allclose(jacobian[:, 3:, joint], found, atol=1e-9)


def test_chord_change_has_no_seam() -> None:
    """Chord less length (Nayar 2022, Eq. 20) is smooth where the series takes over, and never above 0."""
    bends = np.array([0.0, 1e-9, 1.9999e-3, 2.0001e-3, 1.0, 2.0])
    change, slope = chord_change(bends, np.array(30e-3))
    exact = 30e-3 * np.array([0.0, *(2.0 / b * math.sin(b / 2.0) - 1.0 for b in bends[1:])])
    np.testing.assert_allclose(change, exact, atol=1e-16)
    assert (change <= 0.0).all()
    ahead, behind = (chord_change(bends + step, np.array(30e-3))[0] for step in (1e-5, -1e-5))
    np.testing.assert_allclose(slope, (ahead - behind) / 2e-5, atol=1e-10)


def test_twists_are_those_printed() -> None:
    """Nayar 2022, Eq. 11, turned into the base frame: x of the paper is +y here."""
    chain = screw_chain(ROBOTS["mitral_transseptal"])
    pt, bl = 15e-3, 31.84e-3
    paper = np.array(
        [
            [0, 0, 0, 0, 0, 1],
            [0, pt, 0, 1, 0, 0],
            [0, 0, 1, 0, 0, 0],
            [0, pt + bl, 0, 1, 0, 0],
            [0, 0, 1, 0, 0, 0],
            [0, 0, 0, 0, 0, 1],
        ]
    )
    turn = np.kron(np.eye(2), kinematics.R_BASE_PAPER)
    np.testing.assert_allclose(chain.twists, paper @ turn.T, atol=1e-15)
    assert sum(hinge_counts(ROBOTS["mitral_transseptal"])) == 13
