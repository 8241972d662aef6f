"""Round solids with a curved lower face and bores: closed, on their surface, of the right volume."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from solid_points import Array, surface, winding_number

from catheter_sim.mjcf.solids import Bore, bored

RADIUS, TOP, CURVATURE = 3.0, 10.0, 0.15  # any unit of length; outlines are rounded to 1e-9 of it


def bowl(u: Array) -> Array:
    return CURVATURE * u**2


def straight(x: float, y: float, radius: float) -> Bore:
    return Bore((x, y), radius, radius, 0.0, 0.0, 16)


@pytest.mark.parametrize("axis", [0, 1])
def test_lower_face_is_the_function_and_no_facet_reaches_over_a_line(axis: int) -> None:
    """Corners lie on the function; between them a convex face is inside by its sagitta in a strip at most."""
    cuts = np.linspace(-2.8, 2.8, 8)
    solid = bored(RADIUS, 32, [straight(0.75, 1.1, 0.5)], bowl, cuts, axis, TOP)
    low = solid.vertices[solid.vertices[:, 2] < TOP]
    assert np.abs(low[:, 2] - bowl(low[:, axis])).max() < 1e-12
    facing_down = solid.face_normals[:, 2] < -0.3
    points = surface(solid.submesh([facing_down], append=True))
    above = points[:, 2] - bowl(points[:, axis])
    assert above.min() > -1e-12
    assert above.max() < CURVATURE * (0.8 / 2.0) ** 2 + 1e-12


def test_volume_is_that_of_the_section_under_the_mean_height() -> None:
    """32 corners, no bores: polygon's area times the top less the integral of the bowl over it (1 %)."""
    solid = bored(RADIUS, 32, [], bowl, np.linspace(-3.0, 3.0, 41), 0, TOP)
    integral = CURVATURE * math.pi * RADIUS**4 / 4.0
    assert solid.volume == pytest.approx(math.pi * RADIUS**2 * TOP - integral, rel=0.01)


def test_widened_bore_is_free_as_told_and_solid_beside() -> None:
    """A cone from each face down to the straight part; the wall is solid everywhere around it."""
    bore = Bore((1.2, -0.6), 0.4, 0.8, 2.0, 8.0, 16)
    solid = bored(RADIUS, 32, [bore], bowl, np.linspace(-2.5, 2.5, 11), 0, TOP)

    def ring(radius: float, z: float) -> Array:
        angle = np.linspace(0.1, 2.0 * math.pi, 9)
        x, y = bore.centre
        return np.stack([x + radius * np.cos(angle), y + radius * np.sin(angle), np.full(9, z)], axis=1)

    for z, radius in ((2.1, 0.4), (5.0, 0.4), (7.9, 0.4), (9.0, 0.6), (9.9, 0.78)):
        assert np.abs(winding_number(solid, ring(0.93 * radius, z))).max() < 1e-6
        assert winding_number(solid, ring(1.1 * radius, z)) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.slow
@example(places=[(0.0, 0.0)], cuts=[0.0, 1e-05, 3.951921410378907e-07], widened=False, axis=0)
@given(
    places=st.lists(st.tuples(st.floats(-1.8, 1.8), st.floats(-1.8, 1.8)), max_size=5),
    cuts=st.lists(st.floats(-3.5, 3.5), max_size=12),
    widened=st.booleans(),
    axis=st.sampled_from((0, 1)),
)
@settings(max_examples=100, deadline=None)
def test_any_bores_and_lines_make_a_closed_solid(
    places: list[tuple[float, float]], cuts: list[float], widened: bool, axis: int
) -> None:
    """Lines through, beside and touching bores: watertight, wound outward."""
    bores: list[Bore] = []
    for place in places:
        if all(math.dist(place, other.centre) > 0.7 for other in bores):
            bores.append(Bore(place, 0.2, 0.3 if widened else 0.2, 5.0, 8.0, 8))
    touching = [bore.centre[axis] + 0.3 for bore in bores] + [bore.centre[axis] - 0.2 for bore in bores]
    solid = bored(RADIUS, 16, bores, bowl, [*cuts, *touching], axis, TOP)
    assert solid.is_watertight
    assert solid.is_winding_consistent
    assert solid.volume > 0
