"""Where a planar chain's cells are, from their bend angles: hinge at mid-cell, or circular arc.

A cell bends by `angle` about +y, so that a positive angle leans it toward +x. Every function takes
one chain, or many at once (leading axes), and starts at the origin along +z.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catheter_sim.arrays import Array

_SMALL_ANGLE_RAD = 1e-4  # below it the chord's series is exact to the last bit


def headings(angles: Array) -> tuple[Array, Array]:
    """Return each cell's lean before and behind its bend, shape (..., n) each [rad].

    Args:
        angles: bend angle of each cell, base to tip, shape (..., n) [rad].
    """
    behind = np.cumsum(angles, axis=-1)
    return behind - angles, behind


def hinge_faces(angles: Array, cell_length: Array, cells: Sequence[int] | slice = slice(None)) -> Array:
    """Return the centres of the distal faces of `cells`, shape (..., c, 3) [m]; see `hinge_chain`."""
    before, behind = headings(angles)
    half = 0.5 * cell_length
    x = np.cumsum(half * (np.sin(before) + np.sin(behind)), axis=-1)
    z = np.cumsum(half * (np.cos(before) + np.cos(behind)), axis=-1)
    return _in_space(x[..., cells], z[..., cells])


def hinge_chain(angles: Array, cell_length: Array) -> tuple[Array, Array]:
    """Return the cells' distal faces where each cell bends at a hinge halfway along it.

    Args:
        angles: bend angle of each cell, base to tip, shape (..., n) [rad].
        cell_length: shape (n,), or one that broadcasts to `angles` [m]; in cells of equal length h, cell
            k's hinge is at (k - 1/2) h.

    Returns:
        Centres `p_w`, shape (..., n, 3) [m], and orientations `R_w`, shape (..., n, 3, 3).
    """
    return hinge_faces(angles, cell_length), rotations(np.cumsum(angles, axis=-1))


def hinge_points(angles: Array, cell_length: Array) -> Array:
    """Return the cells' hinges, shape (..., n, 3) [m]; arguments as in `hinge_chain`."""
    faces = hinge_faces(angles, cell_length)
    _, behind = headings(angles)
    half = 0.5 * cell_length
    return faces - _in_space(half * np.sin(behind), half * np.cos(behind))


def arc_chain(angles: Array, cell_length: Array) -> tuple[Array, Array]:
    """Return the cells' distal faces where each cell bends into a circular arc (Kato 2016, A2).

    A cell of length s that bends by t spans the chord s sin(t/2) / (t/2) at half its bend angle.

    Args:
        angles: bend angle of each cell, base to tip, shape (..., n) [rad].
        cell_length: arc length of each cell, shape (n,) [m].

    Returns:
        Centres `p_w`, shape (..., n, 3) [m], and orientations `R_w`, shape (..., n, 3, 3).
    """
    before, behind = headings(angles)
    half = 0.5 * angles
    bent = np.where(np.abs(half) > _SMALL_ANGLE_RAD, half, 1.0)
    ratio = np.where(np.abs(half) > _SMALL_ANGLE_RAD, np.sin(bent) / bent, 1.0 - half**2 / 6.0)
    chord = cell_length * ratio
    x = np.cumsum(chord * np.sin(before + half), axis=-1)
    z = np.cumsum(chord * np.cos(before + half), axis=-1)
    return _in_space(x, z), rotations(behind)


def rotations(lean: Array) -> Array:
    """Return the rotations about +y by `lean` [rad], shape (..., n, 3, 3)."""
    R_w = np.zeros((*np.shape(lean), 3, 3))
    R_w[..., 0, 0] = R_w[..., 2, 2] = np.cos(lean)
    R_w[..., 0, 2] = np.sin(lean)
    R_w[..., 2, 0] = -np.sin(lean)
    R_w[..., 1, 1] = 1.0
    return R_w


def hinge_moments(hinges: Array, faces: Array, force: Array) -> Array:
    """Return the moment about +y at each hinge of the forces on the faces beyond it, shape (n,) [N m].

    Args:
        hinges: shape (n, 3) [m].
        faces: points at which the forces act, shape (n, 3) [m]; face k belongs to cell k.
        force: shape (n, 3) [N]; its y parts bend nothing.
    """
    fx, fz = force[:, 0], force[:, 2]
    about_origin = _beyond(faces[:, 2] * fx - faces[:, 0] * fz)
    return about_origin - hinges[:, 2] * _beyond(fx) + hinges[:, 0] * _beyond(fz)


def hinge_moment_slopes(hinges: Array, faces: Array, force: Array) -> Array:
    """Return how `hinge_moments` changes with the bend angles, shape (n, n) [N m/rad].

    Turning hinge m swings everything beyond it; the moment at hinge k sees the part beyond both, so
    that entry (k, m) depends on the outer one of the two alone, and the matrix is symmetric.
    """
    fx, fz = force[:, 0], force[:, 2]
    along = _beyond(faces[:, 0] * fx + faces[:, 2] * fz)
    outer = hinges[:, 0] * _beyond(fx) + hinges[:, 2] * _beyond(fz) - along
    index = np.arange(len(outer))
    return outer[np.maximum.outer(index, index)]


def _beyond(values: Array) -> Array:
    """Return for each cell the sum from it to the tip."""
    return np.cumsum(values[::-1])[::-1]


def _in_space(x: Array, z: Array) -> Array:
    return np.stack([x, np.zeros_like(x), z], axis=-1)
