"""Equilibria of a Cosserat rod with tendons in compiled form: sections, balance, continuation.

All compiled code is in this file: the compiled form is kept on disk and renewed when this file
changes, not when another does. `collocation` solves the same equations as they are printed, in plain
NumPy and SciPy; the tests hold the one to the other.

Sections. A section is the rod between two disks. Only forces at its ends load it (Rao et al. 2021,
doi 10.3389/frobt.2020.603245, Eqs 2-3, 34-37 and, without f and l, 38-39): in the frame of its start
the force stays n and the moment is m - p x n, so that the pose (R, p) alone is integrated, by
Runge-Kutta's fourth-order rule, where wanted together with its derivative by the wrench. Eight
sections are integrated side by side (`LANES`): their numbers stand next to each other in one flat
workspace, slot by slot, so that the inner loops become the processor's vector instructions.

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

Newton's method. The derivative is taken with few integration steps; once a correction is small, the
residual is taken with many, without a derivative, and corrected by the last one until nothing changes.

Continuation. An equilibrium is followed from one load to another, from rest or from a neighbour. A step
begins where the wrenches would be if the posture did not change (from rest: the statics of the straight
robot), later ones where the last two steps point to. A step that turns the robot far from there,
fails, or is taken with slow convergence, is shortened.

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

LANES = 8  # sections side by side
# Slots of the workspace, each of `LANES` numbers. A state is a quaternion (4), a position (3), then the
# pose's derivatives by the wrench: turn in the body's frame (3, 6), shift in the start's frame (3, 6).
_STATE, _TRIAL, _TOTAL, _RATE, _SIZE = 0, 43, 86, 129, 43
_TURN, _WRENCH, _BODY, _STRAIN = 172, 181, 187, 193  # orientation (3, 3) of the trial, then six each
_COLUMNS = 199  # derivative of the body's wrench, then of its strain, (6, 6)
_COMPLIANCE, _STIFFNESS, _INVERSE = 235, 241, 247  # six, six and (6, 6)
_STEP = 283
_LOW, _LOW_SLOPE = 284, 290  # tendons' pull on the lower disk, (6,), and its derivative, (6, 6)
_SPAN = 326  # a tendon's direction (3) and length, its reverse in the upper disk's frame (3)
_TENDONS = 333  # three slots for each tendon: tension, and what of it acts along the lower, upper disk's axis

_STRAIN_ROUNDS = 30
_STRAIN_TOLERANCE = 1e-8  # a correction below it is the last: what it leaves is smaller than its square
_CHORD_ROUNDS = 40
_CHORD_TOLERANCE = 1e-10
_MOST_ROUNDS = 14
# A correction may be this share of the one before, unless both are small: otherwise the step was too long
# to be sure of the equilibrium that it finds.
_CONTRACTION = 0.5
_FRESH_CONTRACTION = 0.05  # a slower one asks for another derivative
_SMALL_TURN_RAD = 1e-7
# What one correction may turn the sections by, summed [rad]: beyond it Newton's method may find another
# equilibrium than the one that the load leads to, or none.
_FARTHEST = 0.1
_NEAR = 0.2  # from a row to the next one
_ON_THE_WAY = 3e-3  # turn of the last correction before the end of the way [rad]
_AT_THE_END = 1e-10
_SHORTEST_STEP = 1.0 / 1024.0  # of the way from load to load
_FRICTION_ROUNDS = 100
_FRICTION_TOLERANCE = 1e-11  # change of the tensions, over the largest one


def _compiled(function: Callable[..., Any]) -> Any:
    """Return `function` compiled for use in this file."""
    return numba.njit(error_model="numpy", nogil=True)(function)


def _inlined(function: Callable[..., Any]) -> Any:
    """Return `function` written into its one caller: what is called is optimized again at every level."""
    return numba.njit(inline="always")(function)


def _kept(function: Callable[..., Any]) -> Any:
    """Return `function` compiled with all that it calls, kept on disk where there is a folder for it."""
    try:
        return numba.njit(cache=True, error_model="numpy", nogil=True)(function)
    except RuntimeError:  # neither beside this file nor in the user's own cache
        return numba.njit(error_model="numpy", nogil=True)(function)


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
def _three(w: Array, slot: int, i: int) -> tuple[float, float, float]:
    """Return three slots in a row."""
    return w[slot * LANES + i], w[(slot + 1) * LANES + i], w[(slot + 2) * LANES + i]


@_compiled
def _column(w: Array, slot: int, o: int) -> tuple[float, float, float]:
    """Return three numbers of a column of a matrix with rows of six."""
    return w[slot * LANES + o], w[(slot + 6) * LANES + o], w[(slot + 12) * LANES + o]


@_compiled
def _bodies(w: Array, columns: int) -> None:
    """Set orientation and wrench of the trial in the body's frame, and the wrench's derivative."""
    for i in range(LANES):
        a, x, y, z = (
            w[_TRIAL * LANES + i],
            w[(_TRIAL + 1) * LANES + i],
            w[(_TRIAL + 2) * LANES + i],
            w[(_TRIAL + 3) * LANES + i],
        )
        r00, r01, r02 = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - a * z), 2.0 * (x * z + a * y)
        r10, r11, r12 = 2.0 * (x * y + a * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - a * x)
        r20, r21, r22 = 2.0 * (x * z - a * y), 2.0 * (y * z + a * x), 1.0 - 2.0 * (x * x + y * y)
        w[_TURN * LANES + i], w[(_TURN + 1) * LANES + i], w[(_TURN + 2) * LANES + i] = r00, r01, r02
        w[(_TURN + 3) * LANES + i], w[(_TURN + 4) * LANES + i], w[(_TURN + 5) * LANES + i] = r10, r11, r12
        w[(_TURN + 6) * LANES + i], w[(_TURN + 7) * LANES + i], w[(_TURN + 8) * LANES + i] = r20, r21, r22
        px, py, pz = _three(w, _TRIAL + 4, i)
        nx, ny, nz = _three(w, _WRENCH + 3, i)
        mx = w[_WRENCH * LANES + i] - (py * nz - pz * ny)
        my = w[(_WRENCH + 1) * LANES + i] - (pz * nx - px * nz)
        mz = w[(_WRENCH + 2) * LANES + i] - (px * ny - py * nx)
        w[_BODY * LANES + i] = r00 * mx + r10 * my + r20 * mz
        w[(_BODY + 1) * LANES + i] = r01 * mx + r11 * my + r21 * mz
        w[(_BODY + 2) * LANES + i] = r02 * mx + r12 * my + r22 * mz
        w[(_BODY + 3) * LANES + i] = r00 * nx + r10 * ny + r20 * nz
        w[(_BODY + 4) * LANES + i] = r01 * nx + r11 * ny + r21 * nz
        w[(_BODY + 5) * LANES + i] = r02 * nx + r12 * ny + r22 * nz
    for c in range(columns):
        mx, my, mz = (1.0 if c == 0 else 0.0), (1.0 if c == 1 else 0.0), (1.0 if c == 2 else 0.0)
        fx, fy, fz = (1.0 if c == 3 else 0.0), (1.0 if c == 4 else 0.0), (1.0 if c == 5 else 0.0)
        for i in range(LANES):
            o = c * LANES + i
            tx, ty, tz = _column(w, _TRIAL + 7, o)
            dx, dy, dz = _column(w, _TRIAL + 25, o)
            px, py, pz = _three(w, _TRIAL + 4, i)
            nx, ny, nz = _three(w, _WRENCH + 3, i)
            # Change of the moment in the start's frame: dm - dp x n - p x dn.
            qx = mx - (dy * nz - dz * ny) - (py * fz - pz * fy)
            qy = my - (dz * nx - dx * nz) - (pz * fx - px * fz)
            qz = mz - (dx * ny - dy * nx) - (px * fy - py * fx)
            r00, r01, r02 = _three(w, _TURN, i)
            r10, r11, r12 = _three(w, _TURN + 3, i)
            r20, r21, r22 = _three(w, _TURN + 6, i)
            b0, b1, b2 = _three(w, _BODY, i)
            b3, b4, b5 = _three(w, _BODY + 3, i)
            w[_COLUMNS * LANES + o] = r00 * qx + r10 * qy + r20 * qz - (ty * b2 - tz * b1)
            w[(_COLUMNS + 6) * LANES + o] = r01 * qx + r11 * qy + r21 * qz - (tz * b0 - tx * b2)
            w[(_COLUMNS + 12) * LANES + o] = r02 * qx + r12 * qy + r22 * qz - (tx * b1 - ty * b0)
            w[(_COLUMNS + 18) * LANES + o] = r00 * fx + r10 * fy + r20 * fz - (ty * b5 - tz * b4)
            w[(_COLUMNS + 24) * LANES + o] = r01 * fx + r11 * fy + r21 * fz - (tz * b3 - tx * b5)
            w[(_COLUMNS + 30) * LANES + o] = r02 * fx + r12 * fy + r22 * fz - (tx * b4 - ty * b3)


@_compiled
def _law(w: Array, hole: Array, along: bool, columns: int) -> None:
    """Set the strains of the body's wrench and, in place, their derivative.

    With tendons along the sections the strains are corrected by a fixed inverse until they balance.
    """
    if not along:
        for o in range(6 * LANES):
            w[_STRAIN * LANES + o] = w[_COMPLIANCE * LANES + o] * w[_BODY * LANES + o]
        for row in range(columns):
            for c in range(columns):
                for i in range(LANES):
                    w[(_COLUMNS + 6 * row + c) * LANES + i] *= w[(_COMPLIANCE + row) * LANES + i]
        return
    for _ in range(_CHORD_ROUNDS):
        for o in range(6 * LANES):
            w[_RATE * LANES + o] = (
                w[_STRAIN * LANES + o] * w[_STIFFNESS * LANES + o] - w[_BODY * LANES + o]
            )  # gradient
        for k in range(len(hole)):
            x, y = hole[k, 0], hole[k, 1]
            for i in range(LANES):
                gx = w[(_STRAIN + 3) * LANES + i] - w[(_STRAIN + 2) * LANES + i] * y
                gy = w[(_STRAIN + 4) * LANES + i] + w[(_STRAIN + 2) * LANES + i] * x
                gz = 1.0 + w[(_STRAIN + 5) * LANES + i]
                gz += w[_STRAIN * LANES + i] * y - w[(_STRAIN + 1) * LANES + i] * x
                pull = w[(_TENDONS + 3 * k) * LANES + i] / math.sqrt(gx * gx + gy * gy + gz * gz)
                gx, gy, gz = gx * pull, gy * pull, gz * pull
                w[_RATE * LANES + i] += y * gz
                w[(_RATE + 1) * LANES + i] -= x * gz
                w[(_RATE + 2) * LANES + i] += x * gy - y * gx
                w[(_RATE + 3) * LANES + i] += gx
                w[(_RATE + 4) * LANES + i] += gy
                w[(_RATE + 5) * LANES + i] += gz
        for o in range(6 * LANES):
            w[(_RATE + 6) * LANES + o] = 0.0
        for row in range(6):
            for c in range(6):
                for i in range(LANES):
                    w[(_RATE + 6 + row) * LANES + i] += (
                        w[(_INVERSE + 6 * row + c) * LANES + i] * w[(_RATE + c) * LANES + i]
                    )
        for i in range(LANES):
            w[(_RATE + 12) * LANES + i] = 0.0
        for row in range(6):
            for i in range(LANES):
                change = w[(_RATE + 6 + row) * LANES + i]
                w[(_STRAIN + row) * LANES + i] -= change
                w[(_RATE + 12) * LANES + i] = max(w[(_RATE + 12) * LANES + i], abs(change))
        largest = 0.0
        for i in range(LANES):
            largest = max(largest, w[(_RATE + 12) * LANES + i])
        if largest < _CHORD_TOLERANCE:
            break
    for c in range(columns):
        for row in range(columns):
            for i in range(LANES):
                w[(_RATE + row) * LANES + i] = 0.0
            for k in range(columns):
                for i in range(LANES):
                    w[(_RATE + row) * LANES + i] += (
                        w[(_INVERSE + 6 * row + k) * LANES + i] * w[(_COLUMNS + 6 * k + c) * LANES + i]
                    )
        for row in range(columns):
            for i in range(LANES):
                w[(_COLUMNS + 6 * row + c) * LANES + i] = w[(_RATE + row) * LANES + i]


@_compiled
def _rates(w: Array, hole: Array, along: bool, columns: int) -> None:
    """Set the trial's derivative along the rod."""
    _bodies(w, columns)
    _law(w, hole, along, columns)
    for i in range(LANES):
        a, x, y, z = (
            w[_TRIAL * LANES + i],
            w[(_TRIAL + 1) * LANES + i],
            w[(_TRIAL + 2) * LANES + i],
            w[(_TRIAL + 3) * LANES + i],
        )
        ux, uy, uz = _three(w, _STRAIN, i)
        vx, vy, vz = (
            w[(_STRAIN + 3) * LANES + i],
            w[(_STRAIN + 4) * LANES + i],
            1.0 + w[(_STRAIN + 5) * LANES + i],
        )
        w[_RATE * LANES + i] = 0.5 * (-x * ux - y * uy - z * uz)
        w[(_RATE + 1) * LANES + i] = 0.5 * (a * ux + y * uz - z * uy)
        w[(_RATE + 2) * LANES + i] = 0.5 * (a * uy + z * ux - x * uz)
        w[(_RATE + 3) * LANES + i] = 0.5 * (a * uz + x * uy - y * ux)
        for row in range(3):
            w[(_RATE + 4 + row) * LANES + i] = (
                w[(_TURN + 3 * row) * LANES + i] * vx
                + w[(_TURN + 3 * row + 1) * LANES + i] * vy
                + w[(_TURN + 3 * row + 2) * LANES + i] * vz
            )
    for c in range(columns):
        for i in range(LANES):
            o = c * LANES + i
            ux, uy, uz = _three(w, _STRAIN, i)
            vx, vy, vz = (
                w[(_STRAIN + 3) * LANES + i],
                w[(_STRAIN + 4) * LANES + i],
                1.0 + w[(_STRAIN + 5) * LANES + i],
            )
            tx, ty, tz = _column(w, _TRIAL + 7, o)
            w[(_RATE + 7) * LANES + o] = w[_COLUMNS * LANES + o] - (uy * tz - uz * ty)
            w[(_RATE + 13) * LANES + o] = w[(_COLUMNS + 6) * LANES + o] - (uz * tx - ux * tz)
            w[(_RATE + 19) * LANES + o] = w[(_COLUMNS + 12) * LANES + o] - (ux * ty - uy * tx)
            sx = w[(_COLUMNS + 18) * LANES + o] + ty * vz - tz * vy
            sy = w[(_COLUMNS + 24) * LANES + o] + tz * vx - tx * vz
            sz = w[(_COLUMNS + 30) * LANES + o] + tx * vy - ty * vx
            for row in range(3):
                w[(_RATE + 25 + 6 * row) * LANES + o] = (
                    w[(_TURN + 3 * row) * LANES + i] * sx
                    + w[(_TURN + 3 * row + 1) * LANES + i] * sy
                    + w[(_TURN + 3 * row + 2) * LANES + i] * sz
                )


