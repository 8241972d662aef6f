"""Kinematics of segments that bend in circular arcs, for many postures at once.

A segment of length L bent by the vector b = (toward +x, toward +y) [rad] is an arc of the total
angle |b| (Webster and Jones 2010, Eqs 2-3, written with the bend vector so that straight is no
special case). Where the direction in which it bends turns evenly along it, it is a helix: in a frame that
turns along, its rate of rotation is constant, and the exponential of that is where it ends.
"""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.mechanics.arcs_kernel import fill_frames

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


def points_on_arcs(
    bend: Array,
    length: Array,
    segment: Array,
    fraction: Array,
    turn: Array | None = None,
    lead: Array | None = None,
) -> tuple[Array, Array]:
    """Return frames at given places along a robot of arcs, or of helices.

    Args:
        bend: shape (..., s, 2) [rad].
        length: shape (..., s) [m], or broadcast to it.
        segment: index of each place's segment, shape (n,).
        fraction: of the segment's length, in (0, 1], shape (n,).
        turn: by which the direction of bending turns over each segment, `bend` being what it is in the
            middle, broadcast to (..., s) [rad]; None: arcs. Orientations do not turn along.
        lead: by which each arc begins above its segment's start, and places lie below theirs on it, broadcast
            to (..., s) [m]; None: none.

    Returns:
        Positions, shape (..., n, 3) [m], and orientations, shape (..., n, 3, 3).
    """
    shape, segments, places = bend.shape[:-2], bend.shape[-2], len(segment)
    count = math.prod(shape)
    p_w, R_w = np.empty((count, places, 3)), np.empty((count, places, 3, 3))
    of_segments = (np.broadcast_to(item, bend.shape[:-1]) for item in (length, 0.0 if turn is None else turn))
    lengths, turns = (np.ascontiguousarray(item, float).reshape(count, segments) for item in of_segments)
    fill_frames(
        np.ascontiguousarray(bend).reshape(count, segments, 2),
        lengths,
        turns,
        np.ascontiguousarray(segment, np.int64),
        np.ascontiguousarray(fraction, float),
        p_w,
        R_w,
    )
    p_w, R_w = p_w.reshape(*shape, places, 3), R_w.reshape(*shape, places, 3, 3)
    if lead is not None and lead.any():
        along = segment_frames(bend, length)[1][..., 2]  # of the segments' starts and ends
        lead = np.broadcast_to(lead, bend.shape[:-1])[..., None]
        shifts = np.cumsum(lead * (along[..., :-1, :] - along[..., 1:, :]), axis=-2)
        before = np.concatenate([np.zeros_like(shifts[..., :1, :]), shifts[..., :-1, :]], axis=-2)
        p_w += before[..., segment, :] + (lead * along[..., :-1, :])[..., segment, :]
        p_w -= lead[..., segment, :] * R_w[..., 2]
    return p_w, R_w
