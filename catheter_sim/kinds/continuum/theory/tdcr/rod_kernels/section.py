"""A section, the rod between two disks, integrated from its start to its end, compiled.

Only forces at its ends load it (Rao et al. 2021, doi 10.3389/frobt.2020.603245, Eqs 2-3, 34-37 and, without
f and l, 38-39): in the frame of its start the force stays n and the moment is m - p x n, so that the pose
(R, p) alone is integrated, by Runge-Kutta's fourth-order rule, where wanted together with its derivative by
the wrench. `w` is the workspace of `lanes`.
"""

from __future__ import annotations

import math

from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.lanes import (
    BODY,
    COLUMNS,
    COMPLIANCE,
    INVERSE,
    LANES,
    RATE,
    SIZE,
    STATE,
    STEP,
    STIFFNESS,
    STRAIN,
    TENDONS,
    TOTAL,
    TRIAL,
    TURN,
    WRENCH,
    column,
    three,
)
from catheter_sim.mechanics.arrays import Array
from catheter_sim.mechanics.compiled import compiled

_ROUNDS = 40
_TOLERANCE = 1e-10


@compiled
def set_body_wrenches(w: Array, columns: int) -> None:
    """Set orientation and wrench of the trial in the body's frame, and the wrench's derivative."""
    for i in range(LANES):
        a, x, y, z = (
            w[TRIAL * LANES + i],
            w[(TRIAL + 1) * LANES + i],
            w[(TRIAL + 2) * LANES + i],
            w[(TRIAL + 3) * LANES + i],
        )
        r00, r01, r02 = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - a * z), 2.0 * (x * z + a * y)
        r10, r11, r12 = 2.0 * (x * y + a * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - a * x)
        r20, r21, r22 = 2.0 * (x * z - a * y), 2.0 * (y * z + a * x), 1.0 - 2.0 * (x * x + y * y)
        w[TURN * LANES + i], w[(TURN + 1) * LANES + i], w[(TURN + 2) * LANES + i] = r00, r01, r02
        w[(TURN + 3) * LANES + i], w[(TURN + 4) * LANES + i], w[(TURN + 5) * LANES + i] = r10, r11, r12
        w[(TURN + 6) * LANES + i], w[(TURN + 7) * LANES + i], w[(TURN + 8) * LANES + i] = r20, r21, r22
        px, py, pz = three(w, TRIAL + 4, i)
        nx, ny, nz = three(w, WRENCH + 3, i)
        mx = w[WRENCH * LANES + i] - (py * nz - pz * ny)
        my = w[(WRENCH + 1) * LANES + i] - (pz * nx - px * nz)
        mz = w[(WRENCH + 2) * LANES + i] - (px * ny - py * nx)
        w[BODY * LANES + i] = r00 * mx + r10 * my + r20 * mz
        w[(BODY + 1) * LANES + i] = r01 * mx + r11 * my + r21 * mz
        w[(BODY + 2) * LANES + i] = r02 * mx + r12 * my + r22 * mz
        w[(BODY + 3) * LANES + i] = r00 * nx + r10 * ny + r20 * nz
        w[(BODY + 4) * LANES + i] = r01 * nx + r11 * ny + r21 * nz
        w[(BODY + 5) * LANES + i] = r02 * nx + r12 * ny + r22 * nz
    for c in range(columns):
        mx, my, mz = (1.0 if c == 0 else 0.0), (1.0 if c == 1 else 0.0), (1.0 if c == 2 else 0.0)
        fx, fy, fz = (1.0 if c == 3 else 0.0), (1.0 if c == 4 else 0.0), (1.0 if c == 5 else 0.0)
        for i in range(LANES):
            o = c * LANES + i
            tx, ty, tz = column(w, TRIAL + 7, o)
            dx, dy, dz = column(w, TRIAL + 25, o)
            px, py, pz = three(w, TRIAL + 4, i)
            nx, ny, nz = three(w, WRENCH + 3, i)
            # Change of the moment in the start's frame: dm - dp x n - p x dn.
            qx = mx - (dy * nz - dz * ny) - (py * fz - pz * fy)
            qy = my - (dz * nx - dx * nz) - (pz * fx - px * fz)
            qz = mz - (dx * ny - dy * nx) - (px * fy - py * fx)
            r00, r01, r02 = three(w, TURN, i)
            r10, r11, r12 = three(w, TURN + 3, i)
            r20, r21, r22 = three(w, TURN + 6, i)
            b0, b1, b2 = three(w, BODY, i)
            b3, b4, b5 = three(w, BODY + 3, i)
            w[COLUMNS * LANES + o] = r00 * qx + r10 * qy + r20 * qz - (ty * b2 - tz * b1)
            w[(COLUMNS + 6) * LANES + o] = r01 * qx + r11 * qy + r21 * qz - (tz * b0 - tx * b2)
            w[(COLUMNS + 12) * LANES + o] = r02 * qx + r12 * qy + r22 * qz - (tx * b1 - ty * b0)
            w[(COLUMNS + 18) * LANES + o] = r00 * fx + r10 * fy + r20 * fz - (ty * b5 - tz * b4)
            w[(COLUMNS + 24) * LANES + o] = r01 * fx + r11 * fy + r21 * fz - (tz * b3 - tx * b5)
            w[(COLUMNS + 30) * LANES + o] = r02 * fx + r12 * fy + r22 * fz - (tx * b4 - ty * b3)