@_compiled
def _integrate(w: Array, hole: Array, steps: int, along: bool, columns: int) -> None:
    """Integrate the workspace's sections from their starts to their ends; the end is the trial, too."""
    size = 7 + 6 * columns
    for o in range(_SIZE * LANES):
        w[_STATE * LANES + o] = 0.0
    for i in range(LANES):
        w[_STATE * LANES + i] = 1.0
    for o in range(size * LANES):
        w[_TRIAL * LANES + o] = w[_STATE * LANES + o]
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
                        rate = w[_RATE * LANES + o]
                        w[_TOTAL * LANES + o] = keep * w[_TOTAL * LANES + o] + weight * rate
                        w[_TRIAL * LANES + o] = w[_STATE * LANES + o] + ahead * w[_STEP * LANES + i] * rate
            else:
                for slot in range(size):
                    for i in range(LANES):
                        o = slot * LANES + i
                        w[_STATE * LANES + o] += (
                            w[_STEP * LANES + i] / 6.0 * (w[_TOTAL * LANES + o] + w[_RATE * LANES + o])
                        )
        for i in range(LANES):
            square = 0.0
            for q in range(4):
                square += w[(_STATE + q) * LANES + i] * w[(_STATE + q) * LANES + i]
            for q in range(4):
                w[(_STATE + q) * LANES + i] /= math.sqrt(square)
        for o in range(size * LANES):
            w[_TRIAL * LANES + o] = w[_STATE * LANES + o]


