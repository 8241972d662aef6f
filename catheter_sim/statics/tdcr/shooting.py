"""Equilibrium of a row of rod sections between disks in compiled form: multiple shooting, Newton.

The unknowns are the wrenches at the sections' starts, each in the frame of its start, so that a
section's pose does not depend on where the robot has got to. What is left over at disk j, in the
disk's frame, is

    wrench at the start of section j + 1 - wrench at the end of section j + tendons + loads,

(Rao et al. 2021, doi 10.3389/frobt.2020.603245, Eqs 40-41) and depends on the two sections next to
the disk and, through loads that keep their direction in space, on the disk's orientation. One sweep
from the tip solves the linear system: every correction is linear in the tip's small turn, which the
fixed base then gives.

Tendons are fully constrained (inside the sections' elastic law, see `section`), or straight between
the disks: with the force of Eqs 30-33, projected into the disk's plane by Eq. 58 or not. Unprojected,
a tendon of constant tension is in an eyelet without friction. What Eq. 58 takes away is the part
without friction only: the difference of the tensions at the two sides of a hole is kept.
"""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.robots.posture import Array
from catheter_sim.statics.tdcr.section import compiled, cross_section, solve_in_place

CONTINUOUS, PROJECTED, EYELETS = range(3)  # tendon paths

CONVERGED, SINGULAR, DIVERGED, TOO_FAR = range(4)  # how Newton's method ended

_MOST_ROUNDS = 14
# What the first correction may turn the sections by, summed: beyond it Newton's method may find
# another equilibrium than the one that the load leads to.
FARTHEST_TURN_RAD = 0.8
_WORSE = 20.0  # growth of the residual that a correction may cause: continuation does the rest


@compiled
def _cross_matrix(a: Array, out: Array) -> None:
    out[0, 0] = out[1, 1] = out[2, 2] = 0.0
    out[0, 1], out[0, 2], out[1, 2] = -a[2], a[1], -a[0]
    out[1, 0], out[2, 0], out[2, 1] = a[2], -a[1], a[0]


@compiled
def _pull(
    tension: float,
    across: Array,
    slope: Array,
    hole: Array,
    projected: float,
    wrench: Array,
    derivative: Array,
) -> None:
    """Add one straight span's pull on a disk at `hole` to `wrench` and its derivative.

    `across` reaches from this hole to the next one in the disk's frame, `slope` (3, 6) is its
    derivative. `projected` is the part of the tension whose force along the disk's axis is left out.
    """
    length = math.sqrt(across[0] ** 2 + across[1] ** 2 + across[2] ** 2)
    d0, d1, d2 = across[0] / length, across[1] / length, across[2] / length
    kept = tension - projected
    x, y = hole[0], hole[1]
    fx, fy, fz = tension * d0, tension * d1, kept * d2
    wrench[0] += y * fz
    wrench[1] -= x * fz
    wrench[2] += x * fy - y * fx
    wrench[3] += fx
    wrench[4] += fy
    wrench[5] += fz
    for c in range(6):
        along = d0 * slope[0, c] + d1 * slope[1, c] + d2 * slope[2, c]
        fx = tension / length * (slope[0, c] - d0 * along)
        fy = tension / length * (slope[1, c] - d1 * along)
        fz = kept / length * (slope[2, c] - d2 * along)
        derivative[0, c] += y * fz
        derivative[1, c] -= x * fz
        derivative[2, c] += x * fy - y * fx
        derivative[3, c] += fx
        derivative[4, c] += fy
        derivative[5, c] += fz


