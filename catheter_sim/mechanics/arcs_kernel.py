"""Frames along robots of arcs and of helices, compiled: what `arcs.points_on_arcs` fills."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array, Index
from catheter_sim.mechanics.compiled import compiled, compiled_in_place

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