@_compiled
def _pulls(w: Array, hole: Array, columns: int) -> None:
    """Add the pulls of straight spans: on the lower disk to `_LOW`, on the upper one to `-_BODY`.

    `_BODY` and `_COLUMNS` are the wrench at the sections' ends, so that what they become is what is left
    over there with its sign reversed.
    """
    for o in range(42 * LANES):
        w[_LOW * LANES + o] = 0.0
    for k in range(len(hole)):
        x, y = hole[k, 0], hole[k, 1]
        for i in range(LANES):
            tension = w[(_TENDONS + 3 * k) * LANES + i]
            low, high = w[(_TENDONS + 3 * k + 1) * LANES + i], w[(_TENDONS + 3 * k + 2) * LANES + i]
            a0 = w[_TURN * LANES + i] * x + w[(_TURN + 1) * LANES + i] * y
            a1 = w[(_TURN + 3) * LANES + i] * x + w[(_TURN + 4) * LANES + i] * y
            a2 = w[(_TURN + 6) * LANES + i] * x + w[(_TURN + 7) * LANES + i] * y
            a0 += w[(_TRIAL + 4) * LANES + i] - x
            a1 += w[(_TRIAL + 5) * LANES + i] - y
            a2 += w[(_TRIAL + 6) * LANES + i]
            length = math.sqrt(a0 * a0 + a1 * a1 + a2 * a2)
            d0, d1, d2 = a0 / length, a1 / length, a2 / length
            e0 = -(w[_TURN * LANES + i] * d0 + w[(_TURN + 3) * LANES + i] * d1)
            e0 -= w[(_TURN + 6) * LANES + i] * d2
            e1 = -(w[(_TURN + 1) * LANES + i] * d0 + w[(_TURN + 4) * LANES + i] * d1)
            e1 -= w[(_TURN + 7) * LANES + i] * d2
            e2 = -(w[(_TURN + 2) * LANES + i] * d0 + w[(_TURN + 5) * LANES + i] * d1)
            e2 -= w[(_TURN + 8) * LANES + i] * d2
            w[_SPAN * LANES + i], w[(_SPAN + 1) * LANES + i], w[(_SPAN + 2) * LANES + i] = d0, d1, d2
            w[(_SPAN + 3) * LANES + i] = length
            w[(_SPAN + 4) * LANES + i], w[(_SPAN + 5) * LANES + i] = e0, e1
            w[(_SPAN + 6) * LANES + i] = e2
            fx, fy, fz = tension * d0, tension * d1, low * d2
            w[_LOW * LANES + i] += y * fz
            w[(_LOW + 1) * LANES + i] -= x * fz
            w[(_LOW + 2) * LANES + i] += x * fy - y * fx
            w[(_LOW + 3) * LANES + i] += fx
            w[(_LOW + 4) * LANES + i] += fy
            w[(_LOW + 5) * LANES + i] += fz
            fx, fy, fz = tension * e0, tension * e1, high * e2
            w[_BODY * LANES + i] -= y * fz
            w[(_BODY + 1) * LANES + i] += x * fz
            w[(_BODY + 2) * LANES + i] -= x * fy - y * fx
            w[(_BODY + 3) * LANES + i] -= fx
            w[(_BODY + 4) * LANES + i] -= fy
            w[(_BODY + 5) * LANES + i] -= fz
        for c in range(columns):
            for i in range(LANES):
                o = c * LANES + i
                length = w[(_SPAN + 3) * LANES + i]
                tension = w[(_TENDONS + 3 * k) * LANES + i] / length
                low = w[(_TENDONS + 3 * k + 1) * LANES + i] / length
                high = w[(_TENDONS + 3 * k + 2) * LANES + i] / length
                r00, r01, r02 = _three(w, _TURN, i)
                r10, r11, r12 = _three(w, _TURN + 3, i)
                r20, r21, r22 = _three(w, _TURN + 6, i)
                tx, ty, tz = _column(w, _TRIAL + 7, o)
                c0, c1, c2 = -tz * y, tz * x, tx * y - ty * x  # turn x hole
                s0 = r00 * c0 + r01 * c1 + r02 * c2 + w[(_TRIAL + 25) * LANES + o]
                s1 = r10 * c0 + r11 * c1 + r12 * c2 + w[(_TRIAL + 31) * LANES + o]
                s2 = r20 * c0 + r21 * c1 + r22 * c2 + w[(_TRIAL + 37) * LANES + o]
                d0, d1, d2 = _three(w, _SPAN, i)
                along = d0 * s0 + d1 * s1 + d2 * s2
                s0, s1, s2 = s0 - d0 * along, s1 - d1 * along, s2 - d2 * along
                fx, fy, fz = tension * s0, tension * s1, low * s2
                w[_LOW_SLOPE * LANES + o] += y * fz
                w[(_LOW_SLOPE + 6) * LANES + o] -= x * fz
                w[(_LOW_SLOPE + 12) * LANES + o] += x * fy - y * fx
                w[(_LOW_SLOPE + 18) * LANES + o] += fx
                w[(_LOW_SLOPE + 24) * LANES + o] += fy
                w[(_LOW_SLOPE + 30) * LANES + o] += fz
                e0, e1, e2 = (
                    w[(_SPAN + 4) * LANES + i] * length,
                    w[(_SPAN + 5) * LANES + i] * length,
                    w[(_SPAN + 6) * LANES + i] * length,
                )
                fx = -tension * (r00 * s0 + r10 * s1 + r20 * s2 + (ty * e2 - tz * e1))
                fy = -tension * (r01 * s0 + r11 * s1 + r21 * s2 + (tz * e0 - tx * e2))
                fz = -high * (r02 * s0 + r12 * s1 + r22 * s2 + (tx * e1 - ty * e0))
                w[_COLUMNS * LANES + o] -= y * fz
                w[(_COLUMNS + 6) * LANES + o] += x * fz
                w[(_COLUMNS + 12) * LANES + o] -= x * fy - y * fx
                w[(_COLUMNS + 18) * LANES + o] -= fx
                w[(_COLUMNS + 24) * LANES + o] -= fy
                w[(_COLUMNS + 30) * LANES + o] -= fz