@compiled
def _balance(
    path: int,
    rod: Array,
    hole: Array,
    span: Array,
    force: Array,
    moment: Array,
    wrench: Array,
    turn: Array,
    shift: Array,
    turn_slope: Array,
    shift_slope: Array,
    R_w: Array,
    residual: Array,
    here: Array,
    above: Array,
    load: Array,
) -> None:
    """Residual (n, 6) at the disks, derivatives by the section below and above and by the disk's turn.

    `turn` ... `shift_slope` are the sections' poses and their derivatives, `R_w` the orientations of
    disks 0 to n; `here`, `above`, shapes (n, 6, 6), `load`, shape (n, 6, 3), are results as well.
    """
    n, tendons = len(rod), len(hole)
    none = np.zeros(tendons)
    end = np.empty(6)
    slope = np.empty((3, 6))
    across = np.empty(3)
    square = np.empty((3, 3))
    for j in range(n):
        along = span[:, j].copy() if path == CONTINUOUS else none
        cross_section(rod[j], hole, along, wrench[j], turn[j], shift[j], turn_slope[j], shift_slope[j])
        R_w[j + 1] = R_w[j] @ turn[j]
    for j in range(n):
        R, p = turn[j], shift[j]
        residual[j] = 0.0
        here[j] = 0.0
        above[j] = 0.0
        load[j] = 0.0
        m, f = wrench[j, :3], wrench[j, 3:]
        at0 = m[0] - (p[1] * f[2] - p[2] * f[1])
        at1 = m[1] - (p[2] * f[0] - p[0] * f[2])
        at2 = m[2] - (p[0] * f[1] - p[1] * f[0])
        for i in range(3):
            end[i] = R[0, i] * at0 + R[1, i] * at1 + R[2, i] * at2
            end[3 + i] = R[0, i] * f[0] + R[1, i] * f[1] + R[2, i] * f[2]
            residual[j, i] -= end[i]
            residual[j, 3 + i] -= end[3 + i]
        for c in range(6):
            t0, t1, t2 = turn_slope[j, 0, c], turn_slope[j, 1, c], turn_slope[j, 2, c]
            s0, s1, s2 = shift_slope[j, 0, c], shift_slope[j, 1, c], shift_slope[j, 2, c]
            q0 = -(s1 * f[2] - s2 * f[1])
            q1 = -(s2 * f[0] - s0 * f[2])
            q2 = -(s0 * f[1] - s1 * f[0])
            g0 = g1 = g2 = 0.0
            if c == 0:
                q0 += 1.0
            elif c == 1:
                q1 += 1.0
            elif c == 2:
                q2 += 1.0
            elif c == 3:
                g0 = 1.0
                q1 -= p[2]
                q2 += p[1]
            elif c == 4:
                g1 = 1.0
                q2 -= p[0]
                q0 += p[2]
            else:
                g2 = 1.0
                q0 -= p[1]
                q1 += p[0]
            turned0, turned1, turned2 = t1 * end[2] - t2 * end[1], t2 * end[0] - t0 * end[2], 0.0
            turned2 = t0 * end[1] - t1 * end[0]
            here[j, 0, c] = turned0 - (R[0, 0] * q0 + R[1, 0] * q1 + R[2, 0] * q2)
            here[j, 1, c] = turned1 - (R[0, 1] * q0 + R[1, 1] * q1 + R[2, 1] * q2)
            here[j, 2, c] = turned2 - (R[0, 2] * q0 + R[1, 2] * q1 + R[2, 2] * q2)
            here[j, 3, c] = t1 * end[5] - t2 * end[4] - (R[0, 0] * g0 + R[1, 0] * g1 + R[2, 0] * g2)
            here[j, 4, c] = t2 * end[3] - t0 * end[5] - (R[0, 1] * g0 + R[1, 1] * g1 + R[2, 1] * g2)
            here[j, 5, c] = t0 * end[4] - t1 * end[3] - (R[0, 2] * g0 + R[1, 2] * g1 + R[2, 2] * g2)
        if j + 1 < n:
            for i in range(6):
                residual[j, i] += wrench[j + 1, i]
                above[j, i, i] += 1.0
        # Loads that keep their direction: R^T F turns by F_body x (turn of the disk).
        body_moment = R_w[j + 1].T @ moment[j]
        body_force = R_w[j + 1].T @ force[j]
        residual[j, :3] += body_moment
        residual[j, 3:] += body_force
        _cross_matrix(body_moment, square)
        load[j, :3] = square
        _cross_matrix(body_force, square)
        load[j, 3:] = square
        if path == CONTINUOUS:
            continue
        for k in range(tendons):
            below, beyond = span[k, j], span[k, j + 1] if j + 1 < n else 0.0
            x, y = hole[k, 0], hole[k, 1]
            both = 0.0
            if path == PROJECTED and beyond > 0.0:
                both = 0.5 * (below + beyond)
            if below > 0.0:
                # Hole of disk j in the frame of disk j + 1: R^T (r - p), less r.
                a0, a1, a2 = x - p[0], y - p[1], -p[2]
                for i in range(3):
                    across[i] = R[0, i] * a0 + R[1, i] * a1 + R[2, i] * a2
                b0, b1, b2 = across[0], across[1], across[2]
                across[0] -= x
                across[1] -= y
                for c in range(6):
                    t0, t1, t2 = turn_slope[j, 0, c], turn_slope[j, 1, c], turn_slope[j, 2, c]
                    s0, s1, s2 = shift_slope[j, 0, c], shift_slope[j, 1, c], shift_slope[j, 2, c]
                    slope[0, c] = -(R[0, 0] * s0 + R[1, 0] * s1 + R[2, 0] * s2) - (t1 * b2 - t2 * b1)
                    slope[1, c] = -(R[0, 1] * s0 + R[1, 1] * s1 + R[2, 1] * s2) - (t2 * b0 - t0 * b2)
                    slope[2, c] = -(R[0, 2] * s0 + R[1, 2] * s1 + R[2, 2] * s2) - (t0 * b1 - t1 * b0)
                _pull(below, across, slope, hole[k], both, residual[j], here[j])
            if beyond > 0.0:
                Q, q = turn[j + 1], shift[j + 1]
                for i in range(3):
                    across[i] = Q[i, 0] * x + Q[i, 1] * y + q[i]
                across[0] -= x
                across[1] -= y
                for c in range(6):
                    t0, t1, t2 = (
                        turn_slope[j + 1, 0, c],
                        turn_slope[j + 1, 1, c],
                        turn_slope[j + 1, 2, c],
                    )
                    c0, c1, c2 = -t2 * y, t2 * x, t0 * y - t1 * x  # turn x hole
                    for i in range(3):
                        slope[i, c] = Q[i, 0] * c0 + Q[i, 1] * c1 + Q[i, 2] * c2 + shift_slope[j + 1, i, c]
                _pull(beyond, across, slope, hole[k], both, residual[j], above[j])


