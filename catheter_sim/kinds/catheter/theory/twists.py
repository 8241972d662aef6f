"""Product of exponentials of twists, for many postures at once.

A twist is (v, w): v = -w x q of a turn about the unit axis w through q, or the unit direction of a
slide with w = 0 (Nayar 2022, before Eq. 11). Transforms are homogeneous, shape (..., 4, 4).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from catheter_sim.arrays import Array


def turn(axis: ArrayLike, point: ArrayLike) -> Array:
    """Return the twist of a turn about `axis` (unit, (3,)) through `point` ((3,) [m]), shape (6,)."""
    w = np.asarray(axis, dtype=float)
    return np.concatenate([-np.cross(w, np.asarray(point, dtype=float)), w])


def slide(direction: ArrayLike) -> Array:
    """Return the twist of a slide along `direction` (unit, (3,)), shape (6,)."""
    return np.concatenate([np.asarray(direction, dtype=float), np.zeros(3)])


def exponential(twist: Array, value: ArrayLike) -> Array:
    """Return exp(twist * value).

    Args:
        twist: shape (6,), its axis unit or zero.
        value: angle [rad] or way [m], shape (...).

    Returns:
        Transforms, shape (..., 4, 4).
    """
    value = np.asarray(value, dtype=float)
    v, w = twist[:3], twist[3:]
    result = np.zeros((*value.shape, 4, 4))
    result[..., 3, 3] = 1.0
    if not w.any():
        result[..., :3, :3] = np.eye(3)
        result[..., :3, 3] = value[..., None] * v
        return result
    hat = cross_matrix(w)
    sine = np.sin(value)[..., None, None]
    versine = (2.0 * np.sin(0.5 * value) ** 2)[..., None, None]
    rotation = np.eye(3) + sine * hat + versine * (hat @ hat)
    result[..., :3, :3] = rotation
    pitch = value[..., None] * w * float(w @ v)
    result[..., :3, 3] = (np.eye(3) - rotation) @ np.cross(w, v) + pitch
    return result


def cross_matrix(w: Array) -> Array:
    """Return the matrix of w x, shape (3, 3)."""
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


def product_of_exponentials(twists: Array, values: Array, home: Array) -> Array:
    """Return exp(twist_1 value_1) ... exp(twist_j value_j) home.

    Args:
        twists: shape (j, 6), in the home posture, base frame.
        values: shape (..., j).
        home: transform at zero, shape (4, 4).

    Returns:
        Transforms, shape (..., 4, 4).
    """
    result = np.broadcast_to(np.eye(4), (*values.shape[:-1], 4, 4))
    for index, twist in enumerate(twists):
        result = result @ exponential(twist, values[..., index])
    return result @ home


def space_jacobian(twists: Array, values: Array) -> Array:
    """Return the twists in the base frame as they lie when the joints are at `values`.

    Args:
        twists: shape (j, 6).
        values: shape (..., j).

    Returns:
        Shape (..., 6, j): columns (v, w).
    """
    before = np.broadcast_to(np.eye(4), (*values.shape[:-1], 4, 4))
    columns = []
    for index, twist in enumerate(twists):
        rotation, place = before[..., :3, :3], before[..., :3, 3]
        w = rotation @ twist[3:]
        v = rotation @ twist[:3] + np.cross(place, w)
        columns.append(np.concatenate([v, w], axis=-1))
        before = before @ exponential(twist, values[..., index])
    return np.stack(columns, axis=-1)
