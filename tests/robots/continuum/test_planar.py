import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from catheter_sim.robots.continuum.planar import (
    arc_chain,
    headings,
    hinge_chain,
    hinge_moment_slopes,
    hinge_moments,
    hinge_points,
)

LENGTHS = np.array([2e-3, 3e-3, 2.5e-3, 2e-3])
angles_of_four = st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4).map(np.array)


@pytest.mark.parametrize("chain", [hinge_chain, arc_chain])
def test_a_straight_chain_stands_along_z(chain):
    """Without bending the faces lie on the z axis at the cells' summed lengths, unturned."""
    p_w, R_w = chain(np.zeros(4), LENGTHS)
    np.testing.assert_allclose(p_w[:, 2], np.cumsum(LENGTHS), rtol=1e-15)
    assert not p_w[:, :2].any()
    np.testing.assert_array_equal(R_w, np.broadcast_to(np.eye(3), (4, 3, 3)))


def test_one_cell_bends_toward_plus_x_at_its_middle():
    """A cell of 2 mm bent by 90 deg at its hinge has its face at (1, 0, 1) mm, looking along +x."""
    p_w, R_w = hinge_chain(np.array([math.pi / 2]), np.array([2e-3]))
    np.testing.assert_allclose(p_w[0], [1e-3, 0.0, 1e-3], atol=1e-18)
    np.testing.assert_allclose(R_w[0] @ [0, 0, 1], [1, 0, 0], atol=1e-15)


def test_equal_arcs_join_to_one_circle():
    """Arc cells of one curvature all lie on one circle, whatever the number of cells."""
    total, length = 1.9, 60e-3
    for count in (1, 7, 30):
        p_w, _ = arc_chain(np.full(count, total / count), np.full(count, length / count))
        radius = length / total
        np.testing.assert_allclose(p_w[-1, 0], radius * (1 - math.cos(total)), rtol=1e-13)
        np.testing.assert_allclose(p_w[-1, 2], radius * math.sin(total), rtol=1e-13)


def test_small_arcs_have_no_jump():
    """The chord's series meets its closed form where one takes over from the other."""
    below, _ = arc_chain(np.array([1.9999e-4]), np.array([1.0]))
    above, _ = arc_chain(np.array([2.0001e-4]), np.array([1.0]))
    assert abs(above[0, 2] - below[0, 2]) < 1e-11


@given(angles_of_four)
def test_hinge_and_arc_cells_differ_by_their_chord_alone(angles):
    """Both cells end in the same direction; a hinged cell spans cos(t/2), an arc sin(t/2)/(t/2)."""
    hinged, R_hinged = hinge_chain(angles, LENGTHS)
    arcs, R_arcs = arc_chain(angles, LENGTHS)
    np.testing.assert_array_equal(R_hinged, R_arcs)
    spans = np.linalg.norm(np.diff(hinged, axis=0, prepend=0.0), axis=1)
    np.testing.assert_allclose(spans, LENGTHS * np.cos(angles / 2), rtol=1e-12)
    spans = np.linalg.norm(np.diff(arcs, axis=0, prepend=0.0), axis=1)
    np.testing.assert_allclose(spans, LENGTHS * np.sinc(angles / 2 / np.pi), rtol=1e-12)


def test_many_chains_at_once_are_the_chains_one_by_one():
    """A leading axis changes nothing."""
    angles = np.random.default_rng(5).uniform(-0.4, 0.4, (3, 2, 4))
    for chain in (hinge_chain, arc_chain):
        p_w, R_w = chain(angles, LENGTHS)
        one_p, one_R = chain(angles[2, 1], LENGTHS)
        np.testing.assert_array_equal(p_w[2, 1], one_p)
        np.testing.assert_array_equal(R_w[2, 1], one_R)


@given(angles_of_four)
def test_hinges_lie_halfway_between_faces_along_both_directions(angles):
    """A hinge is half a cell beyond the face before it, and half a cell before its own."""
    faces, _ = hinge_chain(angles, LENGTHS)
    hinges = hinge_points(angles, LENGTHS)
    before, _ = headings(angles)
    start = np.concatenate([np.zeros((1, 3)), faces[:-1]])
    along = np.stack([np.sin(before), np.zeros(4), np.cos(before)], axis=1)
    np.testing.assert_allclose(hinges, start + 0.5 * LENGTHS[:, None] * along, atol=1e-17)


def test_hinge_moments_are_cross_products():
    """The moment at a hinge is the y part of r x F, summed over the faces beyond it."""
    random = np.random.default_rng(3)
    angles, force = random.uniform(-0.5, 0.5, 4), random.normal(size=(4, 3))
    faces, _ = hinge_chain(angles, LENGTHS)
    hinges = hinge_points(angles, LENGTHS)
    expected = [sum(np.cross(faces[p] - hinges[k], force[p])[1] for p in range(k, 4)) for k in range(4)]
    np.testing.assert_allclose(hinge_moments(hinges, faces, force), expected, rtol=1e-12)


def test_hinge_moment_slopes_are_the_derivative():
    """The slopes agree with central differences of the moments."""
    random = np.random.default_rng(4)
    angles, force = random.uniform(-0.5, 0.5, 4), random.normal(size=(4, 3))

    def moments(at):
        return hinge_moments(hinge_points(at, LENGTHS), hinge_chain(at, LENGTHS)[0], force)

    step = 1e-6
    numeric = np.array([(moments(angles + d) - moments(angles - d)) / (2 * step) for d in step * np.eye(4)]).T
    slopes = hinge_moment_slopes(hinge_points(angles, LENGTHS), hinge_chain(angles, LENGTHS)[0], force)
    np.testing.assert_allclose(slopes, numeric, atol=1e-9 * np.abs(force).max())