@_compiled
def _inverse_of(stiffness: Array, compliance: Array, inverse: Array) -> None:
    """Set the inverse of a law's stiffness, (6, 6); rows and columns of locked strains are zero."""
    for i in range(6):
        for c in range(6):
            inverse[i, c] = 1.0 if i == c else 0.0
    _solve_in_place(stiffness, inverse)
    for i in range(6):
        if compliance[i] == 0.0:
            for c in range(6):
                inverse[i, c] = inverse[c, i] = 0.0


@_compiled
def _laws(rod: Array, hole: Array, span: Array, wrench: Array, strain: Array, inverse: Array) -> None:
    """Set each section's strain at its start, (n, 6), and the inverse of its stiffness there, (n, 6, 6).

    A section like the one before with the same tensions takes over that one's: they only have to be near.
    """
    tendons, n = span.shape
    along, stiffness = np.empty(tendons), np.empty((6, 6))
    for j in range(n):
        same = j > 0
        for k in range(tendons):
            along[k] = span[k, j]
            same = same and span[k, j] == span[k, j - 1]
        for i in range(6):
            same = same and rod[j, i] == rod[j - 1, i]
        for i in range(6):
            strain[j, i] = strain[j - 1, i] if same else 0.0
        if same:
            for i in range(6):
                for c in range(6):
                    inverse[j, i, c] = inverse[j - 1, i, c]
        else:
            _strain_of(rod[j], hole, along, wrench[j], strain[j], stiffness)
            _inverse_of(stiffness, rod[j], inverse[j])


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
def _tangent(strain: Array, hole: Array, out: Array) -> None:
    """Direction v + u x r of a tendon's path along the rod (Rao 2021, Eq. 27)."""
    out[0] = strain[3] - strain[2] * hole[1]
    out[1] = strain[4] + strain[2] * hole[0]
    out[2] = 1.0 + strain[5] + strain[0] * hole[1] - strain[1] * hole[0]


