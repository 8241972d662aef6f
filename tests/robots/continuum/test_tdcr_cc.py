"""Closed-form arcs from tendon lengths and back, and CC against the rod of the same independent solver."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from lumped_cases import ALL_PULLS, NO_GRAVITY, benchmark, published, pulled

from catheter_sim.robots.continuum.cc import bend_per_tension, poses
from catheter_sim.robots.continuum.constant_curvature import constant_curvature
from catheter_sim.robots.continuum.rods import problem
from reference.tendon_lengths import arc_of_lengths, bends_of_lengths, tendon_lengths, three_tendon_arc

RADIUS, LENGTH = 8e-3, 0.05


def holes(count: int, first_deg: float = 0.0) -> np.ndarray:
    angle = math.radians(first_deg) + np.arange(count) * 2.0 * math.pi / count
    return RADIUS * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def walked_length(bend: np.ndarray, length: float, hole: np.ndarray, stations: int) -> float:
    """Length of the polygon through one hole of the disks at equal stations along an arc."""
    theta, plane = math.hypot(*bend), math.atan2(bend[1], bend[0])
    across = hole[0] * math.cos(plane) + hole[1] * math.sin(plane)
    angle = np.linspace(0.0, theta, stations + 1)
    reach = (length / theta - across) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return float(np.linalg.norm(np.diff(reach, axis=0), axis=1).sum())


@pytest.mark.parametrize("disks", [1, 3, 10])
def test_partially_constrained_length_is_that_of_the_polygon(disks):
    """Eq. 20: between disks a tendon is as long as the chords from hole to hole."""
    bend = np.array([0.7, -1.1])
    ours = tendon_lengths(bend[None], np.array([LENGTH]), holes(3), np.zeros(3, int), np.array([disks]))
    expected = [walked_length(bend, LENGTH, hole, disks) for hole in holes(3)]
    np.testing.assert_allclose(ours, expected, rtol=1e-14)


def test_fully_constrained_is_the_limit_of_many_disks():
    """Eq. 20 tends to Eq. 15 as 1 / n^2."""
    bend = np.array([[0.7, -1.1]])
    one = np.zeros(3, int)
    held = tendon_lengths(bend, np.array([LENGTH]), holes(3), one, math.inf)
    gaps = [
        np.abs(tendon_lengths(bend, np.array([LENGTH]), holes(3), one, np.array([n])) - held).max()
        for n in (100, 200)
    ]
    assert gaps[0] / gaps[1] == pytest.approx(4.0, rel=1e-3)


@pytest.mark.parametrize("subsegments", [1, 4, math.inf])
def test_three_tendons_give_the_arc_back(subsegments):
    """Eqs. 16-18 and 21-23 with their errata mended return curvature, plane and length of any arc."""
    for plane in np.radians([0.0, 50.0, 90.0, 170.0, -120.0]):
        theta = 1.3
        bend = theta * np.array([math.cos(plane), math.sin(plane)])
        given_lengths = tendon_lengths(
            bend[None], np.array([LENGTH]), holes(3), np.zeros(3, int), np.array([subsegments])
        )
        curvature, angle, length = three_tendon_arc(given_lengths, RADIUS, subsegments)
        assert curvature * length == pytest.approx(theta, rel=1e-12)
        assert math.remainder(float(angle) - plane, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-12)
        assert length == pytest.approx(LENGTH, rel=1e-12)


def test_errata_of_equations_21_and_23():
    """As printed, Eq. 21 gives half the length and Eq. 23 divides by the sine where the cosine belongs."""
    n, theta, plane = 4, 1.3, math.radians(50.0)
    bend = theta * np.array([[math.cos(plane), math.sin(plane)]])
    first, second, third = tendon_lengths(bend, np.array([LENGTH]), holes(3), np.zeros(3, int), np.array([n]))
    total = first + second + third
    size = math.sqrt(first**2 + second**2 + third**2 - first * second - first * third - second * third)
    printed_length = n * RADIUS * total / (2.0 * size) * math.asin(size / (3.0 * n * RADIUS))
    assert printed_length == pytest.approx(LENGTH / 2.0, rel=1e-12)
    printed_curvature = (second + third - 2.0 * first) / (total * RADIUS * math.sin(plane))
    assert printed_curvature * math.tan(plane) == pytest.approx(theta / LENGTH, rel=1e-12)


@pytest.mark.parametrize("count", [2, 3, 4, 7])
@pytest.mark.parametrize("subsegments", [2, math.inf])
def test_any_number_of_tendons_gives_the_arc_back(count, subsegments):
    """Lengths to arc inverts arc to lengths, straight included; two opposite tendons see their plane."""
    rng = np.random.default_rng(3)
    bends = rng.uniform(-1.2, 1.2, (20, 2))
    bends[0] = 0.0
    hole = holes(count, 20.0)
    if count == 2:
        bends = (bends @ hole[0])[:, None] * hole[0] / RADIUS**2
    lengths = tendon_lengths(
        bends[:, None], np.array([LENGTH]), hole, np.zeros(count, int), np.array([subsegments])
    )
    bend, length = arc_of_lengths(lengths, hole, subsegments)
    np.testing.assert_allclose(bend, bends, atol=1e-12)
    np.testing.assert_allclose(length, LENGTH, rtol=1e-12)


def test_segments_are_solved_through_their_coupling():
    """The distal segment's tendons shorten with the proximal segment's bend; both bends come back."""
    rng = np.random.default_rng(5)
    hole = np.concatenate([holes(3), holes(4, 15.0), holes(2, 70.0)])
    last = np.array([0] * 3 + [1] * 4 + [2] * 2)
    count = np.array([3.0, math.inf, 5.0])
    bends = rng.uniform(-0.9, 0.9, (10, 3, 2))
    axis = hole[-1] / RADIUS
    bends[:, 2] = (bends[:, 2] @ axis)[:, None] * axis
    length = np.array([0.04, 0.06, 0.05])
    back, lengths = bends_of_lengths(tendon_lengths(bends, length, hole, last, count), hole, last, count)
    np.testing.assert_allclose(back, bends, atol=1e-12)
    np.testing.assert_allclose(lengths, np.tile(length, (10, 1)), rtol=1e-12)


def test_closed_form_is_the_twin_without_loads():
    """Under tensions alone the closed form gives every disk of the model CC."""
    robot = benchmark(10)
    body = problem(robot)
    run = constant_curvature(robot, pulled(ALL_PULLS), NO_GRAVITY)
    for pulls, posture in zip(ALL_PULLS, run.postures, strict=True):
        p_w, R_w = poses(body, bend_per_tension(body), pulls)
        np.testing.assert_allclose(p_w[1:], posture.p_w, atol=1e-9)
        np.testing.assert_allclose(R_w[1:], posture.R_w, atol=1e-8)


def test_rows_of_the_closed_form_are_its_single_calls():
    """Rows at once are the same disks as one by one, for segments of unlike lengths, straight included."""
    robot = benchmark(4)
    first, second = robot.segments
    longer = replace(second, length_m=1.7 * second.length_m, bending_stiffness_N_m2=2e-3)
    body = problem(replace(robot, segments=(first, longer)))
    p_w, R_w = poses(body, bend_per_tension(body), ALL_PULLS)
    for pulls, p, R in zip(ALL_PULLS, p_w, R_w, strict=True):
        alone_p, alone_R = poses(body, bend_per_tension(body), pulls)
        np.testing.assert_array_equal(alone_p, p)
        np.testing.assert_array_equal(alone_R, R)
    run = constant_curvature(replace(robot, segments=(first, longer)), pulled(ALL_PULLS), NO_GRAVITY)
    np.testing.assert_allclose(p_w[:, 1:], [posture.p_w for posture in run.postures], atol=1e-9)


def test_published_arc_that_differs_from_ours_differs_from_its_own_rod():
    """Tendons 1 and 3 turn the tip by 3 r T L / EI = 90 deg (Eq. 55): so do our arcs and the published
    rod, whose bend no stretch changes; the published arc turns it by 90.034, its mirror image by 90.003.
    """
    _, _, rods = published("spacer_disk_vc_tip_poses.csv", model="VC", n="10", load_case="none")
    _, _, arcs = published("spacer_disk_cc_tip_poses.csv")
    run = constant_curvature(benchmark(10), pulled(ALL_PULLS[[5, 10]]), NO_GRAVITY)

    def turn_deg(R_w):
        return abs(math.degrees(math.atan2(R_w[1, 2], R_w[2, 2])))

    for config, posture in zip((5, 10), run.postures, strict=True):
        assert turn_deg(posture.R_w[-1]) == pytest.approx(90.0, abs=1e-5)
        assert turn_deg(rods[config]) == pytest.approx(90.0, abs=1e-5)
    assert turn_deg(arcs[5]) - 90.0 > 0.03
    assert 0.0 < turn_deg(arcs[10]) - 90.0 < 0.004
