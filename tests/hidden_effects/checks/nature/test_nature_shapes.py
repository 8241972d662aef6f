"""Shapes that are bent otherwise: identity, additivity, what an arc gives."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.catalogue import load_robot
from catheter_sim.core.robot import Marker
from catheter_sim.lab.engine import Shapes, bends_of, columns_of, looked_at, rebent, shortened

COUNT, LENGTH = 40, 1.5


def arc(total_rad: float) -> Shapes:
    """Return a plane arc toward +x of length 1.5, as elements' faces."""
    angles = total_rad * np.arange(1, COUNT + 1) / COUNT
    radius = LENGTH / total_rad
    p = np.stack([radius * (1 - np.cos(angles)), 0 * angles, radius * np.sin(angles)], axis=1)
    R = Rotation.from_rotvec(np.outer(angles, [0.0, 1.0, 0.0])).as_matrix()
    return Shapes(p[np.newaxis], R[np.newaxis], np.zeros((1, 0)), np.zeros((1, 1)))


def test_bends_of_an_arc_are_equal_turns():
    """Every element turns by its share, about +y."""
    np.testing.assert_allclose(bends_of(arc(0.8))[0], np.tile([0.0, 0.8 / COUNT, 0.0], (COUNT, 1)), atol=1e-9)


def test_no_change_is_no_change():
    """Stacking the same turns again gives the same shape."""
    same = rebent(arc(1.1), lambda bends: bends)
    np.testing.assert_allclose(same.p, arc(1.1).p, atol=1e-12)
    np.testing.assert_allclose(same.R, arc(1.1).R, atol=1e-12)


def test_an_arc_bent_half_as_much_more_is_the_arc_of_that_bend():
    """An element's step turns by half its further bend: the face positions are those of an arc."""
    more = rebent(arc(0.8), lambda bends: 1.5 * bends)
    np.testing.assert_allclose(more.p, arc(1.2).p, atol=2e-4 * LENGTH)
    np.testing.assert_allclose(more.R, arc(1.2).R, atol=1e-9)


def test_turned_cells_leave_the_plane_and_a_straight_robot_straight():
    """Turns about the axis twist the bending plane, but move nothing that does not bend."""
    turn = 0.02 * np.array([0.0, 0.0, 1.0])
    assert abs(rebent(arc(0.8), lambda bends: bends + turn).p[0, -1, 1]) > 0.05
    straight = arc(1e-6)
    np.testing.assert_allclose(rebent(straight, lambda bends: bends + turn).p, straight.p, atol=1e-5)


def test_shortened_shapes_are_shorter_by_their_share():
    """Along the way, and nowhere else."""
    whole = arc(0.9)
    less = shortened(whole, np.full((1, COUNT), 0.03))
    lengths = [np.linalg.norm(np.diff(shape.p[0], axis=0), axis=1) for shape in (whole, less)]
    np.testing.assert_allclose(lengths[1], 0.97 * lengths[0])


def test_a_tracker_sees_a_marker_as_it_sees_any_point():
    """A tracker with another scale takes the marker, offset and all, twice as far from its zero."""
    robot = replace(load_robot("neuroendoscope_section"), markers=(Marker("ring", 10, offset_x_m=2e-3),))
    columns = ("tip_x_mm", "marker_ring_x_mm", "marker_ring_z_mm")
    specimen: Any = SimpleNamespace(robot=robot, columns=columns)
    p = np.zeros((1, 30, 3))
    p[0, :, 2] = 1e-3 * np.arange(1, 31)
    turn = Rotation.from_rotvec([0.0, np.pi / 2, 0.0]).as_matrix()  # x points down
    shapes = Shapes(p, np.tile(turn, (1, 30, 1, 1)), np.zeros((1, 30)), np.zeros((1, 2)))
    form = SimpleNamespace(shape=None, seen=lambda acting, course, seen: replace(seen, p=2.0 * seen.p))
    tracker: Any = SimpleNamespace(form=form, acting=lambda specimen, scale: None)
    nothing: Any = None
    plain = columns_of(specimen, looked_at(specimen, nothing, [], nothing, shapes))
    np.testing.assert_allclose(plain, [[0.0, 0.0, 8.0]], atol=1e-12)
    stretched = columns_of(specimen, looked_at(specimen, nothing, [tracker], nothing, shapes))
    np.testing.assert_allclose(stretched, 2.0 * plain, atol=1e-12)
