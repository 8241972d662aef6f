"""Claims about the geometry of one rolling joint and of a rod that crosses it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rolling_cases import JOINT_TABLE

from catheter_sim.catalogue import load_robot
from catheter_sim.robots.rolling import complete
from catheter_sim.robots.rolling import joint as geometry
from catheter_sim.robots.rolling.complete import frames
from catheter_sim.robots.rolling.description import rolling_chain
from reference.printed_formulas import gap_length

SECTION = rolling_chain(load_robot("chest_tube_section"))

# Table II [mm] and a rod on either side: radius of the + and - arc, offset.
CASES = [(6.7, 2.275, 3.0), (6.7, 2.275, -1.0), (2.275, 6.7, 1.0), (2.275, 6.7, -3.0), (3.5, 3.5, 2.0)]
LINK = 15.0


def mouth_of(case: tuple[float, float, float]) -> float:
    """Return the height of the upper mouth on its own arc."""
    positive, negative, offset = case
    return float(geometry.mouth_height(offset, positive if offset > 0 else negative))


def rolled(case: tuple[float, float, float], theta: float, point: tuple[float, float]) -> np.ndarray:
    """Return where pure rolling takes a point of the upper link, by turning it about the arc's centre."""
    radius = case[0] if theta > 0 else case[1]
    cosine, sine = np.cos(theta), np.sin(theta)
    centre = np.array([radius * theta, radius])
    return centre + np.array([[cosine, sine], [-sine, cosine]]) @ (np.array(point) - [0.0, radius])


def span_of(case: tuple[float, float, float], theta: float, countersink: float = 0.0) -> geometry.Span:
    """Return the rod's span of a case."""
    radius = geometry.active_radius(theta, case[0], case[1])
    return geometry.span(theta, radius, case[2], mouth_of(case) + countersink, countersink)


@pytest.mark.parametrize("theta", JOINT_TABLE)
def test_table_of_the_section(theta: float) -> None:
    """dl/dtheta, theta (1/s_l + 1/s_r) and phi of odd and even joints meet the reference to 1e-4."""
    angles = np.full(SECTION.joints, theta)
    span = complete.spans(SECTION, angles)
    turn, _ = complete.turns(SECTION, angles)
    moment, _ = complete.elastic_moments(SECTION, angles, span)
    for joint, expected in enumerate(JOINT_TABLE[theta]):
        per_stiffness = moment[joint] / SECTION.stiffness[0] * 1e-3
        ours = (span.slope[0, joint] * 1e3, per_stiffness, turn[0, joint])
        assert ours == pytest.approx(expected, abs=1e-4)


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(CASES), st.floats(-0.35, 0.35))
def test_span_runs_between_the_rolled_mouths(case: tuple[float, float, float], theta: float) -> None:
    """The span is the straight line from the hole in the flat to the hole that rolling has moved."""
    mouth = rolled(case, theta, (case[2], mouth_of(case)))
    span = span_of(case, theta)
    assert (span.across, span.along) == pytest.approx((mouth[0] - case[2], mouth[1]), abs=1e-12)
    assert span.length == pytest.approx(np.hypot(mouth[0] - case[2], mouth[1]), rel=1e-12)


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(CASES), st.floats(0.001, 0.35), st.sampled_from([-1, 1]), st.sampled_from([0.0, 1.0]))
def test_derivatives_are_those_of_the_values(
    case: tuple[float, float, float], size: float, sign: int, countersink: float
) -> None:
    """Every derivative agrees with a central difference, on both arcs, with and without countersink."""
    theta, e = sign * size, 1e-6
    here, ahead, behind = (span_of(case, angle, countersink) for angle in (theta, theta + e, theta - e))
    slope = (ahead.length - behind.length) / (2 * e)
    assert here.slope == pytest.approx(slope, rel=1e-6, abs=1e-8)
    assert here.second == pytest.approx((ahead.slope - behind.slope) / (2 * e), rel=1e-5, abs=1e-6)
    assert here.along_slope == pytest.approx((ahead.along - behind.along) / (2 * e), abs=1e-7)
    _, curvature_slope = geometry.rod_curvature(theta, here.along, here.along_slope)
    lower, upper = (
        geometry.rod_curvature(angle, at.along, at.along_slope)[0]
        for angle, at in ((theta - e, behind), (theta + e, ahead))
    )
    assert curvature_slope == pytest.approx((upper - lower) / (2 * e), rel=1e-4, abs=1e-6)

    def turn(angle: float) -> tuple[float, float]:
        radius = geometry.active_radius(angle, case[0], case[1])
        clearance = np.sign(case[2]) * 0.335
        mouth = mouth_of(case) + countersink
        return geometry.turn(angle, radius, case[2], mouth, clearance, LINK - countersink, LINK)

    assert turn(theta)[1] == pytest.approx((turn(theta + e)[0] - turn(theta - e)[0]) / (2 * e), abs=1e-7)


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(CASES), st.floats(-0.3, 0.3))
def test_gap_is_an_arc_from_mouth_to_mouth(case: tuple[float, float, float], theta: float) -> None:
    """Eqs 15, 16: a rod that leaves the flat upright and turns by theta over s rises by the gap's height."""
    span = span_of(case, theta)
    s = float(gap_length(theta, span.along))
    rise = np.trapezoid(np.cos(theta * np.linspace(0.0, 1.0, 2001)), dx=s / 2000)
    assert rise == pytest.approx(float(span.along), rel=1e-6)
    curvature, _ = geometry.rod_curvature(theta, span.along, span.along_slope)
    assert curvature * s == pytest.approx(theta, rel=1e-9, abs=1e-12)


