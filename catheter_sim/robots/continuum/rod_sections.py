"""Sections of a Cosserat rod between disks, with its tendons, integrated from end to end, compiled."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.eight import (
    LANES,
    all_less,
    all_zero,
    eights,
    larger,
    room,
    select_less,
    solve_columns_of_any,
)
from catheter_sim.mechanics.vectors import dot3, fill, turned, turned_back

# ----------------------------------------------------------------------------------------------------
# How a rod is handed to the compiled loops, and the names of tendon paths.

# Columns of `rod`, the sections' data: six compliances, then the length and the number of steps.
LENGTH, STEPS = 6, 7
CONTINUOUS, PROJECTED, EYELETS, LUMENS = range(4)  # tendon paths
# Tendons that act at their ends alone, by a moment, or by their pull along the backbone's axis.
MOMENT, TIP_FORCE = 4, 5


# ----------------------------------------------------------------------------------------------------
# The workspace in which sections are integrated: one slot after another, each an eight (`mechanics.eight`).
#
# The eight are eight sections of one robot, or one section of eight robots.

# Slots of the workspace, eights. A state is a quaternion (4), a position (3), then the
# pose's derivatives by the wrench: turn in the body's frame (3, 6), shift in the start's frame (3, 6).
STATE, TRIAL, TOTAL, RATE, SIZE = 0, 43, 86, 129, 43
TURN, WRENCH, BODY, STRAIN = 172, 181, 187, 193  # orientation (3, 3) of the trial, then six each
COLUMNS = 199  # derivative of the body's wrench, then of its strain, (6, 6)
COMPLIANCE, STIFFNESS, INVERSE = 235, 241, 247  # six, six and (6, 6)
STEP = 283
LOW, LOW_SLOPE = 284, 290  # tendons' pull on the lower disk, (6,), and its derivative, (6, 6)
SPAN = 326  # a tendon's direction (3) and length, its reverse in the upper disk's frame (3)
# Slots for each tendon: tension, what of it acts along the lower and the upper disk's axis, its holes there.
TENDONS, PER_TENDON = 333, 7


@compiled
def three(w: Array, slot: int) -> tuple[Any, Any, Any]:
    """Return three slots in a row."""
    return w[slot], w[slot + 1], w[slot + 2]


@compiled
def column(w: Array, slot: int) -> tuple[Any, Any, Any]:
    """Return three numbers of a column of a matrix with rows of six."""
    return w[slot], w[slot + 6], w[slot + 12]


# ----------------------------------------------------------------------------------------------------
# The elastic law of a rod with tendons along it, compiled: strains under a wrench.

_STRAIN_ROUNDS = 30
_STRAIN_TOLERANCE = 1e-8  # a correction below it is the last: what it leaves is smaller than its square


@compiled
def path_direction(strain: Array, hole: Array, out: Array) -> None:
    """Direction v + u x r of a tendon's path along the rod (Rao 2021, Eq. 27)."""
    out[0] = strain[3] - strain[2] * hole[1]
    out[1] = strain[4] + strain[2] * hole[0]
    out[2] = 1.0 + strain[5] + strain[0] * hole[1] - strain[1] * hole[0]


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
    right, matrix = room((6, 1), wrench), room((6, 6), wrench)
    gradient, tangent = room((6,), wrench), room((3, 6), wrench)
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
            if all_zero(tension[k]):
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
        if not solve_columns_of_any(matrix, right):
            return
        largest = abs(right[0, 0])
        for i in range(6):
            strain[i] += right[i, 0]
            largest = larger(largest, abs(right[i, 0]))
        if all_less(largest, _STRAIN_TOLERANCE):
            return


@compiled
def _inverse_of(stiffness: Array, compliance: Array, inverse: Array) -> None:
    """Set the inverse of a law's stiffness, (6, 6); rows and columns of locked strains are zero."""
    for i in range(6):
        for c in range(6):
            inverse[i, c] = 1.0 if i == c else 0.0
    solve_columns_of_any(stiffness, inverse)
    for i in range(6):
        if compliance[i] == 0.0:
            for c in range(6):
                inverse[i, c] = inverse[c, i] = 0.0


