"""Kinematics of segments that bend in circular arcs, for many postures at once or one by one."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array, Index
from catheter_sim.mechanics.compiled import compiled, compiled_in_place

# ----------------------------------------------------------------------------------------------------
# Frames along robots of arcs and of helices, compiled: what `arcs.points_on_arcs` fills.

_SMALL2 = 1e-6  # [rad^2] below it the series is exact to the last bit
_NOT_SMALL2 = 1e-2  # [rad^2] the same of the series of a term that starts at the third power


@compiled_in_place
def _piece(x: float, y: float, length: float, turn: float, fraction: float, end: Array) -> None:
    """Set `end` (3, 4) to where the first `fraction` of a segment ends: its orientation, and its position.

    In a frame that turns along with the direction of bending, the rate of rotation is constant.
    """
    x, y, turned = x * fraction, y * fraction, turn * fraction
    angle2 = x * x + y * y + turned * turned
    if angle2 < _SMALL2:
        sine, versine = 1.0 - angle2 / 6.0, 0.5 - angle2 / 24.0
    else:
        angle = math.sqrt(angle2)
        half = math.sin(0.5 * angle)
        sine, versine = math.sin(angle) / angle, 2.0 * half * half / angle2
    # Its middle: the exponential of the rate of rotation ((0, -t, x), (t, 0, y), (-x, -y, 0)).
    end[0, 0] = 1.0 - versine * (turned * turned + x * x)
    end[1, 1] = 1.0 - versine * (turned * turned + y * y)
    end[2, 2] = 1.0 - versine * (x * x + y * y)
    end[0, 1] = -sine * turned - versine * x * y
    end[1, 0] = sine * turned - versine * x * y
    end[0, 2] = sine * x - versine * turned * y
    end[1, 2] = sine * y + versine * turned * x
    end[2, 0] = -sine * x - versine * turned * y
    end[2, 1] = -sine * y + versine * turned * x
    along = length * fraction
    if turn == 0.0:
        end[0, 3], end[1, 3], end[2, 3] = along * versine * x, along * versine * y, along * sine
        return
    if angle2 < _NOT_SMALL2:
        excess = 1.0 / 6.0 - angle2 / 120.0 + angle2 * angle2 / 5040.0
    else:
        angle = math.sqrt(angle2)
        excess = (angle - math.sin(angle)) / (angle2 * angle)
    place_x = along * (versine * x - excess * turned * y)
    place_y = along * (versine * y + excess * turned * x)
    end[2, 3] = along * (1.0 - excess * (x * x + y * y))
    # The direction of bending before and after its middle.
    cosine, sine = math.cos(-0.5 * turn), math.sin(-0.5 * turn)
    end[0, 3], end[1, 3] = cosine * place_x - sine * place_y, sine * place_x + cosine * place_y
    for j in range(3):
        up, side = end[0, j], end[1, j]
        end[0, j], end[1, j] = cosine * up - sine * side, sine * up + cosine * side
    cosine, sine = math.cos(0.5 * turn - turned), math.sin(0.5 * turn - turned)
    for i in range(3):
        up, side = end[i, 0], end[i, 1]
        end[i, 0], end[i, 1] = cosine * up + sine * side, cosine * side - sine * up


@compiled_in_place
def _follow(rotation: Array, position: Array, piece: Array, rotation_out: Array, position_out: Array) -> None:
    """Set the frame that `piece` (3, 4) leads to from a frame; the results are arrays of their own."""
    for i in range(3):
        total = position[i]
        for k in range(3):
            total += rotation[i, k] * piece[k, 3]
        position_out[i] = total
        for j in range(3):
            turned = 0.0
            for k in range(3):
                turned += rotation[i, k] * piece[k, j]
            rotation_out[i, j] = turned


@compiled
def fill_frames(
    bend: Array, length: Array, turn: Array, segment: Index, fraction: Array, p_w: Array, R_w: Array
) -> None:
    """Fill frames at given places along m robots, as `arcs.points_on_arcs` says.

    Args: bend (m, s, 2); length, turn (m, s); segment, fraction (n,); p_w (m, n, 3) and R_w (m, n, 3, 3), to
    be filled.
    """
    segments = bend.shape[1]
    piece = np.empty((3, 4))
    position, rotation = np.zeros((segments + 1, 3)), np.zeros((segments + 1, 3, 3))
    for i in range(3):
        rotation[0, i, i] = 1.0
    for m in range(len(bend)):
        for s in range(segments):
            _piece(bend[m, s, 0], bend[m, s, 1], length[m, s], turn[m, s], 1.0, piece)
            _follow(rotation[s], position[s], piece, rotation[s + 1], position[s + 1])
        for n in range(len(segment)):
            s = segment[n]
            _piece(bend[m, s, 0], bend[m, s, 1], length[m, s], turn[m, s], fraction[n], piece)
            _follow(rotation[s], position[s], piece, R_w[m, n], p_w[m, n])


# ----------------------------------------------------------------------------------------------------
# Kinematics of segments that bend in circular arcs, for many postures at once.
#
# A segment of length L bent by the vector b = (toward +x, toward +y) [rad] is an arc of the total angle |b|
# (Webster and Jones 2010, Eqs 2-3, written with the bend vector so that straight is no special case). Where
# the direction in which it bends turns evenly along it, it is a helix: in a frame that turns along, its
# rate of rotation is constant, and the exponential of that is where it ends.

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
    """Return where arcs of bend (..., 2) [rad] and length (...) [m] end, in the frames of their starts.

    Position (..., 3) [m] and orientation (..., 3, 3).
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

    Of bend (..., s, 2) [rad] and length (..., s) [m], or broadcast to it: positions (..., s + 1, 3) [m] and
    orientations (..., s + 1, 3, 3).
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