def test_printed_gap_heights_hold_on_one_side_only() -> None:
    """Eq. 15 as printed is exact for theta > 0, Eq. 16 for theta < 0; elsewhere they miss the rolled hole."""
    case = CASES[0]
    other = (case[0], case[1], -1.0)
    alpha, beta = (float(geometry.hole_angle(*pair)) for pair in ((3.0, 6.7), (1.0, 2.275)))
    for theta in (-0.2, 0.2):
        left = 6.7 * (1.0 - np.cos(alpha - theta))
        right = 2.275 * (1.0 - np.cos(beta + theta))
        exact_left, exact_right = float(span_of(case, theta).along), float(span_of(other, theta).along)
        assert bool(np.isclose(left, exact_left)) is (theta > 0)
        assert bool(np.isclose(right, exact_right)) is (theta < 0)
    theta = 0.2
    mended = 6.7 * (1.0 - np.cos(theta)) + 2.275 * (np.cos(theta) - np.cos(beta + theta))
    assert mended == pytest.approx(float(span_of(other, theta).along))


def test_printed_hole_angle_does_not_exist() -> None:
    """Eq. 13 as printed asks for the arcsine of R/A > 1; A/R puts the mouth on the arc, A from the line."""
    with np.errstate(invalid="ignore"):
        assert np.isnan(np.arcsin(6.7 / 3.0))
    alpha = geometry.hole_angle(3.0, 6.7)
    assert 6.7 * np.sin(alpha) == pytest.approx(3.0)
    x, z = 3.0, float(geometry.mouth_height(3.0, 6.7))
    assert np.hypot(x, z - 6.7) == pytest.approx(6.7)


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(CASES), st.floats(-0.3, 0.3))
def test_turn_is_the_angle_at_the_circles_centre(case: tuple[float, float, float], theta: float) -> None:
    """Eqs 2-4: P1 and P2 as seen from the centre of the circle through P1, P2 and P3."""
    positive, negative, offset = case
    side = np.sign(offset)
    radius = positive if theta >= 0 else negative
    mouth, c = mouth_of(case), 0.335
    phi, _ = geometry.turn(theta, radius, offset, mouth, side * c, LINK, LINK)
    p1 = np.array([offset + side * c, LINK])
    p2 = np.array([offset - side * c, mouth])
    # P3 lies in the link below: taken to the upper link's frame by undoing the rolling.
    centre = np.array([radius * theta, radius])
    cosine, sine = np.cos(theta), np.sin(theta)
    below = np.array([offset + side * c, -LINK]) - centre
    p3 = np.array([[cosine, -sine], [sine, cosine]]) @ below + [0.0, radius]
    sides = 2.0 * np.array([p2 - p1, p3 - p1])
    middle = np.linalg.solve(sides, [p2 @ p2 - p1 @ p1, p3 @ p3 - p1 @ p1])
    one, two = p1 - middle, p2 - middle
    seen = np.arctan2(one[0] * two[1] - one[1] * two[0], one @ two)
    assert phi == pytest.approx(seen, abs=1e-9)


