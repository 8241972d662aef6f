"""From one load to the next in compiled form: continuation with warm starts, dry friction, many rows.

A row's equilibrium is the one that its loads lead to when they grow in proportion from the row
before (the first: from rest); where that way ends, from rest. The way is cut into steps that turn
the robot little; a step that fails is halved.

Dry friction. The tensions are those of tendons that were pulled from rest to where they are: at each
hole, the base's included and the last one's not, they fall toward the tip by exp(-mu phi), phi the
angle that the tendon turns by (capstan). They follow from the posture and the posture from them,
in turns.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from catheter_sim.robots.posture import Array
from catheter_sim.statics.tdcr.section import compiled, strain_of
from catheter_sim.statics.tdcr.shooting import CONTINUOUS, CONVERGED, FARTHEST_TURN_RAD, TOO_FAR, newton

_ON_THE_WAY = 1e-5  # turn of the last correction before the end of the way [rad]
_AT_THE_END = 1e-10
_SHORTEST_STEP = 1.0 / 1024.0  # of the way from load to load
_FRICTION_ROUNDS = 100
_FRICTION_TOLERANCE = 1e-11  # change of the tensions, over the largest one


@compiled
def _angle(a: Array, b: Array) -> float:
    """Angle between two directions [rad]."""
    x = a[1] * b[2] - a[2] * b[1]
    y = a[2] * b[0] - a[0] * b[2]
    z = a[0] * b[1] - a[1] * b[0]
    return math.atan2(math.sqrt(x * x + y * y + z * z), a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@compiled
def _tangent(strain: Array, hole: Array, out: Array) -> None:
    """Direction v + u x r of a tendon's path along the rod (Rao 2021, Eq. 27)."""
    out[0] = strain[3] - strain[2] * hole[1]
    out[1] = strain[4] + strain[2] * hole[0]
    out[2] = 1.0 + strain[5] + strain[0] * hole[1] - strain[1] * hole[0]


@compiled
def _turns(
    path: int, rod: Array, hole: Array, span: Array, wrench: Array, turn: Array, shift: Array, angle: Array
) -> None:
    """Angles that the tendons turn by at the holes of disks 0 to n - 1, shape (t, n) [rad].

    A continuous path turns all along a section; half of that is counted at either end.
    """
    tendons, n = span.shape
    strain, stiffness, end = np.zeros(6), np.empty((6, 6)), np.empty(6)
    before, after = np.empty(3), np.empty(3)
    angle[:] = 0.0
    if path == CONTINUOUS:
        for j in range(n):
            R, p = turn[j], shift[j]
            n0 = wrench[j, 3:]
            m0 = wrench[j, :3].copy()
            m0[0] -= p[1] * n0[2] - p[2] * n0[1]
            m0[1] -= p[2] * n0[0] - p[0] * n0[2]
            m0[2] -= p[0] * n0[1] - p[1] * n0[0]
            end[:3] = R.T @ m0
            end[3:] = R.T @ n0
            along = span[:, j].copy()
            at_end = np.zeros(6)
            strain_of(rod[j], hole, along, end, at_end, stiffness)
            strain[:] = at_end
            strain_of(rod[j], hole, along, wrench[j], strain, stiffness)
            for k in range(tendons):
                if along[k] == 0.0:
                    continue
                _tangent(strain, hole[k], before)
                _tangent(at_end, hole[k], after)
                half = 0.5 * _angle(before, R @ after)
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
            angle[k, j] = _angle(before, after)
            before[:] = R.T @ after


