"""Claims about the random way to a tumour: within its ranges, closed, passable, and where it says it is."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from catheter_sim.anatomy.anatomies import (
    TUMOUR_RADIUS_M,
    Ventricles,
    blocks,
    facings,
    foramen,
    median_of,
    random_of,
    ranges_of,
    ring_places,
    semi_axes,
    shell,
    tumour,
    tumour_points,
    ventricle_wall,
    way,
)

RANGES = ranges_of(Ventricles)
ROBOT_RADIUS_M = 1.7e-3  # Kato 2016
SEEDS = range(20)


@pytest.fixture(params=SEEDS)
def anatomy(request: pytest.FixtureRequest) -> Ventricles:
    return random_of(Ventricles, np.random.default_rng(request.param))


def test_draws_lie_in_their_ranges_and_differ(anatomy: Ventricles) -> None:
    """Every number has a range; the draw keeps to it; another seed gives another anatomy."""
    values = dataclasses.asdict(anatomy)
    assert values.keys() == RANGES.keys()
    assert all(low <= values[name] <= high for name, (low, high) in RANGES.items())
    assert anatomy != random_of(Ventricles, np.random.default_rng(1000))


@pytest.mark.slow
def test_wall_is_closed_and_made_of_blocks(anatomy: Ventricles) -> None:
    """The shell is watertight and its volume positive; the convex blocks fill it, to 1 %, and face inward."""
    wall = ventricle_wall(anatomy)
    mesh = shell(wall)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0.0
    hulls = [ConvexHull(corners).volume for corners in blocks(wall)]
    assert sum(hulls) == pytest.approx(mesh.volume, rel=0.01)
    middles = way(anatomy, 0.5 * (ring_places(anatomy)[1:] + ring_places(anatomy)[:-1])).p_w
    inner = np.array([corners[:4].mean(axis=0) for corners in blocks(wall)])
    toward = np.repeat(middles, len(inner) // len(middles), axis=0) - inner
    assert ((toward * facings(wall)).sum(axis=1) > 0.0).all()


def test_way_is_free_for_the_robot(anatomy: Ventricles) -> None:
    """A ball of the robot's radius goes along the way without touching the wall, through the foramen too,
    and not one of twice that radius; the foramen's canal is as wide as the anatomy says.
    """
    wall = ventricle_wall(anatomy)
    places = way(anatomy, np.linspace(1e-3, anatomy.length_m, 150)).p_w
    hull = np.concatenate([_dense(corners[:4]) for corners in blocks(wall)])
    nearest = np.array([np.linalg.norm(hull - place, axis=1).min() for place in places])
    assert nearest.min() > ROBOT_RADIUS_M
    assert nearest.min() < 2.5 * ROBOT_RADIUS_M
    narrow = [anatomy.foramen_along_m, anatomy.foramen_across_m]
    assert semi_axes(anatomy, anatomy.lateral_length_m)[0] == pytest.approx(narrow)
    assert nearest.min() == pytest.approx(min(narrow), rel=0.08)  # of the polygon with the ellipse's area


def test_way_ends_on_the_tumour_and_turns_as_it_says(anatomy: Ventricles) -> None:
    """The way's end lies on the ball's surface and points into its middle; the turn is right."""
    end = way(anatomy, anatomy.length_m)
    assert np.linalg.norm(end.p_w[0] - tumour(anatomy)) == pytest.approx(TUMOUR_RADIUS_M)
    assert end.R_w[0, 2, 2] == pytest.approx(math.cos(anatomy.turn_rad))
    assert np.linalg.det(end.R_w[0]) == pytest.approx(1.0)
    assert way(anatomy, 0.0).p_w[0] == pytest.approx(np.zeros(3))


def test_points_lie_on_the_tumour_inside_the_ventricle(anatomy: Ventricles) -> None:
    """All three on the ball, inside the third ventricle's cross-section, and each some way off the others."""
    points = tumour_points(anatomy, np.random.default_rng(0))
    assert np.linalg.norm(points - tumour(anatomy), axis=1) == pytest.approx(TUMOUR_RADIUS_M)
    end = way(anatomy, anatomy.length_m)
    flat = (points - end.p_w[0]) @ end.R_w[0, :, :2]
    inside = np.hypot(flat[:, 0] / anatomy.third_along_m, flat[:, 1] / anatomy.third_across_m)
    assert (inside < 0.75).all()
    assert (inside > 0.35).all()
    apart = np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1)
    assert apart.min() > 2e-3


def test_foramen_lies_aside_by_what_the_anatomy_says() -> None:
    """Against the arc that the sheath was aimed for, in both directions."""
    plain = dataclasses.replace(median_of(Ventricles), aside_along_m=0.0, aside_across_m=0.0, azimuth_rad=0.0)
    moved = dataclasses.replace(plain, aside_along_m=0.8e-3, aside_across_m=-0.5e-3)
    assert foramen(moved).p_w[0] - foramen(plain).p_w[0] == pytest.approx([0.8e-3, -0.5e-3, 0.0])


def _dense(corners: np.ndarray) -> np.ndarray:
    """Return points all over a quadrilateral, shape (n, 3)."""
    u, v = np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 1, 5))
    a, b, c, d = corners
    weights = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v]).reshape(4, -1).T
    return weights @ np.stack([a, b, c, d])