@settings(max_examples=30, deadline=None)
@given(st.sampled_from(CASES), st.floats(-0.3, 0.3))
def test_mirrored_joint_is_the_mirror_image(case: tuple[float, float, float], theta: float) -> None:
    """Swapping the sides and the sign of theta leaves lengths and gaps, and turns phi round."""
    mirrored = (case[1], case[0], -case[2])
    here, there = span_of(case, theta), span_of(mirrored, -theta)
    assert here.length == pytest.approx(there.length)
    assert here.slope == pytest.approx(-there.slope, abs=1e-12)
    turn = [
        geometry.turn(
            t, geometry.active_radius(t, c[0], c[1]), c[2], mouth_of(c), np.sign(c[2]) * 0.3, 15, 15
        )[0]
        for c, t in ((case, theta), (mirrored, -theta))
    ]
    assert turn[0] == pytest.approx(-turn[1], abs=1e-12)


def test_gap_closes_where_the_mouth_meets_the_flat() -> None:
    """The span's height is zero at the closing angle, alpha without countersink; with one it never closes."""
    for positive, negative, offset in CASES:
        case = (positive, negative, offset)
        toward = np.sign(offset)
        own = positive if offset > 0 else negative
        closing = float(geometry.closing_angle(own, toward * offset, mouth_of(case), 0.0))
        assert closing == pytest.approx(float(geometry.hole_angle(offset, own)))
        assert float(span_of(case, toward * closing).along) == pytest.approx(0.0, abs=1e-12)
        assert geometry.closing_angle(own, toward * offset, mouth_of(case) + 1.0, 1.0) == np.inf
        assert geometry.closing_angle(own, -toward * offset, mouth_of(case), 0.0) == np.inf


def test_first_joints_link_lies_where_rolling_takes_it() -> None:
    """The chain's frames: link 1's top, its tilt, its contact, both signs; joint 1's line is at x = -1 mm."""
    case, line = CASES[0], -1.0
    assert SECTION.line[:2] * 1e3 == pytest.approx([-1.0, 1.0])
    for theta in (-0.3, -0.05, 0.0, 0.1, 0.3):
        angles = np.zeros(SECTION.joints)
        angles[0] = theta
        links = frames(SECTION, angles)
        x, z = rolled(case, theta, (-line, LINK))
        assert links.face[0] * 1e3 == pytest.approx([line + x, 0.0, z], abs=1e-9)
        assert links.R_w[0, :, 2] == pytest.approx([np.sin(theta), 0.0, np.cos(theta)])
        radius = case[0] if theta >= 0 else case[1]
        assert links.contact[0] * 1e3 == pytest.approx([line + radius * theta, 0.0, 0.0], abs=1e-9)


def test_every_point_moves_about_the_contact() -> None:
    """Rolling: the derivative of every face by a joint's angle is axis x (face - contact), in two planes."""
    chain = rolling_chain(load_robot("chest_tube"))
    draw = np.random.default_rng(4)
    theta, e = draw.uniform(0.5 * chain.low, 0.5 * chain.high), 1e-7
    links = frames(chain, theta)
    for joint in range(chain.joints):
        step = np.zeros(chain.joints)
        step[joint] = e
        moved = (frames(chain, theta + step).face - frames(chain, theta - step).face) / (2 * e)
        expected = np.cross(links.axis[joint], links.face - links.contact[joint])
        expected[:joint] = 0.0
        np.testing.assert_allclose(moved, expected, atol=1e-8)