@_compiled
def _add_directions(
    rod: Array,
    hole: Array,
    tension: Array,
    pull: Array,
    wrench: Array,
    result: Array,
    slope: Array,
    derive: bool,
) -> None:
    """Add moment and force of `pull` along the continuous paths at a place; with `derive` set their slope.

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
            if not derive or rod[i] == 0.0:
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
    if not derive:
        return
    _solve_in_place(stiffness, by_strain)  # symmetric
    for i in range(6):
        for c in range(6):
            slope[i, c] = by_strain[c, i]


@_compiled
def _sections(
    path: int,
    rod: Array,
    hole: Array,
    span: Array,
    wrench: Array,
    strain: Array,
    inverse: Array,
    derive: bool,
    w: Array,
    turn: Array,
    shift: Array,
    turn_slope: Array,
    end: Array,
    here: Array,
    low: Array,
    low_slope: Array,
) -> None:
    """Set the sections' poses, wrenches at their ends, `end` (n, 6), and pulls on their lower disks.

    `end` holds the pulls on the upper disks, too: what it leaves over there has the sign reversed. With
    `derive` also their derivatives by the wrenches at the starts: `turn_slope` (n, 3, 6), `here`, that
    of -end, and `low_slope`, (n, 6, 6). `strain` and `inverse` are those of `_laws`.
    """
    tendons, n = span.shape
    along = path in (CONTINUOUS, LUMENS)
    columns = 6 if derive else 0
    for first in range(0, n, LANES):
        steps = 1
        for i in range(LANES):
            steps = max(steps, int(rod[min(first + i, n - 1), STEPS]))
        for i in range(LANES):
            j = min(first + i, n - 1)
            for q in range(6):
                w[(_WRENCH + q) * LANES + i] = wrench[j, q]
                w[(_COMPLIANCE + q) * LANES + i] = rod[j, q]
            w[_STEP * LANES + i] = rod[j, LENGTH] / steps
            for k in range(tendons):
                w[(_TENDONS + 3 * k) * LANES + i] = span[k, j]
            if along:
                for q in range(6):
                    w[(_STIFFNESS + q) * LANES + i] = 1.0 / rod[j, q] if rod[j, q] > 0.0 else 0.0
                    w[(_STRAIN + q) * LANES + i] = strain[j, q]
                    for c in range(6):
                        w[(_INVERSE + 6 * q + c) * LANES + i] = inverse[j, q, c]
            else:
                for k in range(tendons):
                    both = below = 0.0
                    if path == PROJECTED and span[k, j] > 0.0:
                        if j > 0:
                            below = 0.5 * (span[k, j - 1] + span[k, j])
                        if j + 1 < n and span[k, j + 1] > 0.0:
                            both = 0.5 * (span[k, j] + span[k, j + 1])
                    w[(_TENDONS + 3 * k + 1) * LANES + i] = span[k, j] - below
                    w[(_TENDONS + 3 * k + 2) * LANES + i] = span[k, j] - both
        _integrate(w, hole, steps, along, columns)
        _bodies(w, columns)
        if not along:
            _pulls(w, hole, columns)
        for i in range(min(LANES, n - first)):
            j = first + i
            for q in range(3):
                shift[j, q] = w[(_TRIAL + 4 + q) * LANES + i]
                for c in range(3):
                    turn[j, q, c] = w[(_TURN + 3 * q + c) * LANES + i]
            for q in range(6):
                end[j, q] = w[(_BODY + q) * LANES + i]
                low[j, q] = w[(_LOW + q) * LANES + i] if not along else 0.0
            if not derive:
                continue
            for q in range(3):
                for c in range(6):
                    turn_slope[j, q, c] = w[(_TRIAL + 7 + 6 * q + c) * LANES + i]
            for q in range(6):
                for c in range(6):
                    here[j, q, c] = -w[(_COLUMNS + 6 * q + c) * LANES + i]
                    low_slope[j, q, c] = w[(_LOW_SLOPE + 6 * q + c) * LANES + i] if not along else 0.0


@_compiled
def _left_over(
    path: int,
    rod: Array,
    hole: Array,
    span: Array,
    applied: Array,
    wrench: Array,
    strain: Array,
    inverse: Array,
    derive: bool,
    w: Array,
    turn: Array,
    shift: Array,
    turn_slope: Array,
    R_w: Array,
    residual: Array,
    here: Array,
    above: Array,
    load: Array,
    end: Array,
    low: Array,
) -> None:
    """Set the residual at the disks, (n, 6), and the sections' poses; with `derive` the derivatives, too.

    `here`, `above`, shapes (n, 6, 6), and `load`, shape (n, 6, 3), are the residual's derivatives by the
    wrench of the section below and above and by the disk's turn. `R_w`: orientations of disks 0 to n.
    """
    tendons, n = span.shape
    _sections(
        path, rod, hole, span, wrench, strain, inverse, derive, w,
        turn, shift, turn_slope, end, here, low, above,
    )  # fmt: skip
    body, column = np.empty(6), np.empty(6)
    kinks = path == CONTINUOUS
    along, pull, against = np.empty(tendons), np.empty(tendons), np.empty(tendons)
    by_end, by_start = np.empty((6, 6)), np.empty((6, 6))
    for j in range(n):
        for i in range(3):
            for k in range(3):
                R_w[j + 1, i, k] = (
                    R_w[j, i, 0] * turn[j, 0, k] + R_w[j, i, 1] * turn[j, 1, k] + R_w[j, i, 2] * turn[j, 2, k]
                )
        # Loads that keep their direction: R^T F turns by F_body x (turn of the disk).
        _turned_back(R_w[j + 1], applied[j, :3], body[:3])
        _turned_back(R_w[j + 1], applied[j, 3:], body[3:])
        for i in range(6):
            residual[j, i] = body[i] - end[j, i]
        if j + 1 < n:
            for i in range(6):
                residual[j, i] += wrench[j + 1, i] + low[j + 1, i]
        if derive:
            for half in (0, 3):
                load[j, half, 0] = load[j, half + 1, 1] = load[j, half + 2, 2] = 0.0
                load[j, half, 1], load[j, half, 2] = -body[half + 2], body[half + 1]
                load[j, half + 1, 0], load[j, half + 1, 2] = body[half + 2], -body[half]
                load[j, half + 2, 0], load[j, half + 2, 1] = -body[half + 1], body[half]
            for i in range(6):  # `above` so far: the pulls of section j on its lower disk
                for c in range(6):
                    above[j, i, c] = above[j + 1, i, c] if j + 1 < n else 0.0
                if j + 1 < n:
                    above[j, i, i] += 1.0
        if kinks and j + 1 < n:
            kinked = False
            for k in range(tendons):
                kinked = kinked or (span[k, j] > 0.0 and span[k, j + 1] == 0.0)
            for i in range(6):
                kinked = kinked or rod[j, i] != rod[j + 1, i] or applied[j, i] != 0.0
            if kinked:
                for k in range(tendons):
                    along[k], pull[k], against[k] = span[k, j], span[k, j + 1], -span[k, j + 1]
                _add_directions(rod[j], hole, along, pull, end[j], residual[j], by_end, derive)
                _add_directions(rod[j + 1], hole, pull, against, wrench[j + 1], residual[j], by_start, derive)
                if derive:  # so far `here` holds what the end's wrench changes by, with its sign reversed
                    for c in range(6):
                        for i in range(6):
                            total = 0.0
                            for k in range(6):
                                total += by_end[i, k] * here[j, k, c]
                            column[i] = total
                        for i in range(6):
                            here[j, i, c] -= column[i]
                            above[j, i, c] += by_start[i, c]


@_compiled
def _factorized(
    turn: Array, turn_slope: Array, here: Array, above: Array, load: Array, by_tip: Array, last: Array
) -> bool:
    """Prepare `_correction`: here -> its inverse, above -> -inverse above, load -> -inverse load.

    `by_tip`, (n, 6, 3), becomes the corrections by the tip's small turn, and `last`, (3, 3), the inverse of
    what that turns the base by. Returns False where the system is singular.
    """
    n = len(here)
    matrix, disk, below, unit = np.empty((6, 6)), np.zeros((3, 3)), np.empty((3, 3)), np.empty((6, 6))
    disk[0, 0] = disk[1, 1] = disk[2, 2] = 1.0
    for j in range(n - 1, -1, -1):
        for i in range(6):
            for c in range(6):
                matrix[i, c] = here[j, i, c]
                here[j, i, c] = 1.0 if i == c else 0.0
        if not _solve_in_place(matrix, here[j]):
            return False
        for i in range(6):
            for c in range(6):
                total = 0.0
                for k in range(6):
                    total -= here[j, i, k] * above[j, k, c]
                unit[i, c] = total
            for c in range(3):
                total = 0.0
                for k in range(6):
                    total -= here[j, i, k] * load[j, k, c]
                by_tip[j, i, c] = total
        for i in range(6):
            for c in range(6):
                above[j, i, c] = unit[i, c]
            for c in range(3):
                load[j, i, c] = by_tip[j, i, c]
        for i in range(6):
            for c in range(3):
                total = 0.0
                for k in range(3):
                    total += load[j, i, k] * disk[k, c]
                if j + 1 < n:
                    for k in range(6):
                        total += above[j, i, k] * by_tip[j + 1, k, c]
                by_tip[j, i, c] = total
        for i in range(3):
            for c in range(3):
                total = disk[i, c]
                for k in range(6):
                    total -= turn_slope[j, i, k] * by_tip[j, k, c]
                below[i, c] = total
        for c in range(3):
            for i in range(3):
                disk[i, c] = turn[j, i, 0] * below[0, c] + turn[j, i, 1] * below[1, c]
                disk[i, c] += turn[j, i, 2] * below[2, c]
    for i in range(3):
        for c in range(3):
            last[i, c] = 1.0 if i == c else 0.0
    return _solve_in_place(disk, last)


@_compiled
def _correction(
    turn: Array, turn_slope: Array, residual: Array, inverse: Array, above: Array, load: Array,
    by_tip: Array, last: Array, step: Array,
) -> None:  # fmt: skip
    """Set Newton's correction of the wrenches, `step` (n, 6), by what `_factorized` left."""
    n = len(residual)
    disk, below, tip = np.zeros(3), np.empty(3), np.empty(3)
    for j in range(n - 1, -1, -1):
        for i in range(6):
            total = 0.0
            for k in range(6):
                total -= inverse[j, i, k] * residual[j, k]
            for k in range(3):
                total += load[j, i, k] * disk[k]
            if j + 1 < n:
                for k in range(6):
                    total += above[j, i, k] * step[j + 1, k]
            step[j, i] = total
        for i in range(3):
            total = disk[i]
            for k in range(6):
                total -= turn_slope[j, i, k] * step[j, k]
            below[i] = total
        _turned(turn[j], below, disk)
    for i in range(3):
        tip[i] = -(last[i, 0] * disk[0] + last[i, 1] * disk[1] + last[i, 2] * disk[2])
    for j in range(n):
        for i in range(6):
            for c in range(3):
                step[j, i] += by_tip[j, i, c] * tip[c]