@compiled
def start_laws(rod: Array, hole: Array, span: Array, wrench: Array, strain: Array, inverse: Array) -> None:
    """Set each section's strain at its start, (n, 6), and the inverse of its stiffness there, (n, 6, 6).

    A section like the one before with the same tensions takes over that one's: they only have to be near.
    """
    tendons, n = span.shape
    along, stiffness = room((tendons,), wrench), room((6, 6), wrench)
    for j in range(n):
        same = j > 0
        for k in range(tendons):
            along[k] = span[k, j]
            same = same and all_zero(span[k, j] - span[k, j - 1])
        for i in range(6):
            same = same and rod[j, i] == rod[j - 1, i]
        for i in range(6):
            strain[j, i] = strain[j - 1, i] if same else 0.0
        if same:
            for i in range(6):
                for c in range(6):
                    inverse[j, i, c] = inverse[j - 1, i, c]
        else:
            strain_of(rod[j], hole, along, wrench[j], strain[j], stiffness)
            _inverse_of(stiffness, rod[j], inverse[j])


# ----------------------------------------------------------------------------------------------------
# A section, the rod between two disks, integrated from its start to its end, compiled.
#
# Only forces at its ends load it (Rao et al. 2021, doi 10.3389/frobt.2020.630245, Eqs 2-3, 34-37 and,
# without f and l, 38-39): in the frame of its start the force stays n and the moment is m - p x n, so that
# the pose (R, p) alone is integrated, by Runge-Kutta's fourth-order rule, where wanted together with its
# derivative by the wrench. `w` is the workspace of `lanes`.

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
            pull = w[TENDONS + PER_TENDON * k] / math.sqrt(gx * gx + gy * gy + gz * gz)
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


# ----------------------------------------------------------------------------------------------------
# What tendons do to the disks, compiled: pulls of straight spans, and forces along continuous paths.
#
# Straight tendons pull the disks with the forces of Rao 2021, Eqs 30-33, projected into the disk's plane by
# Eq. 58 or not. Unprojected, a tendon of constant tension is in eyelets without friction. What Eq. 58 takes
# away is the part without friction only: a difference of the tensions at the two sides of a hole stays.


