"""Equilibria of a Cosserat rod with tendons in compiled form: sections, balance, continuation.

All compiled code is in this file: the compiled form is kept on disk and renewed when this file
changes, not when another does. `collocation` solves the same equations as they are printed, in plain
NumPy and SciPy; the tests hold the one to the other.

Sections. A section is the rod between two disks. Only forces at its ends load it (Rao et al. 2021,
doi 10.3389/frobt.2020.603245, Eqs 2-3, 34-37 and, without f and l, 38-39): in the frame of its start
the force stays n and the moment is m - p x n, so that the pose (R, p) alone is integrated, by
Runge-Kutta's fourth-order rule, together with its derivative by the wrench.

Where tendons run along the whole section (fully constrained paths) the wrench is that of the rod and
of its tendons together. The tendons' own share, T_k t_k along the unit tangents t_k ~ v + u x r_k of
Eq. 27, then belongs to the elastic law: it is the derivative of sum T_k |v + u x r_k|, convex in the
strains as the rod's energy is, so that each wrench belongs to one strain. The tendons' distributed
force (Eq. 28, with p'' for the p' printed in its second place) and the forces where they end
(Eqs 24-25) are then inside and balance by themselves. So do, on the path LUMENS, the forces of
passing tendons where the strains jump, and their paths' directions with them: at a segment's end and
at a loaded disk. Eqs 40-41 leave these forces out, and CONTINUOUS takes them away again.

Strains are (u, v - e_z), wrenches (moment, force), six numbers in this order, in the body's frame.
A compliance of zero locks a strain.

Balance. The unknowns are the wrenches at the sections' starts, each in the frame of its start, so that
a section's pose does not depend on where the robot has got to. What is left over at disk j, in the
disk's frame, is

    wrench at the start of section j + 1 - wrench at the end of section j + tendons + loads,

(Eqs 40-41) and depends on the two sections next to the disk and, through loads that keep their
direction in space, on the disk's orientation. One sweep from the tip solves the linear system: every
correction is linear in the tip's small turn, which the fixed base then gives.

Straight tendons pull the disks with the forces of Eqs 30-33, projected into the disk's plane by
Eq. 58 or not. Unprojected, a tendon of constant tension is in eyelets without friction. What Eq. 58
takes away is the part without friction only: a difference of the tensions at the two sides of a
hole stays.

Continuation. An equilibrium is followed from one load to another. The way is cut into steps that turn
the robot little; a step that fails, or that Newton's method takes with slow convergence, is halved.

Dry friction. The tensions are those of tendons that were pulled from rest to where they are: at each
hole, the base's included and the last one's not, they fall toward the tip by exp(-mu phi), phi the
angle that the tendon turns by (capstan). They follow from the posture and the posture from them,
in turns.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from catheter_sim.robots.posture import Array

# Columns of `rod`, the sections' data: six compliances, then the length and the number of steps.
LENGTH, STEPS = 6, 7
CONTINUOUS, PROJECTED, EYELETS, LUMENS = range(4)  # tendon paths
CONVERGED, SINGULAR, DIVERGED, TOO_FAR = range(4)  # how Newton's method ended

_STRAIN_ROUNDS = 30
_STRAIN_TOLERANCE = 1e-8  # a correction below it is the last: what it leaves is smaller than its square
_MOST_ROUNDS = 14
# A correction may be this share of the one before, unless both are small: otherwise the step was too long
# to be sure of the equilibrium that it finds.
_CONTRACTION = 0.5
_SMALL_TURN_RAD = 1e-7
# What one step may turn the sections by, summed [rad]: beyond it Newton's method may find another
# equilibrium than the one that the load leads to, or none.
_FARTHEST = 0.8
_NEAR = 0.2  # from a row to the next one
_ON_THE_WAY = 1e-3  # turn of the last correction before the end of the way [rad]
_AT_THE_END = 1e-10
_SHORTEST_STEP = 1.0 / 1024.0  # of the way from load to load
_FRICTION_ROUNDS = 100
_FRICTION_TOLERANCE = 1e-11  # change of the tensions, over the largest one


def _compiled(function: Callable[..., Any]) -> Any:
    """Return `function` compiled, kept on disk where there is a folder for it."""
    try:
        return numba.njit(cache=True, error_model="numpy")(function)
    except RuntimeError:  # neither beside this file nor in the user's own cache
        return numba.njit(error_model="numpy")(function)


@_compiled
def _solve_in_place(matrix: Array, right: Array) -> bool:
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


@_compiled
def _strain_of(
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
        if not _solve_in_place(matrix, right):
            return
        largest = 0.0
        for i in range(6):
            strain[i] += right[i, 0]
            largest = max(largest, abs(right[i, 0]))
        if largest < _STRAIN_TOLERANCE:
            return


@_compiled
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
        _strain_of(compliance, hole, tension, body, strain, stiffness)
        for i in range(6):
            if compliance[i] == 0.0:
                for c in range(6):
                    columns[i, c] = 0.0
        _solve_in_place(stiffness, columns)
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


@_compiled
def _cross_section(
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


@_compiled
def _turned(R: Array, a: Array, out: Array) -> None:
    """R a: array expressions would be shorter, and take LLVM ten times as long."""
    for i in range(3):
        out[i] = R[i, 0] * a[0] + R[i, 1] * a[1] + R[i, 2] * a[2]


@_compiled
def _turned_back(R: Array, a: Array, out: Array) -> None:
    """R^T a."""
    for i in range(3):
        out[i] = R[0, i] * a[0] + R[1, i] * a[1] + R[2, i] * a[2]


@_compiled
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


@_compiled
def _tangent(strain: Array, hole: Array, out: Array) -> None:
    """Direction v + u x r of a tendon's path along the rod (Rao 2021, Eq. 27)."""
    out[0] = strain[3] - strain[2] * hole[1]
    out[1] = strain[4] + strain[2] * hole[0]
    out[2] = 1.0 + strain[5] + strain[0] * hole[1] - strain[1] * hole[0]


