"""Claims about a wall of cells: where its faces look, what its shell and its blocks enclose."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from catheter_sim.anatomy.anatomies import (
    Chest,
    Ventricles,
    Wall,
    blocks,
    diaphragm,
    facings,
    median_of,
    random_of,
    shell,
    ventricle_wall,
)


def cube_corner() -> Wall:
    """Return one square cell of 2 mm whose wall is 1 mm thick, the free side toward -z."""
    square = np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]) * 1e-3
    inner = np.column_stack([square, np.zeros(4)])
    return Wall(inner, inner + np.array([0.0, 0.0, 1e-3]), ((0, 1, 2, 3),))


def test_faces_look_away_from_the_wall() -> None:
    """The inner face of a wall above it looks down; those of a ventricle look into its lumen."""
    assert facings(cube_corner()) == pytest.approx(np.array([[0.0, 0.0, -1.0]]))
    for anatomy in (median_of(Ventricles), random_of(Ventricles, np.random.default_rng(4))):
        part = ventricle_wall(anatomy)
        out = [
            part.outer[list(cell)].mean(axis=0) - part.inner[list(cell)].mean(axis=0) for cell in part.cells
        ]
        found = facings(part)
        assert np.linalg.norm(found, axis=1) == pytest.approx(np.ones(len(found)))
        assert (np.einsum("ci,ci->c", found, out) < 0.0).all()


def test_shell_and_blocks_hold_the_walls_volume() -> None:
    """One cell of 2 x 2 x 1 mm: 4 mm^3, as a closed mesh with its faces outward and as a block."""
    part = cube_corner()
    mesh = shell(part)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(4e-9)
    assert ConvexHull(blocks(part)[0]).volume == pytest.approx(4e-9)


def test_diaphragm_lies_away_from_the_apex() -> None:
    """The lung's middle lies toward +x; the dome begins so far on the other side of the channel."""
    anatomy = median_of(Chest)
    assert diaphragm(anatomy)[0] + anatomy.diaphragm_radius_m == pytest.approx(-anatomy.diaphragm_away_m)


def test_ventricles_cross_section_has_its_ellipses_area() -> None:
    """Where the sheath ends, the wall's inner polygon holds pi times the ventricle's radius squared."""
    anatomy = random_of(Ventricles, np.random.default_rng(8))
    part = ventricle_wall(anatomy)
    around = 1 + max(part.cells[0][1] - part.cells[0][0], part.cells[0][-1] - part.cells[0][0] - 1)
    ring = part.inner[:around]
    middle = ring.mean(axis=0)
    after = np.roll(ring, -1, axis=0)
    area = 0.5 * np.linalg.norm(np.cross(ring - middle, after - middle).sum(axis=0))
    assert area == pytest.approx(np.pi * anatomy.lateral_radius_m**2, rel=1e-9)