@compiled
def _correction(
    turn: Array, turn_slope: Array, residual: Array, here: Array, above: Array, load: Array, step: Array
) -> bool:
    """Newton's correction of the wrenches, `step` (n, 6); returns False where the system is singular."""
    n = len(residual)
    by_tip = np.zeros((n + 1, 6, 4))  # corrections: without the tip's turn, and by each of its components
    disk = np.zeros((3, 4))  # the disk's turn in its own frame, in the same way
    disk[0, 1] = disk[1, 2] = disk[2, 3] = 1.0
    matrix = np.empty((6, 6))
    right = np.empty((6, 4))
    for j in range(n - 1, -1, -1):
        for i in range(6):
            for c in range(4):
                total = 0.0
                for k in range(6):
                    total -= above[j, i, k] * by_tip[j + 1, k, c]
                for k in range(3):
                    total -= load[j, i, k] * disk[k, c]
                right[i, c] = total
            right[i, 0] -= residual[j, i]
            for k in range(6):
                matrix[i, k] = here[j, i, k]
        if not solve_in_place(matrix, right):
            return False
        by_tip[j] = right
        disk = turn[j] @ (disk - turn_slope[j] @ right)
    last = np.empty((3, 3))
    tip = np.empty((3, 1))
    for i in range(3):
        tip[i, 0] = -disk[i, 0]
        for c in range(3):
            last[i, c] = disk[i, 1 + c]
    if not solve_in_place(last, tip):
        return False
    for j in range(n):
        for i in range(6):
            step[j, i] = by_tip[j, i, 0]
            for c in range(3):
                step[j, i] += by_tip[j, i, 1 + c] * tip[c, 0]
    return True


@compiled
def newton(
    path: int,
    rod: Array,
    hole: Array,
    span: Array,
    force: Array,
    moment: Array,
    wrench: Array,
    turn: Array,
    shift: Array,
    R_w: Array,
    tolerance: float,
    residual: Array,
) -> tuple[int, int, float]:
    """Balance a robot at given tensions, starting from `wrench`, which is the result too.

    Args:
        path: CONTINUOUS, PROJECTED or EYELETS.
        rod: sections' data, shape (n, 8).
        hole: shape (t, 2) [m].
        span: tension of every tendon along every section, zero beyond its end, shape (t, n) [N].
        force, moment: on disks 1 to n, base frame, shape (n, 3).
        wrench: at the sections' starts, in their frames, shape (n, 6).
        turn, shift: result, the sections' poses, shapes (n, 3, 3) and (n, 3).
        R_w: result, orientations of disks 0 to n, shape (n + 1, 3, 3); the first one is given.
        tolerance: of the last correction, turns of the sections, summed [rad].
        residual: result, unbalanced wrench at disks 1 to n, shape (n, 6).

    Returns:
        How it ended, the number of corrections, and what the first one turned the sections by [rad].
    """
    n = len(rod)
    turn_slope, shift_slope = np.empty((n, 3, 6)), np.empty((n, 3, 6))
    here, above, load = np.empty((n, 6, 6)), np.empty((n, 6, 6)), np.empty((n, 6, 3))
    step = np.empty((n, 6))
    size = 0.0
    for j in range(n):
        size += rod[j, 6]
    before = largest = math.inf
    rounds = 0
    first = 0.0
    while True:
        _balance(
            path, rod, hole, span, force, moment, wrench, turn, shift, turn_slope, shift_slope,
            R_w, residual, here, above, load,
        )  # fmt: skip
        now = 0.0
        for j in range(n):
            for i in range(3):
                now = max(now, abs(residual[j, i]), size * abs(residual[j, 3 + i]))
        if not math.isfinite(now):
            return DIVERGED, rounds, first
        if largest < tolerance or now == 0.0:
            return CONVERGED, rounds, first
        if rounds >= _MOST_ROUNDS or (rounds > 1 and now > _WORSE * before):
            return DIVERGED, rounds, first
        before = now
        if not _correction(turn, turn_slope, residual, here, above, load, step):
            return SINGULAR, rounds, first
        rounds += 1
        largest = 0.0
        for j in range(n):
            square = 0.0
            for i in range(3):
                turned = 0.0
                for c in range(6):
                    turned += turn_slope[j, i, c] * step[j, c]
                square += turned * turned
            largest += math.sqrt(square)
        if rounds == 1:
            first = largest
        if not largest < FARTHEST_TURN_RAD:
            return TOO_FAR, rounds, first
        for j in range(n):
            for i in range(6):
                wrench[j, i] += step[j, i]
