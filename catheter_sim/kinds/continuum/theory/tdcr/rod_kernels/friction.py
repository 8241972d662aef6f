"""Dry friction of tendons at the disks' holes, compiled: tensions and posture, found in turns.

The tensions are those of tendons that were pulled from rest to where they are: at each hole, the base's
included and the last one's not, they fall toward the tip by exp(-mu phi), phi the angle that the tendon turns
by (capstan). They follow from the posture and the posture from them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.columns import CONTINUOUS, LUMENS
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.newton import (
    CONVERGED,
    ON_THE_WAY_RAD,
    TOO_FAR,
    newton,
)
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.strain import path_direction, strain_of
from catheter_sim.mechanics.compiled import compiled, inlined
from catheter_sim.mechanics.vectors import turned, turned_back

_MOST_ROUNDS = 100
_TOLERANCE = 1e-11  # change of the tensions, over the largest one


@compiled
def _angle_between(a: Array, b: Array) -> float:
    """Angle between two directions [rad]."""
    x = a[1] * b[2] - a[2] * b[1]
    y = a[2] * b[0] - a[0] * b[2]
    z = a[0] * b[1] - a[1] * b[0]
    return math.atan2(math.sqrt(x * x + y * y + z * z), a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@compiled
def _tendon_turns(
    path: int, rod: Array, hole: Array, span: Array, wrench: Array, turn: Array, shift: Array, angle: Array
) -> None:
    """Angles that the tendons turn by at the holes of disks 0 to n - 1, shape (t, n) [rad].

    A continuous path turns all along a section; half of that is counted at either end.
    """
    tendons, n = span.shape
    strain, at_end, end, stiffness = np.zeros(6), np.zeros(6), np.empty(6), np.empty((6, 6))
    before, after, moved, along = np.empty(3), np.empty(3), np.empty(3), np.empty(tendons)
    for k in range(tendons):
        for j in range(n):
            angle[k, j] = 0.0
    if path in (CONTINUOUS, LUMENS):
        for j in range(n):
            p, m0, n0 = shift[j], wrench[j, :3], wrench[j, 3:]
            moved[0] = m0[0] - (p[1] * n0[2] - p[2] * n0[1])
            moved[1] = m0[1] - (p[2] * n0[0] - p[0] * n0[2])
            moved[2] = m0[2] - (p[0] * n0[1] - p[1] * n0[0])
            turned_back(turn[j], moved, end[:3])
            turned_back(turn[j], n0, end[3:])
            for k in range(tendons):
                along[k] = span[k, j]
            strain_of(rod[j], hole, along, end, at_end, stiffness)
            strain_of(rod[j], hole, along, wrench[j], strain, stiffness)
            for k in range(tendons):
                if along[k] == 0.0:
                    continue
                path_direction(strain, hole[k], before)
                path_direction(at_end, hole[k], after)
                turned(turn[j], after, moved)
                half = 0.5 * _angle_between(before, moved)
                angle[k, j] += half
                if j + 1 < n and span[k, j + 1] > 0.0:
                    angle[k, j + 1] += half
        return
    for k in range(tendons):
        before[0] = before[1] = 0.0
        before[2] = 1.0
        for j in range(n):
            if span[k, j] == 0.0:
                break
            R = turn[j]
            for i in range(3):
                after[i] = R[i, 0] * hole[k, 0] + R[i, 1] * hole[k, 1] + shift[j, i]
            after[0] -= hole[k, 0]
            after[1] -= hole[k, 1]
            angle[k, j] = _angle_between(before, after)
            turned_back(R, after, before)


@inlined
def balanced(
    path: int, rough: Array, fine: Array, hole: Array, last: NDArray[np.intp], mu: float, tension: Array,
    applied: Array, span: Array, wrench: Array, turn: Array, shift: Array, R_w: Array,
    to_the_end: bool, farthest: float, residual: Array, angle: Array, w: Array,
) -> tuple[int, int, float]:  # fmt: skip
    """Balance posture and tensions; `span` is start and result; as `newton` otherwise."""
    tendons, n = span.shape
    for k in range(tendons):
        for j in range(n):
            span[k, j] = tension[k] * math.exp(-mu * angle[k, j]) if j < last[k] else 0.0
    rounds = 0
    first = 0.0
    largest = 1e-300
    for k in range(tendons):
        largest = max(largest, tension[k])
    for trial in range(_MOST_ROUNDS):
        status, count, far = newton(
            path, rough, fine, hole, span, applied, wrench, turn, shift, R_w,
            to_the_end, farthest, residual, w,
        )  # fmt: skip
        rounds += count
        if trial == 0:
            first = far
        if status != CONVERGED or mu == 0.0:
            return status, rounds, first
        _tendon_turns(path, rough, hole, span, wrench, turn, shift, angle)
        change = 0.0
        for k in range(tendons):
            total = 0.0
            for j in range(last[k]):
                total += angle[k, j]
                angle[k, j] = total
                new = tension[k] * math.exp(-mu * total)
                change = max(change, abs(new - span[k, j]))
                span[k, j] = new
        if change < (_TOLERANCE if to_the_end else 0.1 * ON_THE_WAY_RAD) * largest:
            return status, rounds, first
    return TOO_FAR, rounds, first