@_inlined
def _newton(
    path: int,
    rough: Array,
    fine: Array,
    hole: Array,
    span: Array,
    applied: Array,
    wrench: Array,
    turn: Array,
    shift: Array,
    R_w: Array,
    to_the_end: bool,
    farthest: float,
    residual: Array,
    w: Array,
) -> tuple[int, int, float]:
    """Balance a robot at given tensions, starting from `wrench`, which is the result too.

    Args:
        path: CONTINUOUS, PROJECTED, EYELETS or LUMENS.
        rough, fine: sections' data with few and many integration steps, shape (n, 8).
        hole: shape (t, 2) [m].
        span: tension of every tendon along every section, zero beyond its end, shape (t, n) [N].
        applied: moment and force on disks 1 to n, base frame, shape (n, 6).
        wrench: at the sections' starts, in their frames, shape (n, 6).
        turn, shift: result, the sections' poses, shapes (n, 3, 3) and (n, 3).
        R_w: result, orientations of disks 0 to n, shape (n + 1, 3, 3); the first one is given.
        to_the_end: whether to balance the fine residual, instead of the rough one by and large.
        farthest: what a correction may turn the sections by, summed [rad].
        residual: result, unbalanced wrench at disks 1 to n, shape (n, 6).
        w: workspace.

    Returns:
        How it ended, the number of corrections, and what the first one turned the sections by [rad].
    """
    n = span.shape[1]
    turn_slope = np.empty((n, 3, 6))
    here, above, load = np.empty((n, 6, 6)), np.empty((n, 6, 6)), np.empty((n, 6, 3))
    by_tip, last = np.empty((n, 6, 3)), np.empty((3, 3))
    step, end, low = np.empty((n, 6)), np.empty((n, 6)), np.empty((n, 6))
    strain, inverse = np.empty((n, 6)), np.empty((n, 6, 6))
    if path in (CONTINUOUS, LUMENS):
        _laws(rough, hole, span, wrench, strain, inverse)
    largest = math.inf
    rounds = 0
    first = 0.0
    finishing, derive, slopes = False, True, rough
    while True:
        _left_over(
            path, fine if finishing and not derive else slopes, hole, span, applied, wrench, strain, inverse,
            derive, w, turn, shift, turn_slope, R_w, residual, here, above, load, end, low,
        )  # fmt: skip
        now = 0.0
        for j in range(n):
            for i in range(6):
                now += abs(residual[j, i])
        if not math.isfinite(now):
            return DIVERGED, rounds, first
        if not derive and (largest < _AT_THE_END or now == 0.0):
            return CONVERGED, rounds, first
        if rounds >= _MOST_ROUNDS:
            return DIVERGED, rounds, first
        if derive:
            if not _factorized(turn, turn_slope, here, above, load, by_tip, last):
                return SINGULAR, rounds, first
            derive = not finishing
        _correction(turn, turn_slope, residual, here, above, load, by_tip, last, step)
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
        if finishing:
            if largest > _AT_THE_END and largest > _FRESH_CONTRACTION * before:
                derive, slopes = True, fine
        elif largest < _ON_THE_WAY:
            if not to_the_end:
                return CONVERGED, rounds, first
            finishing, derive, largest = True, False, math.inf


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