@_compiled
def _add_directions(
    rod: Array, hole: Array, tension: Array, pull: Array, wrench: Array, result: Array, slope: Array
) -> None:
    """Add moment and force of `pull` along the continuous paths at a place; set their derivative.

    Args:
        rod: the section's data.
        hole: shape (t, 2) [m].
        tension: of the tendons there, which belong to `wrench`, shape (t,) [N].
        pull: of the forces, along the paths' tangents, shape (t,) [N].
        wrench: there, in the body's frame, shape (6,).
        result: shape (6,).
        slope: result, by the wrench, shape (6, 6).
    """
    strain, stiffness = np.zeros(6), np.empty((6, 6))
    _strain_of(rod, hole, tension, wrench, strain, stiffness)
    by_strain = np.zeros((6, 6))  # transposed
    tangent = np.empty(3)
    for k in range(len(hole)):
        if pull[k] == 0.0:
            continue
        x, y = hole[k, 0], hole[k, 1]
        _tangent(strain, hole[k], tangent)
        length = math.sqrt(tangent[0] ** 2 + tangent[1] ** 2 + tangent[2] ** 2)
        t0, t1, t2 = tangent[0] / length, tangent[1] / length, tangent[2] / length
        result[0] += pull[k] * y * t2
        result[1] -= pull[k] * x * t2
        result[2] += pull[k] * (x * t1 - y * t0)
        result[3] += pull[k] * t0
        result[4] += pull[k] * t1
        result[5] += pull[k] * t2
        for i in range(6):
            if rod[i] == 0.0:
                continue
            a0 = a1 = a2 = 0.0
            if i == 0:
                a2 = y
            elif i == 1:
                a2 = -x
            elif i == 2:
                a0, a1 = -y, x
            elif i == 3:
                a0 = 1.0
            elif i == 4:
                a1 = 1.0
            else:
                a2 = 1.0
            along = t0 * a0 + t1 * a1 + t2 * a2
            d0, d1, d2 = (a0 - t0 * along) / length, (a1 - t1 * along) / length, (a2 - t2 * along) / length
            by_strain[i, 0] += pull[k] * y * d2
            by_strain[i, 1] -= pull[k] * x * d2
            by_strain[i, 2] += pull[k] * (x * d1 - y * d0)
            by_strain[i, 3] += pull[k] * d0
            by_strain[i, 4] += pull[k] * d1
            by_strain[i, 5] += pull[k] * d2
    _solve_in_place(stiffness, by_strain)  # symmetric
    for i in range(6):
        for c in range(6):
            slope[i, c] = by_strain[c, i]