@compiled
def add_span_pulls(w: Array, tendons: int, columns: int) -> None:
    """Add the pulls of straight spans: on the lower disk to `LOW`, on the upper one to `-BODY`.

    `BODY` and `COLUMNS` are the wrench at the sections' ends, so that what they become is what is left
    over there with its sign reversed.
    """
    for slot in range(42):
        w[LOW + slot] = 0.0
    for k in range(tendons):
        tension = w[TENDONS + PER_TENDON * k]
        low, high = w[TENDONS + PER_TENDON * k + 1], w[TENDONS + PER_TENDON * k + 2]
        x, y = w[TENDONS + PER_TENDON * k + 5], w[TENDONS + PER_TENDON * k + 6]
        a0 = w[TURN] * x + w[TURN + 1] * y
        a1 = w[TURN + 3] * x + w[TURN + 4] * y
        a2 = w[TURN + 6] * x + w[TURN + 7] * y
        x, y = w[TENDONS + PER_TENDON * k + 3], w[TENDONS + PER_TENDON * k + 4]
        a0 += w[TRIAL + 4] - x
        a1 += w[TRIAL + 5] - y
        a2 += w[TRIAL + 6]
        length = math.sqrt(a0 * a0 + a1 * a1 + a2 * a2)
        d0, d1, d2 = a0 / length, a1 / length, a2 / length
        e0 = -(w[TURN] * d0 + w[TURN + 3] * d1)
        e0 -= w[TURN + 6] * d2
        e1 = -(w[TURN + 1] * d0 + w[TURN + 4] * d1)
        e1 -= w[TURN + 7] * d2
        e2 = -(w[TURN + 2] * d0 + w[TURN + 5] * d1)
        e2 -= w[TURN + 8] * d2
        w[SPAN], w[SPAN + 1], w[SPAN + 2] = d0, d1, d2
        w[SPAN + 3] = length
        w[SPAN + 4], w[SPAN + 5] = e0, e1
        w[SPAN + 6] = e2
        fx, fy, fz = tension * d0, tension * d1, low * d2
        w[LOW] += y * fz
        w[LOW + 1] -= x * fz
        w[LOW + 2] += x * fy - y * fx
        w[LOW + 3] += fx
        w[LOW + 4] += fy
        w[LOW + 5] += fz
        fx, fy, fz = tension * e0, tension * e1, high * e2
        x, y = w[TENDONS + PER_TENDON * k + 5], w[TENDONS + PER_TENDON * k + 6]
        w[BODY] -= y * fz
        w[BODY + 1] += x * fz
        w[BODY + 2] -= x * fy - y * fx
        w[BODY + 3] -= fx
        w[BODY + 4] -= fy
        w[BODY + 5] -= fz
        for c in range(columns):
            length = w[SPAN + 3]
            tension = w[TENDONS + PER_TENDON * k] / length
            low = w[TENDONS + PER_TENDON * k + 1] / length
            high = w[TENDONS + PER_TENDON * k + 2] / length
            r00, r01, r02 = three(w, TURN)
            r10, r11, r12 = three(w, TURN + 3)
            r20, r21, r22 = three(w, TURN + 6)
            tx, ty, tz = column(w, TRIAL + 7 + c)
            x, y = w[TENDONS + PER_TENDON * k + 5], w[TENDONS + PER_TENDON * k + 6]
            c0, c1, c2 = -tz * y, tz * x, tx * y - ty * x  # turn x hole
            s0 = r00 * c0 + r01 * c1 + r02 * c2 + w[TRIAL + 25 + c]
            s1 = r10 * c0 + r11 * c1 + r12 * c2 + w[TRIAL + 31 + c]
            s2 = r20 * c0 + r21 * c1 + r22 * c2 + w[TRIAL + 37 + c]
            d0, d1, d2 = three(w, SPAN)
            along = d0 * s0 + d1 * s1 + d2 * s2
            s0, s1, s2 = s0 - d0 * along, s1 - d1 * along, s2 - d2 * along
            fx, fy, fz = tension * s0, tension * s1, low * s2
            x, y = w[TENDONS + PER_TENDON * k + 3], w[TENDONS + PER_TENDON * k + 4]
            w[LOW_SLOPE + c] += y * fz
            w[LOW_SLOPE + 6 + c] -= x * fz
            w[LOW_SLOPE + 12 + c] += x * fy - y * fx
            w[LOW_SLOPE + 18 + c] += fx
            w[LOW_SLOPE + 24 + c] += fy
            w[LOW_SLOPE + 30 + c] += fz
            e0, e1, e2 = (
                w[SPAN + 4] * length,
                w[SPAN + 5] * length,
                w[SPAN + 6] * length,
            )
            fx = -tension * (r00 * s0 + r10 * s1 + r20 * s2 + (ty * e2 - tz * e1))
            fy = -tension * (r01 * s0 + r11 * s1 + r21 * s2 + (tz * e0 - tx * e2))
            fz = -high * (r02 * s0 + r12 * s1 + r22 * s2 + (tx * e1 - ty * e0))
            x, y = w[TENDONS + PER_TENDON * k + 5], w[TENDONS + PER_TENDON * k + 6]
            w[COLUMNS + c] -= y * fz
            w[COLUMNS + 6 + c] += x * fz
            w[COLUMNS + 12 + c] -= x * fy - y * fx
            w[COLUMNS + 18 + c] -= fx
            w[COLUMNS + 24 + c] -= fy
            w[COLUMNS + 30 + c] -= fz


