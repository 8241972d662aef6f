"""Claims about the anatomies: what is drawn, and the meshes of atrium and valve."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from catheter_sim.anatomy.anatomies import blocks, shell
from catheter_sim.procedure import heart
from catheter_sim.procedure.heart import (
    HOLE_RADIUS_M,
    LEAFLET_M,
    RANGES,
    WALL_M,
    Anatomy,
    annulus_rim,
    centre_m,
    coaptation_axes,
    depth_m,
    inward,
    median_anatomy,
    random_anatomy,
    semi_axes_m,
    septal_point,
    wall,
)

SEEDS = range(12)


def drawn(seed: int) -> Anatomy:
    return random_anatomy(np.random.default_rng(seed))


def punctured(anatomy: Anatomy) -> tuple[np.ndarray, np.ndarray]:
    """Return the middle of the fossa and a direction 20 deg off the septum's normal."""
    puncture = septal_point(anatomy, anatomy.fossa_y_m, anatomy.fossa_z_m)
    direction = inward(anatomy, puncture) + math.tan(math.radians(20.0)) * np.array([0.0, 1.0, 0.0])
    return puncture, direction / np.linalg.norm(direction)


def test_random_anatomies_lie_in_their_ranges_and_repeat() -> None:
    """Every number within its range, both halves of it met, the same again from the same seed."""
    many = [drawn(seed) for seed in range(40)]
    for field in fields(Anatomy):
        low, high = RANGES[field.name]
        values = np.array([getattr(item, field.name) for item in many])
        assert low <= values.min() < 0.5 * (low + high) < values.max() <= high, field.name
    assert drawn(3) == drawn(3)


@pytest.mark.parametrize("seed", SEEDS)
def test_wall_is_one_closed_shell_with_two_openings(seed: int) -> None:
    """Watertight, outward, of genus 1: a shell through which two holes lead has Euler's number 0."""
    anatomy = drawn(seed)
    mesh = shell(wall(anatomy, *punctured(anatomy)))
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0.0
    assert mesh.euler_number == 0


@pytest.mark.parametrize("seed", SEEDS)
def test_hole_lets_the_sheath_pass_and_no_more(seed: int) -> None:
    """No vertex of a septal cell nearer to the sheath's axis than the hole's radius; many at it."""
    anatomy = drawn(seed)
    puncture, direction = punctured(anatomy)
    part = wall(anatomy, puncture, direction)
    used = part.inner[sorted({index for cell in part.cells for index in cell})]
    way = used - puncture
    near = np.abs(way @ direction) < 15e-3
    distance = np.linalg.norm(np.cross(way[near], direction), axis=1)
    assert distance.min() == pytest.approx(HOLE_RADIUS_M, abs=0.05e-3)
    assert (distance < HOLE_RADIUS_M + 0.05e-3).sum() >= 4


def test_wall_ends_on_the_annulus_and_is_as_thick_as_stated() -> None:
    """The lowest ring lies on the annulus' ellipse in the plane z = 0; blocks are WALL_M thick."""
    anatomy = median_anatomy()
    part = wall(anatomy, *punctured(anatomy))
    lowest = part.inner[:36]
    assert np.abs(lowest[:, 2]).max() < 1e-9
    along, across = coaptation_axes(anatomy)
    size = np.hypot(lowest @ along / anatomy.annulus_along_m, lowest @ across / anatomy.annulus_across_m)
    assert size == pytest.approx(np.ones(36), abs=1e-9)
    for corners in blocks(part):
        half = len(corners) // 2
        assert np.linalg.norm(corners[half:] - corners[:half], axis=1) == pytest.approx(WALL_M)
    assert annulus_rim(anatomy, np.zeros(1))[0, 1] == 0.0


def test_depth_is_measured_from_the_wall_inward() -> None:
    """Zero on the wall with the inward normal's sign, a millimetre inside to 5 %; the roof at its height."""
    anatomy = drawn(5)
    place = septal_point(anatomy, 2e-3, 45e-3)
    normal = inward(anatomy, place)
    assert depth_m(anatomy, place) == pytest.approx(0.0, abs=1e-9)
    assert depth_m(anatomy, place + 1e-3 * normal) == pytest.approx(1e-3, rel=0.05)
    assert depth_m(anatomy, place - 1e-3 * normal) < 0.0
    assert centre_m(anatomy)[2] + semi_axes_m(anatomy)[2] == pytest.approx(anatomy.atrium_height_m)


@pytest.mark.parametrize("seed", SEEDS)
def test_leaflets_coapt_below_the_annulus(seed: int) -> None:
    """Margins lie against each other over the stated length at the stated depth; parts are closed."""
    anatomy = drawn(seed)
    _, across = coaptation_axes(anatomy)
    for sign in heart.SIDES.values():
        for part in heart.beside(anatomy, sign):
            assert part.is_watertight
            assert part.volume > 0.0
        first, margin = heart.scallop(anatomy, sign)
        assert first.hinge == pytest.approx(sign * anatomy.annulus_across_m * across)
        assert first.hinge + first.length_m * first.R[:, 0] == pytest.approx(margin.hinge)
        assert margin.hinge[2] == pytest.approx(-anatomy.coaptation_depth_m)
        assert sign * margin.hinge @ across == pytest.approx(0.5 * LEAFLET_M)
        end = margin.hinge + margin.length_m * margin.R[:, 0]
        assert end[2] == pytest.approx(heart.free_edge_z_m(anatomy))


def test_rod_between_the_leaflets_lowers_their_edges() -> None:
    """By nothing where it has no room to take; by what plates of fixed length turn down otherwise."""
    anatomy = replace(median_anatomy(), annulus_across_m=15.6e-3, coaptation_depth_m=8e-3)
    rest = heart.free_edge_z_m(anatomy)
    assert heart.pushed_edge_z_m(anatomy, 0.0) == pytest.approx(rest)
    # plates of 17 mm (8, 15, 17) whose ends are moved from 15 to 10.2 mm off the annulus
    expected = -13.6e-3 - anatomy.coaptation_length_m
    assert heart.pushed_edge_z_m(anatomy, 4.8e-3) == pytest.approx(expected)