@_inlined
def _balanced(
    path: int, rough: Array, fine: Array, hole: Array, last: NDArray[np.intp], mu: float, tension: Array,
    applied: Array, span: Array, wrench: Array, turn: Array, shift: Array, R_w: Array,
    to_the_end: bool, farthest: float, residual: Array, angle: Array, w: Array,
) -> tuple[int, int, float]:  # fmt: skip
    """Balance posture and tensions; `span` is start and result; as `_newton` otherwise."""
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
        status, count, far = _newton(
            path, rough, fine, hole, span, applied, wrench, turn, shift, R_w,
            to_the_end, farthest, residual, w,
        )  # fmt: skip
        rounds += count
        if trial == 0:
            first = far
        if status != CONVERGED or mu == 0.0:
            return status, rounds, first
        _turns(path, rough, hole, span, wrench, turn, shift, angle)
        change = 0.0
        for k in range(tendons):
            total = 0.0
            for j in range(last[k]):
                total += angle[k, j]
                angle[k, j] = total
                new = tension[k] * math.exp(-mu * total)
                change = max(change, abs(new - span[k, j]))
                span[k, j] = new
        if change < (_FRICTION_TOLERANCE if to_the_end else 0.1 * _ON_THE_WAY) * largest:
            return status, rounds, first
    return TOO_FAR, rounds, first


@_compiled
def _statics(
    path: int, hole: Array, last: NDArray[np.intp], mu: float, angle: Array, tension: Array,
    applied: Array, turn: Array, shift: Array, R_w: Array, slope: Array,
) -> None:  # fmt: skip
    """Set what tensions and loads add to the sections' wrenches while the posture stays, (n, 6).

    The tendons' share is that of eyelets; on continuous paths it is in the elastic law.
    """
    n = len(turn)
    moment, force = np.zeros(3), np.zeros(3)  # of the loads beyond, about the section's start
    arm, across = np.empty(3), np.empty(3)
    for j in range(n - 1, -1, -1):
        for i in range(3):
            force[i] += applied[j, 3 + i]
            moment[i] += applied[j, i]
        _turned(R_w[j], shift[j], arm)
        moment[0] += arm[1] * force[2] - arm[2] * force[1]
        moment[1] += arm[2] * force[0] - arm[0] * force[2]
        moment[2] += arm[0] * force[1] - arm[1] * force[0]
        _turned_back(R_w[j], moment, slope[j, :3])
        _turned_back(R_w[j], force, slope[j, 3:])
        if path in (CONTINUOUS, LUMENS):
            continue
        for k in range(len(hole)):
            if j >= last[k] or tension[k] == 0.0:
                continue
            x, y = hole[k, 0], hole[k, 1]
            for i in range(3):
                across[i] = turn[j, i, 0] * x + turn[j, i, 1] * y + shift[j, i]
            across[0] -= x
            across[1] -= y
            length = math.sqrt(across[0] ** 2 + across[1] ** 2 + across[2] ** 2)
            pull = tension[k] * math.exp(-mu * angle[k, j]) / length
            fx, fy, fz = -pull * across[0], -pull * across[1], -pull * across[2]
            slope[j, 0] += y * fz
            slope[j, 1] -= x * fz
            slope[j, 2] += x * fy - y * fx
            slope[j, 3] += fx
            slope[j, 4] += fy
            slope[j, 5] += fz


@_inlined
def _advance(
    path: int, rough: Array, rod: Array, hole: Array, last: NDArray[np.intp], mu: float,
    tension0: Array, applied0: Array, tension1: Array, applied1: Array,
    wrench: Array, span: Array, angle: Array, turn: Array, shift: Array, R_w: Array, residual: Array,
    one_step: bool, longest: float, w: Array,
) -> tuple[float, int]:  # fmt: skip
    """Follow the equilibrium from one load to another; the arrays from `wrench` on are changed.

    Args:
        path: CONTINUOUS, PROJECTED, EYELETS or LUMENS.
        rough: as `rod`, with fewer steps, for the way and the derivatives.
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
        longest: share of the way that one step may take.
        w: workspace.

    Returns:
        The share of the way that was reached (1.0: all), and the number of Newton's corrections.
    """
    tendons, n = span.shape
    tension, applied = np.empty(tendons), np.empty((n, 6))
    for k in range(tendons):
        tension[k] = tension1[k] - tension0[k]
    for j in range(n):
        for i in range(6):
            applied[j, i] = applied1[j, i] - applied0[j, i]
    slope, old_wrench, old_angle = np.empty((n, 6)), np.empty((n, 6)), np.empty((tendons, n))
    _statics(path, hole, last, mu, angle, tension, applied, turn, shift, R_w, slope)
    if one_step:
        turned = 0.0
        for j in range(n):
            square = 0.0
            for i in range(3):
                square += (rod[j, i] * slope[j, i]) ** 2
            turned += rod[j, LENGTH] * math.sqrt(square)
        if not turned < _NEAR:
            return 0.0, 0
    reached, step = 0.0, longest
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
                wrench[j, i] += (share - reached) * slope[j, i]
        status, rounds, far = _balanced(
            path, rough, rod, hole, last, mu, tension, applied,
            span, wrench, turn, shift, R_w, share == 1.0, farthest, residual, angle, w,
        )  # fmt: skip
        count += rounds
        if status == CONVERGED:
            for j in range(n):
                for i in range(6):
                    slope[j, i] = (wrench[j, i] - old_wrench[j, i]) / (share - reached)
            reached = share
            step = min(longest, 2.0 * step)
            continue
        for j in range(n):
            for i in range(6):
                wrench[j, i] = old_wrench[j, i]
            for k in range(tendons):
                angle[k, j] = old_angle[k, j]
        if one_step:
            return 0.0, count
        if status == TOO_FAR and rounds == 1 and far < 1e3:
            step *= max(0.35, min(0.9, math.sqrt(0.8 * farthest / far)))
        else:
            step *= 0.5
    return 1.0, count


@_compiled
def _copy(a: Array, out: Array) -> None:
    """Copy between contiguous arrays."""
    flat, to = a.reshape(-1), out.reshape(-1)
    for i in range(len(flat)):
        to[i] = flat[i]


@_compiled
def _fill(out: Array, value: float) -> None:
    """Set all of a contiguous array."""
    flat = out.reshape(-1)
    for i in range(len(flat)):
        flat[i] = value


@_compiled
def _straight(rod: Array, wrench: Array, angle: Array, turn: Array, shift: Array, R_w: Array) -> None:
    """Set the robot at rest."""
    for j in range(len(rod)):
        for i in range(6):
            wrench[j, i] = 0.0
        for k in range(len(angle)):
            angle[k, j] = 0.0
        for i in range(3):
            shift[j, i] = rod[j, LENGTH] if i == 2 else 0.0
            for c in range(3):
                turn[j, i, c] = R_w[j + 1, i, c] = 1.0 if i == c else 0.0