# ----------------------------------------------------------------------------------------------------
# Arcs one by one in compiled loops; `arcs` has the same for many postures at once.

_SMALL_RAD2 = 1e-2  # squared bend below which the series are exact to the last bits


@compiled
def arc_series(angle2):
    """Return sin(t)/t, (1 - cos t)/t^2, their slopes by t^2, and (t - sin t)/t^3 for `angle2` = t^2."""
    u = angle2
    if u < _SMALL_RAD2:
        sine = 1.0 - u / 6.0 * (1.0 - u / 20.0 * (1.0 - u / 42.0 * (1.0 - u / 72.0)))
        versine = 0.5 - u / 24.0 * (1.0 - u / 30.0 * (1.0 - u / 56.0 * (1.0 - u / 90.0)))
        sine_slope = -1.0 / 6.0 + u / 60.0 - u * u / 1680.0 + u * u * u / 90720.0
        versine_slope = -1.0 / 24.0 + u / 360.0 - u * u / 13440.0 + u * u * u / 907200.0
        third = (1.0 - u / 20.0 * (1.0 - u / 42.0 * (1.0 - u / 72.0))) / 6.0
        return sine, versine, sine_slope, versine_slope, third
    angle = math.sqrt(u)
    half = math.sin(0.5 * angle)
    sine = math.sin(angle) / angle
    versine = 2.0 * half * half / u
    return (
        sine,
        versine,
        (1.0 - u * versine - sine) / (2.0 * u),
        (sine - 2.0 * versine) / (2.0 * u),
        (1.0 - sine) / u,
    )


@compiled
def turn_by_arc(x, y, sine, versine, rotation, out):
    """Set `out` to `rotation` times the turn of an arc bent by (x, y), both (3, 3)."""
    for i in range(3):
        a, b, c = rotation[i, 0], rotation[i, 1], rotation[i, 2]
        toward = a * x + b * y
        out[i, 0] = a - (versine * toward + sine * c) * x
        out[i, 1] = b - (versine * toward + sine * c) * y
        out[i, 2] = c + sine * toward - versine * (x * x + y * y) * c
