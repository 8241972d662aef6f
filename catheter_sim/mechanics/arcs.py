"""Kinematics of segments that bend in circular arcs, for many postures at once.

A segment of length L bent by the vector b = (toward +x, toward +y) [rad] is an arc of the total
angle |b| (Webster and Jones 2010, Eqs 2-3, written with the bend vector so that straight is no
special case). Where the direction in which it bends turns evenly along it, it is a helix: in a frame that
turns along, its rate of rotation is constant, and the exponential of that is where it ends.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SMALL = 1e-3  # [rad] below it the series is exact to the last bit
_NOT_SMALL = 0.1  # [rad] the same of the series of a term that starts at the third power


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


def helix_end(bend: Array, length: Array, turn: Array, fraction: Array | float = 1.0) -> tuple[Array, Array]:
    """Return where a segment whose bending turns evenly along it is in the frame of its start.

    Args:
        bend: bend vector of the whole segment in its middle, shape (..., 2) [rad].
        length: shape (...) [m].
        turn: by which the direction of bending turns over the segment, shape (...) [rad].
        fraction: of the segment up to the place asked for, broadcast to (...).

    Returns:
        Position, shape (..., 3) [m], and orientation, shape (..., 3, 3); the orientation does not turn along.
    """
    x, y, turned = (item * fraction for item in (bend[..., 0], bend[..., 1], turn))
    rate = np.zeros((*np.broadcast(x, turned).shape, 3, 3))
    rate[..., 0, 1], rate[..., 1, 0] = -turned, turned
    rate[..., 0, 2], rate[..., 2, 0] = x, -x
    rate[..., 1, 2], rate[..., 2, 1] = y, -y
    angle2 = x * x + y * y + turned * turned
    sine, versine = (item[..., None, None] for item in arc_functions(angle2))
    square = rate @ rate
    along = (np.eye(3) + versine * rate + _excess(angle2)[..., None, None] * square)[..., 2]
    first = _about_axis(-0.5 * turn)
    position = (first @ along[..., None])[..., 0] * (length * fraction)[..., None]
    return position, first @ (np.eye(3) + sine * rate + versine * square) @ _about_axis(0.5 * turn - turned)


def _excess(angle2: Array) -> Array:
    """Return (t - sin t) / t^3 for `angle2` = t^2 of any shape."""
    angle = np.sqrt(np.maximum(angle2, _NOT_SMALL**2))
    series = 1.0 / 6.0 - angle2 / 120.0 + angle2**2 / 5040.0
    return np.where(angle2 < _NOT_SMALL**2, series, (angle - np.sin(angle)) / angle**3)


def _about_axis(angle: Array) -> Array:
    """Return turns about z by angles (...), shape (..., 3, 3)."""
    found = np.zeros((*angle.shape, 3, 3))
    found[..., 0, 0] = found[..., 1, 1] = np.cos(angle)
    found[..., 1, 0] = np.sin(angle)
    found[..., 0, 1] = -found[..., 1, 0]
    found[..., 2, 2] = 1.0
    return found


def segment_frames(bend: Array, length: Array, turn: Array | None = None) -> tuple[Array, Array]:
    """Return the frames at the base and at the end of every segment, the base frame first.

    Args:
        bend: shape (..., s, 2) [rad].
        length: shape (..., s) [m], or broadcast to it.
        turn: as of `helix_end`, broadcast to (..., s); None: arcs.

    Returns:
        Positions, shape (..., s + 1, 3) [m], and orientations, shape (..., s + 1, 3, 3).
    """
    shape = bend.shape[:-2]
    segments = bend.shape[-2]
    p_w = np.zeros((*shape, segments + 1, 3))
    R_w = np.zeros((*shape, segments + 1, 3, 3))
    R_w[..., 0, :, :] = np.eye(3)
    lengths = np.broadcast_to(length, bend.shape[:-1])
    steps, turns = (
        arc_end(bend, lengths)
        if turn is None
        else helix_end(bend, lengths, np.broadcast_to(turn, bend.shape[:-1]))
    )
    for index in range(segments):
        here = R_w[..., index, :, :]
        p_w[..., index + 1, :] = p_w[..., index, :] + (here @ steps[..., index, :, None])[..., 0]
        R_w[..., index + 1, :, :] = here @ turns[..., index, :, :]
    return p_w, R_w


def points_on_arcs(
    bend: Array, length: Array, segment: Array, fraction: Array, turn: Array | None = None
) -> tuple[Array, Array]:
    """Return frames at given places along a robot of arcs, or of helices.

    Args:
        bend: shape (..., s, 2) [rad].
        length: shape (..., s) [m], or broadcast to it.
        segment: index of each place's segment, shape (n,).
        fraction: of the segment's length, in (0, 1], shape (n,).
        turn: as of `helix_end`, broadcast to (..., s); None: arcs.

    Returns:
        Positions, shape (..., n, 3) [m], and orientations, shape (..., n, 3, 3).
    """
    length = np.broadcast_to(length, bend.shape[:-1])
    p_w, R_w = segment_frames(bend, length, turn)
    mine, lengths = bend[..., segment, :], length[..., segment]
    if turn is None:
        step, rotation = arc_end(mine * fraction[:, None], lengths * fraction)
    else:
        turned = np.broadcast_to(turn, bend.shape[:-1])[..., segment]
        step, rotation = helix_end(mine, lengths, turned, fraction)
    R_start = R_w[..., segment, :, :]
    return p_w[..., segment, :] + (R_start @ step[..., None])[..., 0], R_start @ rotation