@_kept
def follow(
    path: int, rough: Array, rod: Array, hole: Array, last: NDArray[np.intp], mu: float,
    tension: Array, applied: Array, wrench: Array, span: Array, shift: Array, R_w: Array, residual: Array,
    reached: Array, corrections: NDArray[np.intp], longest: float,
) -> None:  # fmt: skip
    """Find the equilibria of r rows of loads; arguments as of `_advance` with rows in front.

    A row is reached from the one before where that is near, else from rest; then, if that way ends, from
    the row before at any distance, and from rest with the tensions or the other loads first.

    Args:
        reached: result, share of the way from rest that was reached, shape (r,); 1: some way led there.
        corrections: result, of Newton's method, shape (r,).
    """
    rows, tendons = tension.shape
    n = len(rod)
    turn, angle, angle_before = np.empty((n, 3, 3)), np.zeros((tendons, n)), np.zeros((tendons, n))
    w = np.zeros((_TENDONS + 3 * tendons) * LANES)
    pulls, loads = np.zeros((3, tendons)), np.zeros((3, n, 6))
    for row in range(rows):
        before = row > 0 and reached[row - 1] == 1.0
        tensioned = loaded = False
        for k in range(tendons):
            tensioned = tensioned or tension[row, k] != 0.0
        for j in range(n):
            for i in range(6):
                loaded = loaded or applied[row, j, i] != 0.0
        for way in range(5):  # near, from rest, from before, tensions first, loads first
            if (way in (0, 2) and not before) or (way > 2 and not (tensioned and loaded)):
                continue
            stops = 2 if way < 3 else 3
            _fill(pulls, 0.0)
            _fill(loads, 0.0)
            if way in (0, 2):
                _copy(tension[row - 1], pulls[0])
                _copy(applied[row - 1], loads[0])
                _copy(wrench[row - 1], wrench[row])
                _copy(shift[row - 1], shift[row])
                _copy(R_w[row - 1], R_w[row])
                _copy(angle_before, angle)
                for j in range(n):
                    for i in range(3):
                        _turned_back(R_w[row, j], R_w[row, j + 1, :, i], turn[j, :, i])
            else:
                _straight(rod, wrench[row], angle, turn, shift[row], R_w[row])
            if way == 3:
                _copy(tension[row], pulls[1])
            if way == 4:
                _copy(applied[row], loads[1])
            _copy(tension[row], pulls[stops - 1])
            _copy(applied[row], loads[stops - 1])
            share = 1.0
            for leg in range(stops - 1):
                share, count = _advance(
                    path, rough, rod, hole, last, mu, pulls[leg], loads[leg], pulls[leg + 1], loads[leg + 1],
                    wrench[row], span[row], angle, turn, shift[row], R_w[row], residual[row],
                    way == 0, longest, w,
                )  # fmt: skip
                corrections[row] += count
                if share < 1.0:
                    break
            if share == 1.0 or way == 1:
                reached[row] = share
            if share == 1.0:
                _copy(angle, angle_before)
                break


@_compiled
def _wrench_slope(strain: Array, wrench: Array, out: Array) -> None:
    """Set how the wrench of an unloaded stretch changes along the rod, in the body's frame."""
    ux, uy, uz = strain[0], strain[1], strain[2]
    vx, vy, vz = strain[3], strain[4], 1.0 + strain[5]
    mx, my, mz, nx, ny, nz = wrench[0], wrench[1], wrench[2], wrench[3], wrench[4], wrench[5]
    out[0] = -(uy * mz - uz * my) - (vy * nz - vz * ny)
    out[1] = -(uz * mx - ux * mz) - (vz * nx - vx * nz)
    out[2] = -(ux * my - uy * mx) - (vx * ny - vy * nx)
    out[3] = -(uy * nz - uz * ny)
    out[4] = -(uz * nx - ux * nz)
    out[5] = -(ux * ny - uy * nx)


@_kept
def path_lengths(
    rod: Array, hole: Array, last: NDArray[np.intp], span: Array, wrench: Array, p_w: Array, R_w: Array,
    length: Array,
) -> None:  # fmt: skip
    """Set the lengths of tendons along continuous paths from the base to their ends, shape (r, t) [m].

    Simpson's rule over each section, the wrench at its middle by the values and slopes at its ends.

    Args:
        rod: sections' data, shape (n, 8).
        hole: shape (t, 2) [m].
        last: number of the disk where each tendon ends, shape (t,).
        span: tensions, zero beyond a tendon's end, shape (r, t, n) [N].
        wrench: at the sections' starts, in their frames, shape (r, n, 6).
        p_w, R_w: of disks 0 to n, shapes (r, n + 1, 3) [m], (r, n + 1, 3, 3).
        length: result.
    """
    rows, tendons, n = span.shape
    strain, slope, wrenches = np.zeros((3, 6)), np.empty((2, 6)), np.empty((3, 6))
    stiffness, along = np.empty((6, 6)), np.empty(tendons)
    arm, p, path = np.empty(3), np.empty(3), np.empty(3)
    for row in range(rows):
        for k in range(tendons):
            length[row, k] = 0.0
        for j in range(n):
            for k in range(tendons):
                along[k] = span[row, k, j]
            for i in range(3):
                arm[i] = p_w[row, j + 1, i] - p_w[row, j, i]
            _turned_back(R_w[row, j], arm, p)
            m, f = wrench[row, j, :3], wrench[row, j, 3:]
            for i in range(6):
                wrenches[0, i] = wrench[row, j, i]
            arm[0] = m[0] - (p[1] * f[2] - p[2] * f[1])
            arm[1] = m[1] - (p[2] * f[0] - p[0] * f[2])
            arm[2] = m[2] - (p[0] * f[1] - p[1] * f[0])
            _turned(R_w[row, j], arm, path)
            _turned_back(R_w[row, j + 1], path, wrenches[2, :3])
            _turned(R_w[row, j], f, path)
            _turned_back(R_w[row, j + 1], path, wrenches[2, 3:])
            for end in range(2):
                _strain_of(rod[j], hole, along, wrenches[2 * end], strain[2 * end], stiffness)
                _wrench_slope(strain[2 * end], wrenches[2 * end], slope[end])
            for i in range(6):
                wrenches[1, i] = 0.5 * (wrenches[0, i] + wrenches[2, i])
                wrenches[1, i] += 0.125 * rod[j, LENGTH] * (slope[0, i] - slope[1, i])
            _strain_of(rod[j], hole, along, wrenches[1], strain[1], stiffness)
            for k in range(tendons):
                if j >= last[k]:
                    continue
                for place in range(3):
                    _tangent(strain[place], hole[k], path)
                    size = math.sqrt(path[0] ** 2 + path[1] ** 2 + path[2] ** 2)
                    length[row, k] += (4.0 if place == 1 else 1.0) / 6.0 * rod[j, LENGTH] * size
