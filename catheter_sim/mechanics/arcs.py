"""Kinematics of segments that bend in circular arcs, for many postures at once.

A segment of length L bent by the vector b = (toward +x, toward +y) [rad] is an arc of the total
angle |b| (Webster and Jones 2010, Eqs 2-3, written with the bend vector so that straight is no
special case).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SMALL = 1e-3  # [rad] below it the series is exact to the last bit


def arc_functions(angle2: Array) -> tuple[Array, Array]:
    """Return sin(t)/t and (1 - cos t)/t^2 for `angle2` = t^2 of any shape."""
    safe = np.maximum(angle2, _SMALL**2)
    angle = np.sqrt(safe)
    half = np.sin(0.5 * angle)
    small = angle2 < _SMALL**2
    sine = np.where(small, 1.0 - angle2 / 6.0, np.sin(angle) / angle)
    versine = np.where(small, 0.5 - angle2 / 24.0, 2.0 * half * half / safe)
    return sine, versine


def arc_end(bend: Array, length: Array) -> tuple[Array, Array]:
    """Return where an arc ends in the frame of its start.

    Args:
        bend: bend vector, shape (..., 2) [rad].
        length: shape (...) [m].

    Returns:
        Position, shape (..., 3) [m], and orientation, shape (..., 3, 3).
    """
    x, y = bend[..., 0], bend[..., 1]
    sine, versine = arc_functions(x * x + y * y)
    position = np.stack([length * versine * x, length * versine * y, length * sine], axis=-1)
    rotation = np.empty((*x.shape, 3, 3))
    rotation[..., 0, 0] = 1.0 - versine * x * x
    rotation[..., 1, 1] = 1.0 - versine * y * y
    rotation[..., 0, 1] = rotation[..., 1, 0] = -versine * x * y
    rotation[..., 2, 2] = 1.0 - versine * (x * x + y * y)
    rotation[..., 0, 2] = sine * x
    rotation[..., 1, 2] = sine * y
    rotation[..., 2, 0] = -sine * x
    rotation[..., 2, 1] = -sine * y
    return position, rotation


def segment_frames(bend: Array, length: Array) -> tuple[Array, Array]:
    """Return the frames at the base and at the end of every segment, the base frame first.

    Args:
        bend: shape (..., s, 2) [rad].
        length: shape (..., s) [m], or broadcast to it.

    Returns:
        Positions, shape (..., s + 1, 3) [m], and orientations, shape (..., s + 1, 3, 3).
    """
    shape = bend.shape[:-2]
    segments = bend.shape[-2]
    p_w = np.zeros((*shape, segments + 1, 3))
    R_w = np.zeros((*shape, segments + 1, 3, 3))
    R_w[..., 0, :, :] = np.eye(3)
    steps, turns = arc_end(bend, np.broadcast_to(length, bend.shape[:-1]))
    for index in range(segments):
        here = R_w[..., index, :, :]
        p_w[..., index + 1, :] = p_w[..., index, :] + (here @ steps[..., index, :, None])[..., 0]
        R_w[..., index + 1, :, :] = here @ turns[..., index, :, :]
    return p_w, R_w


def points_on_arcs(bend: Array, length: Array, segment: Array, fraction: Array) -> tuple[Array, Array]:
    """Return frames at given places along a robot of arcs.

    Args:
        bend: shape (..., s, 2) [rad].
        length: shape (..., s) [m], or broadcast to it.
        segment: index of each place's segment, shape (n,).
        fraction: of the segment's length, in (0, 1], shape (n,).

    Returns:
        Positions, shape (..., n, 3) [m], and orientations, shape (..., n, 3, 3).
    """
    length = np.broadcast_to(length, bend.shape[:-1])
    p_w, R_w = segment_frames(bend, length)
    step, turn = arc_end(bend[..., segment, :] * fraction[:, None], length[..., segment] * fraction)
    R_start = R_w[..., segment, :, :]
    return p_w[..., segment, :] + (R_start @ step[..., None])[..., 0], R_start @ turn