@compiled
def add_path_forces(
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
    strain, stiffness = room((6,), wrench), room((6, 6), wrench)
    fill(strain, 0.0)
    strain_of(rod, hole, tension, wrench, strain, stiffness)
    by_strain, tangent = room((6, 6), wrench), room((3,), wrench)  # the first one transposed
    fill(by_strain, 0.0)
    for k in range(len(hole)):
        if all_zero(pull[k]):
            continue
        x, y = hole[k, 0], hole[k, 1]
        path_direction(strain, hole[k], tangent)
        length = math.sqrt(dot3(tangent, tangent))
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
    solve_columns_of_any(stiffness, by_strain)  # symmetric
    for i in range(6):
        for c in range(6):
            slope[i, c] = by_strain[c, i]


# ----------------------------------------------------------------------------------------------------
# The sections of a robot integrated, compiled: eight of one robot's at once, or eight robots' one by one.


class SectionEnds(NamedTuple):
    """Where n sections end, what they leave over there, and how both change with the wrenches at the starts.

    Attributes:
        turn, shift: the sections' poses, shapes (n, 3, 3) and (n, 3) [m].
        turn_slope: how the poses turn with the wrenches, shape (n, 3, 6).
        end: wrenches at the ends and pulls on the upper disks, shape (n, 6): what they leave over there has
            the sign reversed.
        here: derivative of -end, shape (n, 6, 6).
        low, low_slope: pulls on the lower disks and their derivative, shapes (n, 6) and (n, 6, 6).
    """

    turn: Array
    shift: Array
    turn_slope: Array
    end: Array
    here: Array
    low: Array
    low_slope: Array


@compiled
def sections(
    path: int,
    rod: Array,
    hole: Array,
    holes: Array,
    span: Array,
    wrench: Array,
    start: tuple[Array, Array],
    derive: bool,
    w: Array,
    ends: SectionEnds,
) -> None:
    """Fill the sections' ends, with `derive` their derivatives, too.

    Args:
        path, rod, hole, holes, span, wrench: as of `rod_balance.TendonRod` and `RodState`.
        start: strain and inverse stiffness of `start_laws`.
        w: the workspace.
    """
    strain, inverse = start
    turn, shift, turn_slope, end, here, low, low_slope = ends
    tendons, n = span.shape
    along = path in (CONTINUOUS, LUMENS)
    columns = 6 if derive else 0
    side_by_side = eights(w.reshape(-1, LANES))
    for first in range(0, n, LANES):
        steps = 1
        for i in range(LANES):
            steps = max(steps, int(rod[min(first + i, n - 1), STEPS]))
        for i in range(LANES):
            j = min(first + i, n - 1)
            for q in range(6):
                w[(WRENCH + q) * LANES + i] = wrench[j, q]
                w[(COMPLIANCE + q) * LANES + i] = rod[j, q]
            w[STEP * LANES + i] = rod[j, LENGTH] / steps
            for k in range(tendons):
                w[(TENDONS + PER_TENDON * k) * LANES + i] = span[k, j]
            if along:
                for q in range(6):
                    w[(STIFFNESS + q) * LANES + i] = 1.0 / rod[j, q] if rod[j, q] > 0.0 else 0.0
                    w[(STRAIN + q) * LANES + i] = strain[j, q]
                    for c in range(6):
                        w[(INVERSE + 6 * q + c) * LANES + i] = inverse[j, q, c]
            else:
                for k in range(tendons):
                    both = below = 0.0
                    if path == PROJECTED and span[k, j] > 0.0:
                        if j > 0:
                            below = 0.5 * (span[k, j - 1] + span[k, j])
                        if j + 1 < n and span[k, j + 1] > 0.0:
                            both = 0.5 * (span[k, j] + span[k, j + 1])
                    w[(TENDONS + PER_TENDON * k + 1) * LANES + i] = span[k, j] - below
                    w[(TENDONS + PER_TENDON * k + 2) * LANES + i] = span[k, j] - both
                    for q in range(4):
                        w[(TENDONS + PER_TENDON * k + 3 + q) * LANES + i] = holes[k, j + q // 2, q % 2]
        integrate(side_by_side, hole, steps, along, columns)
        set_body_wrenches(side_by_side, columns)
        if path in (PROJECTED, EYELETS):
            add_span_pulls(side_by_side, tendons, columns)
        for i in range(min(LANES, n - first)):
            j = first + i
            for q in range(3):
                shift[j, q] = w[(TRIAL + 4 + q) * LANES + i]
                for c in range(3):
                    turn[j, q, c] = w[(TURN + 3 * q + c) * LANES + i]
            for q in range(6):
                end[j, q] = w[(BODY + q) * LANES + i]
                low[j, q] = w[(LOW + q) * LANES + i] if not along else 0.0
            if not derive:
                continue
            for q in range(3):
                for c in range(6):
                    turn_slope[j, q, c] = w[(TRIAL + 7 + 6 * q + c) * LANES + i]
            for q in range(6):
                for c in range(6):
                    here[j, q, c] = -w[(COLUMNS + 6 * q + c) * LANES + i]
                    low_slope[j, q, c] = w[(LOW_SLOPE + 6 * q + c) * LANES + i] if not along else 0.0


@compiled
def sections_of_eights(
    path: int,
    rod: Array,
    hole: Array,
    holes: Array,
    span: Array,
    wrench: Array,
    start: tuple[Array, Array],
    derive: bool,
    v: Array,
    ends: SectionEnds,
) -> None:
    """Do as `sections` for eight robots side by side, section after section; `v`: the workspace of eights."""
    strain, inverse = start
    turn, shift, turn_slope, end, here, low, low_slope = ends
    tendons, n = span.shape
    along = path in (CONTINUOUS, LUMENS)
    columns = 6 if derive else 0
    for j in range(n):
        steps = int(rod[j, STEPS])
        v[STEP] = rod[j, LENGTH] / steps
        for q in range(6):
            v[WRENCH + q], v[COMPLIANCE + q] = wrench[j, q], rod[j, q]
        for k in range(tendons):
            v[TENDONS + PER_TENDON * k] = span[k, j]
        if along:
            for q in range(6):
                v[STIFFNESS + q] = 1.0 / rod[j, q] if rod[j, q] > 0.0 else 0.0
                v[STRAIN + q] = strain[j, q]
                for c in range(6):
                    v[INVERSE + 6 * q + c] = inverse[j, q, c]
        else:
            for k in range(tendons):
                both = below = 0.0 * span[k, j]
                if path == PROJECTED and j > 0:
                    below = 0.5 * (span[k, j - 1] + span[k, j])
                if path == PROJECTED and j + 1 < n:
                    both = select_less(0.0, span[k, j + 1], 0.5 * (span[k, j] + span[k, j + 1]), 0.0)
                v[TENDONS + PER_TENDON * k + 1] = select_less(0.0, span[k, j], span[k, j] - below, 0.0)
                v[TENDONS + PER_TENDON * k + 2] = span[k, j] - both
                for q in range(4):
                    v[TENDONS + PER_TENDON * k + 3 + q] = 0.0 * span[k, j] + holes[k, j + q // 2, q % 2]
        integrate(v, hole, steps, along, columns)
        set_body_wrenches(v, columns)
        if path in (PROJECTED, EYELETS):
            add_span_pulls(v, tendons, columns)
        for q in range(3):
            shift[j, q] = v[TRIAL + 4 + q]
            for c in range(3):
                turn[j, q, c] = v[TURN + 3 * q + c]
        for q in range(6):
            end[j, q] = v[BODY + q]
            low[j, q] = 0.0 if along else v[LOW + q]
        if not derive:
            continue
        for c in range(6):
            for q in range(3):
                turn_slope[j, q, c] = v[TRIAL + 7 + 6 * q + c]
            for q in range(6):
                here[j, q, c] = -v[COLUMNS + 6 * q + c]
                low_slope[j, q, c] = 0.0 if along else v[LOW_SLOPE + 6 * q + c]


# ----------------------------------------------------------------------------------------------------
# Lengths of tendons along continuous paths, compiled.


@compiled
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


@compiled
def measure_paths(
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
            turned_back(R_w[row, j], arm, p)
            m, f = wrench[row, j, :3], wrench[row, j, 3:]
            for i in range(6):
                wrenches[0, i] = wrench[row, j, i]
            arm[0] = m[0] - (p[1] * f[2] - p[2] * f[1])
            arm[1] = m[1] - (p[2] * f[0] - p[0] * f[2])
            arm[2] = m[2] - (p[0] * f[1] - p[1] * f[0])
            turned(R_w[row, j], arm, path)
            turned_back(R_w[row, j + 1], path, wrenches[2, :3])
            turned(R_w[row, j], f, path)
            turned_back(R_w[row, j + 1], path, wrenches[2, 3:])
            for end in range(2):
                strain_of(rod[j], hole, along, wrenches[2 * end], strain[2 * end], stiffness)
                _wrench_slope(strain[2 * end], wrenches[2 * end], slope[end])
            for i in range(6):
                wrenches[1, i] = 0.5 * (wrenches[0, i] + wrenches[2, i])
                wrenches[1, i] += 0.125 * rod[j, LENGTH] * (slope[0, i] - slope[1, i])
            strain_of(rod[j], hole, along, wrenches[1], strain[1], stiffness)
            for k in range(tendons):
                if j >= last[k]:
                    continue
                for place in range(3):
                    path_direction(strain[place], hole[k], path)
                    size = math.sqrt(path[0] ** 2 + path[1] ** 2 + path[2] ** 2)
                    length[row, k] += (4.0 if place == 1 else 1.0) / 6.0 * rod[j, LENGTH] * size