@compiled
def _balanced(
    path: int, rod: Array, hole: Array, last: NDArray[np.intp], mu: float, tension: Array,
    force: Array, moment: Array, span: Array, wrench: Array, turn: Array, shift: Array, R_w: Array,
    tolerance: float, residual: Array, angle: Array,
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
    for trial in range(_FRICTION_ROUNDS):
        status, count, far = newton(
            path, rod, hole, span, force, moment, wrench, turn, shift, R_w, tolerance, residual
        )
        rounds += count
        if trial == 0:
            first = far
        if status != CONVERGED or mu == 0.0:
            return status, rounds, first
        _turns(path, rod, hole, span, wrench, turn, shift, angle)
        change = 0.0
        for k in range(tendons):
            total = 0.0
            for j in range(last[k]):
                total += angle[k, j]
                angle[k, j] = total
                new = tension[k] * math.exp(-mu * total)
                change = max(change, abs(new - span[k, j]))
                span[k, j] = new
        if change < max(_FRICTION_TOLERANCE, 0.1 * tolerance) * largest:
            return status, rounds, first
    return TOO_FAR, rounds, first


@compiled
def advance(
    path: int, rod: Array, hole: Array, last: NDArray[np.intp], mu: float,
    tension0: Array, force0: Array, moment0: Array, tension1: Array, force1: Array, moment1: Array,
    wrench: Array, span: Array, angle: Array, turn: Array, shift: Array, R_w: Array, residual: Array,
) -> tuple[float, int]:  # fmt: skip
    """Follow the equilibrium from one load to another; the arrays from `wrench` on are changed.

    Returns:
        The share of the way that was reached (1.0: all), and the number of Newton's corrections.
    """
    reached, step = 0.0, 1.0
    count = 0
    while reached < 1.0:
        if step < _SHORTEST_STEP:
            return reached, count
        share = min(1.0, reached + step)
        if share > 1.0 - 0.1 * step:
            share = 1.0
        old_wrench, old_angle = wrench.copy(), angle.copy()
        status, rounds, far = _balanced(
            path, rod, hole, last, mu,
            tension0 + share * (tension1 - tension0),
            force0 + share * (force1 - force0),
            moment0 + share * (moment1 - moment0),
            span, wrench, turn, shift, R_w, _AT_THE_END if share == 1.0 else _ON_THE_WAY, residual, angle,
        )  # fmt: skip
        count += rounds
        if status == CONVERGED:
            reached = share
            step *= 2.0
            continue
        wrench[:] = old_wrench
        angle[:] = old_angle
        if status == TOO_FAR and rounds == 1:
            step *= max(0.05, min(0.9, 0.8 * FARTHEST_TURN_RAD / far))
        else:
            step *= 0.5
    return 1.0, count


@compiled
def solve_rows(
    path: int, rod: Array, hole: Array, last: NDArray[np.intp], mu: float,
    tension: Array, force: Array, moment: Array,
    wrench: Array, span: Array, p_w: Array, R_w: Array, residual: Array, reached: Array,
    count: NDArray[np.intp],
) -> None:  # fmt: skip
    """Find the equilibria of rows of loads, one after another; all arrays from `wrench` on are results.

    Args:
        path: CONTINUOUS, PROJECTED or EYELETS (`shooting`).
        rod: sections' data, shape (n, 8) (`section`).
        hole: shape (t, 2) [m].
        last: number of the disk where each tendon ends, shape (t,).
        mu: capstan coefficient.
        tension: at the base, shape (r, t) [N].
        force, moment: on disks 1 to n, base frame, shape (r, n, 3) [N], [N m].
        wrench: at the sections' starts, in their frames, shape (r, n, 6).
        span: tensions, shape (r, t, n) [N].
        p_w, R_w: of disks 0 to n, shapes (r, n + 1, 3) [m] and (r, n + 1, 3, 3).
        residual: unbalanced moment and force at the disks, in their frames, shape (r, n, 6).
        reached: share of the way from rest or from the row before, shape (r,); below 1: not balanced.
        count: of Newton's corrections, shape (r,).
    """
    rows, tendons = tension.shape
    n = len(rod)
    turn, shift = np.empty((n, 3, 3)), np.empty((n, 3))
    now, angle = np.zeros((n, 6)), np.zeros((tendons, n))
    no_tension, no_load = np.zeros(tendons), np.zeros((n, 3))
    start = -1  # the row before, where it was balanced
    for row in range(rows):
        R_w[row, 0] = np.eye(3)
        p_w[row, 0] = 0.0
        reached[row] = 0.0
        if start >= 0:
            reached[row], count[row] = advance(
                path, rod, hole, last, mu,
                tension[start], force[start], moment[start], tension[row], force[row], moment[row],
                now, span[row], angle, turn, shift, R_w[row], residual[row],
            )  # fmt: skip
        if reached[row] < 1.0:
            now[:] = 0.0
            angle[:] = 0.0
            reached[row], rounds = advance(
                path, rod, hole, last, mu,
                no_tension, no_load, no_load, tension[row], force[row], moment[row],
                now, span[row], angle, turn, shift, R_w[row], residual[row],
            )  # fmt: skip
            count[row] += rounds
        for j in range(n):
            p_w[row, j + 1] = p_w[row, j] + R_w[row, j] @ shift[j]
        wrench[row] = now
        start = row if reached[row] == 1.0 else -1
