"""A section, the rod between two disks, integrated from its start to its end, compiled.

Only forces at its ends load it (Rao et al. 2021, doi 10.3389/frobt.2020.630245, Eqs 2-3, 34-37 and, without
f and l, 38-39): in the frame of its start the force stays n and the moment is m - p x n, so that the pose
(R, p) alone is integrated, by Runge-Kutta's fourth-order rule, where wanted together with its derivative by
the wrench. `w` is the workspace of `lanes`.
"""

from __future__ import annotations

import math

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.lanes import (
    BODY,
    COLUMNS,
    COMPLIANCE,
    INVERSE,
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
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.eight import all_less, larger

_ROUNDS = 40
_TOLERANCE = 1e-10


@compiled
def set_body_wrenches(w: Array, columns: int) -> None:
    """Set orientation and wrench of the trial in the body's frame, and the wrench's derivative."""
    a, x, y, z = (
        w[TRIAL],
        w[TRIAL + 1],
        w[TRIAL + 2],
        w[TRIAL + 3],
    )
    r00, r01, r02 = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - a * z), 2.0 * (x * z + a * y)
    r10, r11, r12 = 2.0 * (x * y + a * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - a * x)
    r20, r21, r22 = 2.0 * (x * z - a * y), 2.0 * (y * z + a * x), 1.0 - 2.0 * (x * x + y * y)
    w[TURN], w[TURN + 1], w[TURN + 2] = r00, r01, r02
    w[TURN + 3], w[TURN + 4], w[TURN + 5] = r10, r11, r12
    w[TURN + 6], w[TURN + 7], w[TURN + 8] = r20, r21, r22
    px, py, pz = three(w, TRIAL + 4)
    nx, ny, nz = three(w, WRENCH + 3)
    mx = w[WRENCH] - (py * nz - pz * ny)
    my = w[WRENCH + 1] - (pz * nx - px * nz)
    mz = w[WRENCH + 2] - (px * ny - py * nx)
    w[BODY] = r00 * mx + r10 * my + r20 * mz
    w[BODY + 1] = r01 * mx + r11 * my + r21 * mz
    w[BODY + 2] = r02 * mx + r12 * my + r22 * mz
    w[BODY + 3] = r00 * nx + r10 * ny + r20 * nz
    w[BODY + 4] = r01 * nx + r11 * ny + r21 * nz
    w[BODY + 5] = r02 * nx + r12 * ny + r22 * nz
    for c in range(columns):
        mx, my, mz = (1.0 if c == 0 else 0.0), (1.0 if c == 1 else 0.0), (1.0 if c == 2 else 0.0)
        fx, fy, fz = (1.0 if c == 3 else 0.0), (1.0 if c == 4 else 0.0), (1.0 if c == 5 else 0.0)
        tx, ty, tz = column(w, TRIAL + 7 + c)
        dx, dy, dz = column(w, TRIAL + 25 + c)
        px, py, pz = three(w, TRIAL + 4)
        nx, ny, nz = three(w, WRENCH + 3)
        # Change of the moment in the start's frame: dm - dp x n - p x dn.
        qx = mx - (dy * nz - dz * ny) - (py * fz - pz * fy)
        qy = my - (dz * nx - dx * nz) - (pz * fx - px * fz)
        qz = mz - (dx * ny - dy * nx) - (px * fy - py * fx)
        r00, r01, r02 = three(w, TURN)
        r10, r11, r12 = three(w, TURN + 3)
        r20, r21, r22 = three(w, TURN + 6)
        b0, b1, b2 = three(w, BODY)
        b3, b4, b5 = three(w, BODY + 3)
        w[COLUMNS + c] = r00 * qx + r10 * qy + r20 * qz - (ty * b2 - tz * b1)
        w[COLUMNS + 6 + c] = r01 * qx + r11 * qy + r21 * qz - (tz * b0 - tx * b2)
        w[COLUMNS + 12 + c] = r02 * qx + r12 * qy + r22 * qz - (tx * b1 - ty * b0)
        w[COLUMNS + 18 + c] = r00 * fx + r10 * fy + r20 * fz - (ty * b5 - tz * b4)
        w[COLUMNS + 24 + c] = r01 * fx + r11 * fy + r21 * fz - (tz * b3 - tx * b5)
        w[COLUMNS + 30 + c] = r02 * fx + r12 * fy + r22 * fz - (tx * b4 - ty * b3)


