"""Claims about the cross-section that a notch leaves."""

from __future__ import annotations

import math

import numpy as np
import pytest
from notched_cases import WRIST, changed

from catheter_sim.robots.notched_tube.section import (
    closing_angle,
    fibres,
    section,
    torsion_stiffness,
)
from catheter_sim.robots.notched_tube.spec import NotchedSegment
from reference.printed_formulas import largest_strain

DEPTHS_MM = (0.2, 0.5, 0.65, 0.97, 1.05, 1.12)


def segment_of(depth_m: float, cut: str) -> NotchedSegment:
    """Return the wrist's segment with another depth and cut."""
    return changed(notch_depth_m=depth_m, cut=cut).segments[0]


@pytest.mark.parametrize("cut", ["flat", "radial"])
@pytest.mark.parametrize("depth_mm", DEPTHS_MM)
def test_integrals_are_those_of_a_grid(depth_mm: float, cut: str) -> None:
    """Area, centroid and second moments are those summed over the points of a plain grid, at any depth."""
    segment = segment_of(depth_mm * 1e-3, cut)
    outer, inner, reach = 0.58, 0.43, depth_mm - 0.58
    edge = (np.arange(1600) + 0.5) / 800 * outer - outer
    x, y = np.meshgrid(edge, edge, indexing="ij")
    radius = np.hypot(x, y)
    kept = -x > (reach if cut == "flat" else reach / outer * radius)
    kept &= (radius < outer) & (radius > inner)
    cell = (outer / 800) ** 2
    x, y = x[kept], y[kept]
    found, centroid = section(segment), -x.mean()
    assert found.area_m2 * 1e6 == pytest.approx(cell * x.size, rel=1e-2)
    assert found.centroid_m * 1e3 == pytest.approx(centroid, rel=1e-2)
    assert found.second_moment_m4 * 1e12 == pytest.approx(cell * ((x + centroid) ** 2).sum(), rel=2e-2)
    assert found.lateral_second_moment_m4 * 1e12 == pytest.approx(cell * (y**2).sum(), rel=1e-2)


@pytest.mark.parametrize("cut", ["flat", "radial"])
@pytest.mark.parametrize("depth_mm", [0.5, 0.988])
def test_points_integrate_over_the_section(depth_mm: float, cut: str) -> None:
    """The points' sums are the exact integrals, about the centroid."""
    segment = segment_of(depth_mm * 1e-3, cut)
    exact = section(segment)
    x, y, area = fibres(segment, 16, 48).T
    assert area.sum() == pytest.approx(exact.area_m2, rel=2e-4)
    assert area @ x == pytest.approx(0.0, abs=2e-4 * exact.area_m2 * segment.outer_radius_m)
    assert area @ x**2 == pytest.approx(exact.second_moment_m4, rel=1e-3)
    assert area @ y**2 == pytest.approx(exact.lateral_second_moment_m4, rel=1e-3)


@pytest.mark.parametrize("cut", ["flat", "radial"])
def test_no_depth_is_the_whole_tube(cut: str) -> None:
    """A notch of no depth leaves the tube: its ring's area and moments, bending alike any way, closed."""
    found = section(segment_of(0.0, cut))
    outer, inner = 0.58e-3, 0.43e-3
    moment = math.pi / 4.0 * (outer**4 - inner**4)
    assert found.area_m2 == pytest.approx(math.pi * (outer**2 - inner**2), rel=1e-6)
    assert found.centroid_m == pytest.approx(0.0, abs=1e-9)
    assert found.second_moment_m4 == pytest.approx(moment, rel=1e-6)
    assert found.lateral_second_moment_m4 == pytest.approx(moment, rel=1e-6)
    assert found.torsion_constant_m4 == pytest.approx(2.0 * moment, rel=1e-6)


def test_deeper_notches_are_softer_and_their_strip_is_farther_out() -> None:
    """With the depth the area and both stiffnesses fall, and the centroid moves toward the wall."""
    found = [section(segment_of(depth * 1e-3, "flat")) for depth in DEPTHS_MM]
    for name in ("area_m2", "second_moment_m4", "lateral_second_moment_m4"):
        assert np.all(np.diff([getattr(item, name) for item in found]) < 0.0), name
    assert np.all(np.diff([item.centroid_m for item in found]) > 0.0)


def test_held_ends_stiffen_torsion() -> None:
    """A notch twists no softer than by Saint-Venant's torsion alone, and a long one no stiffer."""
    short = WRIST.segments[0]
    long = changed(notch_height_m=50e-3).segments[0]
    plain = 60e9 / (2.0 * 1.33) * section(short).torsion_constant_m4
    assert torsion_stiffness(short, 60e9, 0.33) * short.notch_height_m > 1.05 * plain
    assert torsion_stiffness(long, 60e9, 0.33) * long.notch_height_m == pytest.approx(plain, rel=0.02)


def test_design_closes_at_the_published_bend() -> None:
    """Five notches as specified close at 138 deg, which the prototype of York 2015 was read to bend."""
    assert math.degrees(5 * closing_angle(segment_of(0.97e-3, "flat"))) == pytest.approx(138.2, abs=0.1)


def test_closed_notch_is_strained_as_printed() -> None:
    """At closing the outer wall's strain is (r_o - ybar) / (r_o + ybar), as the authors' script has it."""
    segment = WRIST.segments[0]
    centroid = section(segment).centroid_m
    printed = (segment.outer_radius_m - centroid) / (segment.outer_radius_m + centroid)
    assert largest_strain(segment, closing_angle(segment)) == pytest.approx(printed)
    assert 0.08 < printed < 0.11