@compiled
def _set_strains(w: Array, hole: Array, along: bool, columns: int) -> None:
    """Set the strains of the body's wrench and, in place, their derivative.

    With tendons along the sections the strains are corrected by a fixed inverse until they balance.
    """
    if not along:
        for o in range(6 * LANES):
            w[STRAIN * LANES + o] = w[COMPLIANCE * LANES + o] * w[BODY * LANES + o]
        for row in range(columns):
            for c in range(columns):
                for i in range(LANES):
                    w[(COLUMNS + 6 * row + c) * LANES + i] *= w[(COMPLIANCE + row) * LANES + i]
        return
    for _ in range(_ROUNDS):
        for o in range(6 * LANES):
            w[RATE * LANES + o] = (
                w[STRAIN * LANES + o] * w[STIFFNESS * LANES + o] - w[BODY * LANES + o]
            )  # gradient
        for k in range(len(hole)):
            x, y = hole[k, 0], hole[k, 1]
            for i in range(LANES):
                gx = w[(STRAIN + 3) * LANES + i] - w[(STRAIN + 2) * LANES + i] * y
                gy = w[(STRAIN + 4) * LANES + i] + w[(STRAIN + 2) * LANES + i] * x
                gz = 1.0 + w[(STRAIN + 5) * LANES + i]
                gz += w[STRAIN * LANES + i] * y - w[(STRAIN + 1) * LANES + i] * x
                pull = w[(TENDONS + 3 * k) * LANES + i] / math.sqrt(gx * gx + gy * gy + gz * gz)
                gx, gy, gz = gx * pull, gy * pull, gz * pull
                w[RATE * LANES + i] += y * gz
                w[(RATE + 1) * LANES + i] -= x * gz
                w[(RATE + 2) * LANES + i] += x * gy - y * gx
                w[(RATE + 3) * LANES + i] += gx
                w[(RATE + 4) * LANES + i] += gy
                w[(RATE + 5) * LANES + i] += gz
        for o in range(6 * LANES):
            w[(RATE + 6) * LANES + o] = 0.0
        for row in range(6):
            for c in range(6):
                for i in range(LANES):
                    w[(RATE + 6 + row) * LANES + i] += (
                        w[(INVERSE + 6 * row + c) * LANES + i] * w[(RATE + c) * LANES + i]
                    )
        for i in range(LANES):
            w[(RATE + 12) * LANES + i] = 0.0
        for row in range(6):
            for i in range(LANES):
                change = w[(RATE + 6 + row) * LANES + i]
                w[(STRAIN + row) * LANES + i] -= change
                w[(RATE + 12) * LANES + i] = max(w[(RATE + 12) * LANES + i], abs(change))
        largest = 0.0
        for i in range(LANES):
            largest = max(largest, w[(RATE + 12) * LANES + i])
        if largest < _TOLERANCE:
            break
    for c in range(columns):
        for row in range(columns):
            for i in range(LANES):
                w[(RATE + row) * LANES + i] = 0.0
            for k in range(columns):
                for i in range(LANES):
                    w[(RATE + row) * LANES + i] += (
                        w[(INVERSE + 6 * row + k) * LANES + i] * w[(COLUMNS + 6 * k + c) * LANES + i]
                    )
        for row in range(columns):
            for i in range(LANES):
                w[(COLUMNS + 6 * row + c) * LANES + i] = w[(RATE + row) * LANES + i]


