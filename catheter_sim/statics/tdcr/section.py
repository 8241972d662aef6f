"""One stretch of a Cosserat rod in compiled form: from the wrench at its start to where it ends.

A rod of constant stiffness that only forces at its ends load (Rao et al. 2021, doi
10.3389/frobt.2020.603245, Eqs 2-3, 34-37 and, without f and l, 38-39). In the frame of its start
the force stays n and the moment is m - p x n, so that the pose (R, p) alone is integrated, by
Runge-Kutta's fourth-order rule, together with its derivative by the wrench.

Where tendons run along the whole stretch (fully constrained paths) the wrench is that of the rod
and of its tendons together. The tendons' own share, T_k t_k along the unit tangents
t_k ~ v + u x r_k of Eq. 27, then belongs to the elastic law: it is the derivative of
sum T_k |v + u x r_k|, convex in the strains as the rod's energy is, so that each wrench belongs to
one strain. Their distributed force (Eq. 28, with p'' for the p' that is printed in its second
place) and the forces where they end (Eqs 24-25) are then inside the stretch and balance by
themselves.

Strains are (u, v - e_z), wrenches (moment, force), six numbers in this order, in the body's frame.
A compliance of zero locks a strain.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from catheter_sim.robots.posture import Array

# Columns of `rod`, the sections' data: six compliances, then the length and the number of steps.
LENGTH, STEPS = 6, 7
_STRAIN_ROUNDS = 30
_STRAIN_TOLERANCE = 1e-13  # of a strain times a length: a Newton step below it is the last


def compiled(function: Callable[..., Any]) -> Any:
    """Return `function` compiled, kept on disk where there is a folder for it."""
    try:
        return numba.njit(cache=True, error_model="numpy")(function)
    except RuntimeError:  # neither beside this file nor in the user's own cache
        return numba.njit(error_model="numpy")(function)


@compiled
def solve_in_place(matrix: Array, right: Array) -> bool:
    """Solve matrix @ x = right by elimination with row pivoting; x replaces `right`, shape (m, c).

    Returns False where the matrix is singular.
    """
    size, columns = right.shape
    for i in range(size):
        best = i
        for k in range(i + 1, size):
            if abs(matrix[k, i]) > abs(matrix[best, i]):
                best = k
        if not abs(matrix[best, i]) > 0.0:
            return False
        if best != i:
            for j in range(size):
                matrix[i, j], matrix[best, j] = matrix[best, j], matrix[i, j]
            for j in range(columns):
                right[i, j], right[best, j] = right[best, j], right[i, j]
        for k in range(i + 1, size):
            factor = matrix[k, i] / matrix[i, i]
            if factor != 0.0:
                for j in range(i + 1, size):
                    matrix[k, j] -= factor * matrix[i, j]
                for j in range(columns):
                    right[k, j] -= factor * right[i, j]
    for i in range(size - 1, -1, -1):
        for j in range(columns):
            total = right[i, j]
            for k in range(i + 1, size):
                total -= matrix[i, k] * right[k, j]
            right[i, j] = total / matrix[i, i]
    return True


@compiled
def strain_of(
    compliance: Array, hole: Array, tension: Array, wrench: Array, strain: Array, stiffness: Array
) -> None:
    """Find the strain under a wrench, starting from `strain`, with its stiffness there.

    Args:
        compliance: shape (>= 6,); zero locks a strain.
        hole: of the tendons along the stretch, shape (t, 2) [m].
        tension: of each; zero where it does not run here, shape (t,) [N].
        wrench: of the rod and these tendons together, shape (6,).
        strain: start and result, shape (6,).
        stiffness: derivative of the wrench by the strain, shape (6, 6), result; a locked strain has 1
            on the diagonal and 0 elsewhere.
    """
    right = np.empty((6, 1))
    matrix = np.empty((6, 6))
    gradient = np.empty(6)
    tangent = np.empty((3, 6))
    for _ in range(_STRAIN_ROUNDS):
        for i in range(6):
            for j in range(6):
                stiffness[i, j] = 0.0
            if compliance[i] > 0.0:
                stiffness[i, i] = 1.0 / compliance[i]
                gradient[i] = strain[i] / compliance[i] - wrench[i]
            else:
                strain[i] = 0.0
                gradient[i] = 0.0
        for k in range(len(tension)):
            if tension[k] == 0.0:
                continue
            x, y = hole[k, 0], hole[k, 1]
            gx = strain[3] - strain[2] * y
            gy = strain[4] + strain[2] * x
            gz = 1.0 + strain[5] + strain[0] * y - strain[1] * x
            length = math.sqrt(gx * gx + gy * gy + gz * gz)
            gx, gy, gz = gx / length, gy / length, gz / length
            # Rows of `tangent`: derivative of the path's direction by the strains, times its length.
            for i in range(3):
                for j in range(6):
                    tangent[i, j] = 0.0
                tangent[i, 3 + i] = 1.0
            tangent[0, 2], tangent[1, 2], tangent[2, 0], tangent[2, 1] = -y, x, y, -x
            for j in range(6):
                along = gx * tangent[0, j] + gy * tangent[1, j] + gz * tangent[2, j]
                if compliance[j] > 0.0:
                    gradient[j] += tension[k] * along
                    for i in range(6):
                        if compliance[i] > 0.0:
                            other = gx * tangent[0, i] + gy * tangent[1, i] + gz * tangent[2, i]
                            product = (
                                tangent[0, i] * tangent[0, j]
                                + tangent[1, i] * tangent[1, j]
                                + tangent[2, i] * tangent[2, j]
                            )
                            stiffness[i, j] += tension[k] / length * (product - other * along)
        for i in range(6):
            if compliance[i] == 0.0:
                stiffness[i, i] = 1.0
            right[i, 0] = -gradient[i]
            for j in range(6):
                matrix[i, j] = stiffness[i, j]
        if not solve_in_place(matrix, right):
            return
        largest = 0.0
        for i in range(6):
            strain[i] += right[i, 0]
            largest = max(largest, abs(right[i, 0]))
        if largest < _STRAIN_TOLERANCE:
            return


@compiled
def _rates(
    compliance: Array,
    hole: Array,
    tension: Array,
    along: bool,
    wrench: Array,
    state: Array,
    rate: Array,
    strain: Array,
    stiffness: Array,
    columns: Array,
    body: Array,
) -> None:
    """Derivative along the rod of `state`: quaternion (4), position (3), then both pose derivatives.

    The pose's derivatives by the wrench are the turn in the body's frame, `state[7:25]` as (3, 6), and
    the shift in the start's frame, `state[25:43]`. `strain` is the start and the result of the law.
    """
    w, x, y, z = state[0], state[1], state[2], state[3]
    r00, r01, r02 = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
    r10, r11, r12 = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
    r20, r21, r22 = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
    px, py, pz = state[4], state[5], state[6]
    nx, ny, nz = wrench[3], wrench[4], wrench[5]
    mx = wrench[0] - (py * nz - pz * ny)
    my = wrench[1] - (pz * nx - px * nz)
    mz = wrench[2] - (px * ny - py * nx)
    body[0] = r00 * mx + r10 * my + r20 * mz
    body[1] = r01 * mx + r11 * my + r21 * mz
    body[2] = r02 * mx + r12 * my + r22 * mz
    body[3] = r00 * nx + r10 * ny + r20 * nz
    body[4] = r01 * nx + r11 * ny + r21 * nz
    body[5] = r02 * nx + r12 * ny + r22 * nz
    for c in range(6):
        tx, ty, tz = state[7 + c], state[13 + c], state[19 + c]
        dx, dy, dz = state[25 + c], state[31 + c], state[37 + c]
        # Change of the moment in the start's frame: dm - dp x n - p x dn.
        qx, qy, qz = -(dy * nz - dz * ny), -(dz * nx - dx * nz), -(dx * ny - dy * nx)
        fx = fy = fz = 0.0
        if c == 0:
            qx += 1.0
        elif c == 1:
            qy += 1.0
        elif c == 2:
            qz += 1.0
        elif c == 3:
            fx = 1.0
            qy -= pz
            qz += py
        elif c == 4:
            fy = 1.0
            qz -= px
            qx += pz
        else:
            fz = 1.0
            qx -= py
            qy += px
        columns[0, c] = r00 * qx + r10 * qy + r20 * qz - (ty * body[2] - tz * body[1])
        columns[1, c] = r01 * qx + r11 * qy + r21 * qz - (tz * body[0] - tx * body[2])
        columns[2, c] = r02 * qx + r12 * qy + r22 * qz - (tx * body[1] - ty * body[0])
        columns[3, c] = r00 * fx + r10 * fy + r20 * fz - (ty * body[5] - tz * body[4])
        columns[4, c] = r01 * fx + r11 * fy + r21 * fz - (tz * body[3] - tx * body[5])
        columns[5, c] = r02 * fx + r12 * fy + r22 * fz - (tx * body[4] - ty * body[3])
    if along:
        strain_of(compliance, hole, tension, body, strain, stiffness)
        for i in range(6):
            if compliance[i] == 0.0:
                for c in range(6):
                    columns[i, c] = 0.0
        solve_in_place(stiffness, columns)
    else:
        for i in range(6):
            strain[i] = compliance[i] * body[i]
            for c in range(6):
                columns[i, c] *= compliance[i]
    ux, uy, uz = strain[0], strain[1], strain[2]
    vx, vy, vz = strain[3], strain[4], 1.0 + strain[5]
    rate[0] = 0.5 * (-x * ux - y * uy - z * uz)
    rate[1] = 0.5 * (w * ux + y * uz - z * uy)
    rate[2] = 0.5 * (w * uy + z * ux - x * uz)
    rate[3] = 0.5 * (w * uz + x * uy - y * ux)
    rate[4] = r00 * vx + r01 * vy + r02 * vz
    rate[5] = r10 * vx + r11 * vy + r12 * vz
    rate[6] = r20 * vx + r21 * vy + r22 * vz
    for c in range(6):
        tx, ty, tz = state[7 + c], state[13 + c], state[19 + c]
        rate[7 + c] = columns[0, c] - (uy * tz - uz * ty)
        rate[13 + c] = columns[1, c] - (uz * tx - ux * tz)
        rate[19 + c] = columns[2, c] - (ux * ty - uy * tx)
        sx = columns[3, c] + ty * vz - tz * vy
        sy = columns[4, c] + tz * vx - tx * vz
        sz = columns[5, c] + tx * vy - ty * vx
        rate[25 + c] = r00 * sx + r01 * sy + r02 * sz
        rate[31 + c] = r10 * sx + r11 * sy + r12 * sz
        rate[37 + c] = r20 * sx + r21 * sy + r22 * sz


@compiled
def cross_section(
    rod: Array,
    hole: Array,
    tension: Array,
    wrench: Array,
    turn: Array,
    shift: Array,
    turn_slope: Array,
    shift_slope: Array,
) -> None:
    """Integrate one stretch from its start to its end.

    Args:
        rod: six compliances, length, number of steps, shape (8,).
        hole: shape (t, 2) [m].
        tension: of the tendons that run along the stretch and belong to the wrench, shape (t,) [N].
        wrench: at the start, in the frame of the start, shape (6,).
        turn, shift: result, the end's pose in the frame of the start, shapes (3, 3) and (3,).
        turn_slope: result, turn of the end in its own frame by the wrench, shape (3, 6).
        shift_slope: result, shift of the end in the frame of the start by the wrench, shape (3, 6).
    """
    steps = int(rod[STEPS])
    h = rod[LENGTH] / steps
    along = False
    for k in range(len(tension)):
        along = along or tension[k] != 0.0
    state, trial, total = np.zeros(43), np.empty(43), np.empty(43)
    rate = np.empty(43)
    strain, body = np.zeros(6), np.empty(6)
    stiffness, columns = np.empty((6, 6)), np.empty((6, 6))
    state[0] = 1.0
    for _ in range(steps):
        _rates(rod, hole, tension, along, wrench, state, rate, strain, stiffness, columns, body)
        for i in range(43):
            total[i] = rate[i]
            trial[i] = state[i] + 0.5 * h * rate[i]
        _rates(rod, hole, tension, along, wrench, trial, rate, strain, stiffness, columns, body)
        for i in range(43):
            total[i] += 2.0 * rate[i]
            trial[i] = state[i] + 0.5 * h * rate[i]
        _rates(rod, hole, tension, along, wrench, trial, rate, strain, stiffness, columns, body)
        for i in range(43):
            total[i] += 2.0 * rate[i]
            trial[i] = state[i] + h * rate[i]
        _rates(rod, hole, tension, along, wrench, trial, rate, strain, stiffness, columns, body)
        for i in range(43):
            state[i] += h / 6.0 * (total[i] + rate[i])
        norm = math.sqrt(state[0] ** 2 + state[1] ** 2 + state[2] ** 2 + state[3] ** 2)
        for i in range(4):
            state[i] /= norm
    w, x, y, z = state[0], state[1], state[2], state[3]
    turn[0, 0], turn[0, 1], turn[0, 2] = (
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
    )
    turn[1, 0], turn[1, 1], turn[1, 2] = (
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
    )
    turn[2, 0], turn[2, 1], turn[2, 2] = (
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    )
    for i in range(3):
        shift[i] = state[4 + i]
        for c in range(6):
            turn_slope[i, c] = state[7 + 6 * i + c]
            shift_slope[i, c] = state[25 + 6 * i + c]