@_compiled
def _left_over(
    path: int,
    rod: Array,
    hole: Array,
    span: Array,
    applied: Array,
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
    along = np.empty(tendons)
    end = np.empty(6)
    slope = np.empty((3, 6))
    across = np.empty(3)
    body, column = np.empty(6), np.empty(6)
    pull, against = np.empty(tendons), np.empty(tendons)
    by_end, by_start = np.empty((6, 6)), np.empty((6, 6))
    for j in range(n):
        for k in range(tendons):
            along[k] = span[k, j] if path in (CONTINUOUS, LUMENS) else 0.0
        _cross_section(rod[j], hole, along, wrench[j], turn[j], shift[j], turn_slope[j], shift_slope[j])
        for i in range(3):
            for k in range(3):
                R_w[j + 1, i, k] = (
                    R_w[j, i, 0] * turn[j, 0, k] + R_w[j, i, 1] * turn[j, 1, k] + R_w[j, i, 2] * turn[j, 2, k]
                )
    for j in range(n):
        R, p = turn[j], shift[j]
        for i in range(6):
            residual[j, i] = 0.0
            for c in range(6):
                above[j, i, c] = 0.0
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
        _turned_back(R_w[j + 1], applied[j, :3], body[:3])
        _turned_back(R_w[j + 1], applied[j, 3:], body[3:])
        for i in range(6):
            residual[j, i] += body[i]
        for half in (0, 3):
            load[j, half, 0] = load[j, half + 1, 1] = load[j, half + 2, 2] = 0.0
            load[j, half, 1], load[j, half, 2] = -body[half + 2], body[half + 1]
            load[j, half + 1, 0], load[j, half + 1, 2] = body[half + 2], -body[half]
            load[j, half + 2, 0], load[j, half + 2, 1] = -body[half + 1], body[half]
        if path == CONTINUOUS and j + 1 < n:
            kinked = False
            for k in range(tendons):
                kinked = kinked or (span[k, j] > 0.0 and span[k, j + 1] == 0.0)
            for i in range(6):
                kinked = kinked or rod[j, i] != rod[j + 1, i]
            for i in range(6):
                kinked = kinked or applied[j, i] != 0.0
            if kinked:
                for k in range(tendons):
                    along[k], pull[k], against[k] = span[k, j], span[k, j + 1], -span[k, j + 1]
                _add_directions(rod[j], hole, along, pull, end, residual[j], by_end)
                _add_directions(rod[j + 1], hole, pull, against, wrench[j + 1], residual[j], by_start)
                # So far `here` holds what the section's end wrench changes by, with its sign reversed.
                for c in range(6):
                    for i in range(6):
                        total = 0.0
                        for k in range(6):
                            total += by_end[i, k] * here[j, k, c]
                        column[i] = total
                    for i in range(6):
                        here[j, i, c] -= column[i]
                        above[j, i, c] += by_start[i, c]
        if path in (CONTINUOUS, LUMENS):
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


@_compiled
def _correction(
    turn: Array, turn_slope: Array, residual: Array, here: Array, above: Array, load: Array, step: Array
) -> bool:
    """Newton's correction of the wrenches, `step` (n, 6); returns False where the system is singular."""
    n = len(residual)
    by_tip = np.zeros((n + 1, 6, 4))  # corrections: without the tip's turn, and by each of its components
    disk = np.zeros((3, 4))  # the disk's turn in its own frame, in the same way
    disk[0, 1] = disk[1, 2] = disk[2, 3] = 1.0
    matrix, right, below = np.empty((6, 6)), np.empty((6, 4)), np.empty(3)
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
        if not _solve_in_place(matrix, right):
            return False
        for c in range(4):
            for i in range(6):
                by_tip[j, i, c] = right[i, c]
            for i in range(3):
                total = disk[i, c]
                for k in range(6):
                    total -= turn_slope[j, i, k] * right[k, c]
                below[i] = total
            for i in range(3):
                disk[i, c] = turn[j, i, 0] * below[0] + turn[j, i, 1] * below[1] + turn[j, i, 2] * below[2]
    last = np.empty((3, 3))
    tip = np.empty((3, 1))
    for i in range(3):
        tip[i, 0] = -disk[i, 0]
        for c in range(3):
            last[i, c] = disk[i, 1 + c]
    if not _solve_in_place(last, tip):
        return False
    for j in range(n):
        for i in range(6):
            step[j, i] = by_tip[j, i, 0]
            for c in range(3):
                step[j, i] += by_tip[j, i, 1 + c] * tip[c, 0]
    return True


@_compiled
def newton(
    path: int,
    rod: Array,
    hole: Array,
    span: Array,
    applied: Array,
    wrench: Array,
    turn: Array,
    shift: Array,
    R_w: Array,
    tolerance: float,
    farthest: float,
    residual: Array,
) -> tuple[int, int, float]:
    """Balance a robot at given tensions, starting from `wrench`, which is the result too.

    Args:
        path: CONTINUOUS, PROJECTED, EYELETS or LUMENS.
        rod: sections' data, shape (n, 8).
        hole: shape (t, 2) [m].
        span: tension of every tendon along every section, zero beyond its end, shape (t, n) [N].
        applied: moment and force on disks 1 to n, base frame, shape (n, 6).
        wrench: at the sections' starts, in their frames, shape (n, 6).
        turn, shift: result, the sections' poses, shapes (n, 3, 3) and (n, 3).
        R_w: result, orientations of disks 0 to n, shape (n + 1, 3, 3); the first one is given.
        tolerance: of the last correction, turns of the sections, summed [rad].
        farthest: what a correction may turn the sections by, summed [rad].
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
    largest = math.inf
    rounds = 0
    first = 0.0
    while True:
        _left_over(
            path, rod, hole, span, applied, wrench, turn, shift, turn_slope, shift_slope,
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
        if rounds >= _MOST_ROUNDS:
            return DIVERGED, rounds, first
        if not _correction(turn, turn_slope, residual, here, above, load, step):
            return SINGULAR, rounds, first
        rounds += 1
        before = largest
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
        if not largest < farthest:
            return TOO_FAR, rounds, first
        if largest > _SMALL_TURN_RAD and largest > _CONTRACTION * before:
            return DIVERGED, rounds, first
        for j in range(n):
            for i in range(6):
                wrench[j, i] += step[j, i]


@_compiled
def _angle(a: Array, b: Array) -> float:
    """Angle between two directions [rad]."""
    x = a[1] * b[2] - a[2] * b[1]
    y = a[2] * b[0] - a[0] * b[2]
    z = a[0] * b[1] - a[1] * b[0]
    return math.atan2(math.sqrt(x * x + y * y + z * z), a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@_compiled
def _turns(
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
            _turned_back(turn[j], moved, end[:3])
            _turned_back(turn[j], n0, end[3:])
            for k in range(tendons):
                along[k] = span[k, j]
            _strain_of(rod[j], hole, along, end, at_end, stiffness)
            _strain_of(rod[j], hole, along, wrench[j], strain, stiffness)
            for k in range(tendons):
                if along[k] == 0.0:
                    continue
                _tangent(strain, hole[k], before)
                _tangent(at_end, hole[k], after)
                _turned(turn[j], after, moved)
                half = 0.5 * _angle(before, moved)
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
            _turned_back(R, after, before)


@_compiled
def _balanced(
    path: int, rod: Array, hole: Array, last: NDArray[np.intp], mu: float, tension: Array,
    applied: Array, span: Array, wrench: Array, turn: Array, shift: Array, R_w: Array,
    tolerance: float, farthest: float, residual: Array, angle: Array,
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
            path, rod, hole, span, applied, wrench, turn, shift, R_w, tolerance, farthest, residual
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


@_compiled
def advance(
    path: int, rough: Array, rod: Array, hole: Array, last: NDArray[np.intp], mu: float,
    tension0: Array, applied0: Array, tension1: Array, applied1: Array,
    wrench: Array, span: Array, angle: Array, turn: Array, shift: Array, R_w: Array, residual: Array,
    one_step: bool,
) -> tuple[float, int]:  # fmt: skip
    """Follow the equilibrium from one load to another; the arrays from `wrench` on are changed.

    Args:
        path: CONTINUOUS, PROJECTED, EYELETS or LUMENS.
        rough: as `rod`, with fewer steps, for the way.
        rod: sections' data, shape (n, 8).
        hole: shape (t, 2) [m].
        last: number of the disk where each tendon ends, shape (t,).
        mu: capstan coefficient.
        tension0, applied0: at the start of the way: tensions at the base, shape (t,) [N], moment and
            force on disks 1 to n, base frame, shape (n, 6) [N m], [N].
        tension1, applied1: at its end.
        wrench: at the sections' starts, in their frames, shape (n, 6).
        span: tensions, shape (t, n) [N].
        angle: what each tendon has turned by from the base to each section, shape (t, n) [rad].
        turn, shift: the sections' poses, shapes (n, 3, 3) and (n, 3) [m].
        R_w: orientations of disks 0 to n, shape (n + 1, 3, 3); the first one is given.
        residual: unbalanced moment and force at the disks, in their frames, shape (n, 6).
        one_step: whether to give up where a single step of little turn does not lead there.

    Returns:
        The share of the way that was reached (1.0: all), and the number of Newton's corrections.
    """
    tendons, n = span.shape
    tension, applied = np.empty(tendons), np.empty((n, 6))
    old_wrench, old_angle = np.empty((n, 6)), np.empty((tendons, n))
    reached, step = 0.0, 1.0
    farthest = _NEAR if one_step else _FARTHEST
    count = 0
    while reached < 1.0:
        if step < _SHORTEST_STEP:
            return reached, count
        share = min(1.0, reached + step)
        if share > 1.0 - 0.1 * step:
            share = 1.0
        for k in range(tendons):
            tension[k] = tension0[k] + share * (tension1[k] - tension0[k])
            for j in range(n):
                old_angle[k, j] = angle[k, j]
        for j in range(n):
            for i in range(6):
                applied[j, i] = applied0[j, i] + share * (applied1[j, i] - applied0[j, i])
                old_wrench[j, i] = wrench[j, i]
        status, rounds, far = _balanced(
            path, rough, hole, last, mu, tension, applied,
            span, wrench, turn, shift, R_w, _ON_THE_WAY, farthest, residual, angle,
        )  # fmt: skip
        count += rounds
        if status == CONVERGED:
            reached = share
            step *= 2.0
            continue
        for j in range(n):
            for i in range(6):
                wrench[j, i] = old_wrench[j, i]
            for k in range(tendons):
                angle[k, j] = old_angle[k, j]
        if one_step:
            return 0.0, count
        if status == TOO_FAR and rounds == 1:
            step *= max(0.35, min(0.9, 0.8 * farthest / far))
        else:
            step *= 0.5
    status, rounds, far = _balanced(
        path, rod, hole, last, mu, tension1, applied1,
        span, wrench, turn, shift, R_w, _AT_THE_END, farthest, residual, angle,
    )  # fmt: skip
    return 1.0 if status == CONVERGED else reached - _SHORTEST_STEP, count + rounds
