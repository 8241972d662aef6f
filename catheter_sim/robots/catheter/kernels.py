"""Compiled loops of catheters: what pairs' displacements make of joints, and these of frames."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.mechanics.arcs import arc_series, turn_by_arc
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.hysteresis import played

# ----------------------------------------------------------------------------------------------------
# Pure kinematics of many catheters in compiled loops: displacements to joint values, these to frames.
#
# The text of `kinematics` explains the equations.

BENDING, TORSION, PRISMATIC, RIGID = 0, 1, 2, 3
_MOST_STEPS = 50
_SMALLEST_STEP_RAD = 1e-14
_LAST_BITS = 1.0 + 1e-12  # the last bit of the largest displacement is no reason to refuse it


@compiled
def _drawn_m(angle, half_gap, arm, gaps):
    """Return by how much a bending joint's tendon is shorter than straight [m] (Nayar 2022, Eqs 1-2)."""
    phi = angle / gaps
    half = math.sin(0.5 * phi)
    return gaps * (2.0 * half_gap * half * half + arm * math.sin(phi))


@compiled
def _bending_angle(way, compliance, rest, half_gap, arm, gaps, largest):
    """Return the angle of a bending joint [rad]; NaN beyond its range."""
    side = 1.0 if way >= 0.0 else -1.0
    size = abs(way)
    home = _drawn_m(side * rest, half_gap, arm, gaps)
    turn = largest - side * rest  # from rest, toward the drawn side
    reached = _drawn_m(largest, half_gap, arm, gaps) - home + compliance * turn
    if not size <= reached * _LAST_BITS:
        return math.nan
    if compliance == 0.0:
        x = (min(size, reached) + home) / gaps
        return side * 2.0 * gaps * math.atan(x / (arm + math.sqrt(arm * arm + x * (2.0 * half_gap - x))))
    for _ in range(_MOST_STEPS):
        angle = side * rest + turn  # counted toward the drawn side
        phi = angle / gaps
        excess = _drawn_m(angle, half_gap, arm, gaps) - home + compliance * turn - size
        step = excess / (half_gap * math.sin(phi) + arm * math.cos(phi) + compliance)
        turn = max(turn - step, 0.0)
        if abs(step) <= _SMALLEST_STEP_RAD:
            break
    return rest + side * turn


@compiled
def _torsion_angle(way, radius, wrap, height):
    """Return the angle of a torsion joint [rad]; NaN beyond its range."""
    whole = math.hypot(radius * wrap, height)
    most = whole - height
    size = abs(way)
    if not size <= most * _LAST_BITS:
        return math.nan
    size = min(size, most)
    around = math.sqrt(max((whole - size) ** 2 - height * height, 0.0))
    return math.copysign(size * (2.0 * whole - size) / (radius * (radius * wrap + around)), way)


@compiled
def _joint_value(kind, way, numbers):
    """Return what a joint does as its tendons are drawn by a way [m]: angle [rad] or advance [m]."""
    if kind == BENDING:
        return _bending_angle(way, numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[5])
    if kind == TORSION:
        return _torsion_angle(way, numbers[0], numbers[1], numbers[2])
    return way


@compiled
def joint_values(kind, ways, numbers, values):
    """Set `values` (r,) of one joint for ways (r,); `numbers` (6,): `pure_values` behind its first two."""
    for row in range(ways.shape[0]):
        values[row] = _joint_value(kind, ways[row], numbers)


@compiled
def pure_values(joint, numbers, ways, values):
    """Set `values` (B, r, t) to the joints' values, angle [rad] or advance [m]; NaN beyond the range.

    Args:
        joint: which kind of joint each pair moves, (t,).
        numbers: (B, t, 8): half of the play, slack [m]; then of a bending joint compliance [m/rad], rest,
            half gap, arm, twice the number of gaps, largest angle; of a torsion joint radius, wrap, height.
        ways: displacements, (B, r, t) [m].
    """
    for b in range(ways.shape[0]):
        for pair in range(ways.shape[2]):
            own = numbers[b, pair]
            drawn = 0.0
            for row in range(ways.shape[1]):
                way = ways[b, row, pair]
                drawn = played(drawn, way, own[0])
                arriving = math.copysign(max(abs(drawn) - own[1], 0.0), drawn)
                values[b, row, pair] = _joint_value(joint[pair], arriving, own[2:])


@compiled
def element_frames(joint, mover, numbers, segment, faces, values, places, rotations):
    """Set frames of elements, (B, r, n, 3) [m] and (B, r, n, 3, 3), at joint values (B, r, t).

    Args:
        joint: kind of each segment, (s,); mover: the pair that moves it, or -1, (s,).
        numbers: (B, s, 3): length [m], and the direction (x, y) in which a bending joint bends or the
            curvature (x, y) of a prismatic segment's tube [1/m].
        segment: of each element, rising, (n,).
        faces: of each element from its segment's base, (B, n) [m].
    """
    place, point, rotation, end = np.empty(3), np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    for b in range(values.shape[0]):
        for row in range(values.shape[1]):
            for i in range(3):
                place[i] = 0.0
                for j in range(3):
                    rotation[i, j] = 1.0 if i == j else 0.0
            element = 0
            for s in range(len(joint)):
                length, x, y = numbers[b, s, 0], numbers[b, s, 1], numbers[b, s, 2]
                value = values[b, row, mover[s]] if mover[s] >= 0 else 0.0
                if joint[s] == TORSION:
                    cosine, sine = math.cos(value), math.sin(value)
                    for i in range(3):
                        a, c = rotation[i, 0], rotation[i, 1]
                        rotation[i, 0] = cosine * a + sine * c
                        rotation[i, 1] = cosine * c - sine * a
                # An arc (of a rigid or torsion segment one of no length), then a straight piece.
                arc, straight = 0.0, length
                if joint[s] == BENDING:
                    arc, straight = length, 0.0
                    x, y = x * value / length, y * value / length
                elif joint[s] == PRISMATIC:
                    arc = value
                while True:
                    shown = element < len(segment) and segment[element] == s
                    inside = shown and joint[s] == BENDING  # a ring: a gap follows it
                    reach = faces[b, element] if inside else arc
                    bend_x, bend_y = x * reach, y * reach
                    sine, versine, _, _, _ = arc_series(bend_x * bend_x + bend_y * bend_y)
                    turn_by_arc(bend_x, bend_y, sine, versine, rotation, end)
                    for i in range(3):
                        across = rotation[i, 0] * bend_x + rotation[i, 1] * bend_y
                        point[i] = place[i] + reach * (versine * across + sine * rotation[i, 2])
                        point[i] += straight * end[i, 2]
                    if shown:
                        for i in range(3):
                            places[b, row, element, i] = point[i]
                            for j in range(3):
                                rotations[b, row, element, i, j] = end[i, j]
                        element += 1
                    if not inside:
                        break
                for i in range(3):
                    place[i] = point[i]
                    for j in range(3):
                        rotation[i, j] = end[i, j]