@compiled
def _rates(w: Array, hole: Array, along: bool, columns: int) -> None:
    """Set the trial's derivative along the rod."""
    set_body_wrenches(w, columns)
    _set_strains(w, hole, along, columns)
    for i in range(LANES):
        a, x, y, z = (
            w[TRIAL * LANES + i],
            w[(TRIAL + 1) * LANES + i],
            w[(TRIAL + 2) * LANES + i],
            w[(TRIAL + 3) * LANES + i],
        )
        ux, uy, uz = three(w, STRAIN, i)
        vx, vy, vz = (
            w[(STRAIN + 3) * LANES + i],
            w[(STRAIN + 4) * LANES + i],
            1.0 + w[(STRAIN + 5) * LANES + i],
        )
        w[RATE * LANES + i] = 0.5 * (-x * ux - y * uy - z * uz)
        w[(RATE + 1) * LANES + i] = 0.5 * (a * ux + y * uz - z * uy)
        w[(RATE + 2) * LANES + i] = 0.5 * (a * uy + z * ux - x * uz)
        w[(RATE + 3) * LANES + i] = 0.5 * (a * uz + x * uy - y * ux)
        for row in range(3):
            w[(RATE + 4 + row) * LANES + i] = (
                w[(TURN + 3 * row) * LANES + i] * vx
                + w[(TURN + 3 * row + 1) * LANES + i] * vy
                + w[(TURN + 3 * row + 2) * LANES + i] * vz
            )
    for c in range(columns):
        for i in range(LANES):
            o = c * LANES + i
            ux, uy, uz = three(w, STRAIN, i)
            vx, vy, vz = (
                w[(STRAIN + 3) * LANES + i],
                w[(STRAIN + 4) * LANES + i],
                1.0 + w[(STRAIN + 5) * LANES + i],
            )
            tx, ty, tz = column(w, TRIAL + 7, o)
            w[(RATE + 7) * LANES + o] = w[COLUMNS * LANES + o] - (uy * tz - uz * ty)
            w[(RATE + 13) * LANES + o] = w[(COLUMNS + 6) * LANES + o] - (uz * tx - ux * tz)
            w[(RATE + 19) * LANES + o] = w[(COLUMNS + 12) * LANES + o] - (ux * ty - uy * tx)
            sx = w[(COLUMNS + 18) * LANES + o] + ty * vz - tz * vy
            sy = w[(COLUMNS + 24) * LANES + o] + tz * vx - tx * vz
            sz = w[(COLUMNS + 30) * LANES + o] + tx * vy - ty * vx
            for row in range(3):
                w[(RATE + 25 + 6 * row) * LANES + o] = (
                    w[(TURN + 3 * row) * LANES + i] * sx
                    + w[(TURN + 3 * row + 1) * LANES + i] * sy
                    + w[(TURN + 3 * row + 2) * LANES + i] * sz
                )


@compiled
def integrate(w: Array, hole: Array, steps: int, along: bool, columns: int) -> None:
    """Integrate the workspace's sections from their starts to their ends; the end is the trial, too."""
    size = 7 + 6 * columns
    for o in range(SIZE * LANES):
        w[STATE * LANES + o] = 0.0
    for i in range(LANES):
        w[STATE * LANES + i] = 1.0
    for o in range(size * LANES):
        w[TRIAL * LANES + o] = w[STATE * LANES + o]
    for _ in range(steps):
        for stage in range(4):
            _rates(w, hole, along, columns)
            weight = 2.0 if stage in (1, 2) else 1.0
            keep = 0.0 if stage == 0 else 1.0
            ahead = 1.0 if stage == 2 else 0.5
            if stage < 3:
                for slot in range(size):
                    for i in range(LANES):
                        o = slot * LANES + i
                        rate = w[RATE * LANES + o]
                        w[TOTAL * LANES + o] = keep * w[TOTAL * LANES + o] + weight * rate
                        w[TRIAL * LANES + o] = w[STATE * LANES + o] + ahead * w[STEP * LANES + i] * rate
            else:
                for slot in range(size):
                    for i in range(LANES):
                        o = slot * LANES + i
                        w[STATE * LANES + o] += (
                            w[STEP * LANES + i] / 6.0 * (w[TOTAL * LANES + o] + w[RATE * LANES + o])
                        )
        for i in range(LANES):
            square = 0.0
            for q in range(4):
                square += w[(STATE + q) * LANES + i] * w[(STATE + q) * LANES + i]
            for q in range(4):
                w[(STATE + q) * LANES + i] /= math.sqrt(square)
        for o in range(size * LANES):
            w[TRIAL * LANES + o] = w[STATE * LANES + o]