@compiled
def _set_strains(w: Array, hole: Array, along: bool, columns: int) -> None:
    """Set the strains of the body's wrench and, in place, their derivative.

    With tendons along the sections the strains are corrected by a fixed inverse until they balance.
    """
    if not along:
        for slot in range(6):
            w[STRAIN + slot] = w[COMPLIANCE + slot] * w[BODY + slot]
        for row in range(columns):
            for c in range(columns):
                w[COLUMNS + 6 * row + c] *= w[COMPLIANCE + row]
        return
    for _ in range(_ROUNDS):
        for slot in range(6):
            w[RATE + slot] = w[STRAIN + slot] * w[STIFFNESS + slot] - w[BODY + slot]  # gradient
        for k in range(len(hole)):
            x, y = hole[k, 0], hole[k, 1]
            gx = w[STRAIN + 3] - w[STRAIN + 2] * y
            gy = w[STRAIN + 4] + w[STRAIN + 2] * x
            gz = 1.0 + w[STRAIN + 5]
            gz += w[STRAIN] * y - w[STRAIN + 1] * x
            pull = w[TENDONS + 3 * k] / math.sqrt(gx * gx + gy * gy + gz * gz)
            gx, gy, gz = gx * pull, gy * pull, gz * pull
            w[RATE] += y * gz
            w[RATE + 1] -= x * gz
            w[RATE + 2] += x * gy - y * gx
            w[RATE + 3] += gx
            w[RATE + 4] += gy
            w[RATE + 5] += gz
        for slot in range(6):
            w[RATE + 6 + slot] = 0.0
        for row in range(6):
            for c in range(6):
                w[RATE + 6 + row] += w[INVERSE + 6 * row + c] * w[RATE + c]
        largest = 0.0 * w[RATE]
        for row in range(6):
            change = w[RATE + 6 + row]
            w[STRAIN + row] -= change
            largest = larger(largest, abs(change))
        if all_less(largest, _TOLERANCE):
            break
    for c in range(columns):
        for row in range(columns):
            w[RATE + row] = 0.0
            for k in range(columns):
                w[RATE + row] += w[INVERSE + 6 * row + k] * w[COLUMNS + 6 * k + c]
        for row in range(columns):
            w[COLUMNS + 6 * row + c] = w[RATE + row]


@compiled
def _rates(w: Array, hole: Array, along: bool, columns: int) -> None:
    """Set the trial's derivative along the rod."""
    set_body_wrenches(w, columns)
    _set_strains(w, hole, along, columns)
    a, x, y, z = (
        w[TRIAL],
        w[TRIAL + 1],
        w[TRIAL + 2],
        w[TRIAL + 3],
    )
    ux, uy, uz = three(w, STRAIN)
    vx, vy, vz = (
        w[STRAIN + 3],
        w[STRAIN + 4],
        1.0 + w[STRAIN + 5],
    )
    w[RATE] = 0.5 * (-x * ux - y * uy - z * uz)
    w[RATE + 1] = 0.5 * (a * ux + y * uz - z * uy)
    w[RATE + 2] = 0.5 * (a * uy + z * ux - x * uz)
    w[RATE + 3] = 0.5 * (a * uz + x * uy - y * ux)
    for row in range(3):
        w[RATE + 4 + row] = w[TURN + 3 * row] * vx + w[TURN + 3 * row + 1] * vy + w[TURN + 3 * row + 2] * vz
    for c in range(columns):
        ux, uy, uz = three(w, STRAIN)
        vx, vy, vz = (
            w[STRAIN + 3],
            w[STRAIN + 4],
            1.0 + w[STRAIN + 5],
        )
        tx, ty, tz = column(w, TRIAL + 7 + c)
        w[RATE + 7 + c] = w[COLUMNS + c] - (uy * tz - uz * ty)
        w[RATE + 13 + c] = w[COLUMNS + 6 + c] - (uz * tx - ux * tz)
        w[RATE + 19 + c] = w[COLUMNS + 12 + c] - (ux * ty - uy * tx)
        sx = w[COLUMNS + 18 + c] + ty * vz - tz * vy
        sy = w[COLUMNS + 24 + c] + tz * vx - tx * vz
        sz = w[COLUMNS + 30 + c] + tx * vy - ty * vx
        for row in range(3):
            w[RATE + 25 + 6 * row + c] = (
                w[TURN + 3 * row] * sx + w[TURN + 3 * row + 1] * sy + w[TURN + 3 * row + 2] * sz
            )


@compiled
def integrate(w: Array, hole: Array, steps: int, along: bool, columns: int) -> None:
    """Integrate the workspace's sections from their starts to their ends; the end is the trial, too."""
    size = 7 + 6 * columns
    for slot in range(SIZE):
        w[STATE + slot] = 0.0
    w[STATE] = 1.0
    for slot in range(size):
        w[TRIAL + slot] = w[STATE + slot]
    for _ in range(steps):
        for stage in range(4):
            _rates(w, hole, along, columns)
            weight = 2.0 if stage in (1, 2) else 1.0
            keep = 0.0 if stage == 0 else 1.0
            ahead = 1.0 if stage == 2 else 0.5
            if stage < 3:
                for slot in range(size):
                    rate = w[RATE + slot]
                    w[TOTAL + slot] = keep * w[TOTAL + slot] + weight * rate
                    w[TRIAL + slot] = w[STATE + slot] + ahead * w[STEP] * rate
            else:
                for slot in range(size):
                    w[STATE + slot] += w[STEP] / 6.0 * (w[TOTAL + slot] + w[RATE + slot])
        square = 0.0
        for q in range(4):
            square += w[STATE + q] * w[STATE + q]
        for q in range(4):
            w[STATE + q] /= math.sqrt(square)
        for slot in range(size):
            w[TRIAL + slot] = w[STATE + slot]
