"""What tendons do to the disks, compiled: pulls of straight spans, and forces along continuous paths.

Straight tendons pull the disks with the forces of Rao 2021, Eqs 30-33, projected into the disk's plane by
Eq. 58 or not. Unprojected, a tendon of constant tension is in eyelets without friction. What Eq. 58 takes
away is the part without friction only: a difference of the tensions at the two sides of a hole stays.
"""

from __future__ import annotations

import math

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.lanes import (
    BODY,
    COLUMNS,
    LOW,
    LOW_SLOPE,
    SPAN,
    TENDONS,
    TRIAL,
    TURN,
    column,
    three,
)
from catheter_sim.kinds.continuum.theory.tdcr.rod_kernels.strain import path_direction, strain_of
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.eight import all_zero, room
from catheter_sim.mechanics.linear_eights import solve_columns_of_any
from catheter_sim.mechanics.vectors import dot3, fill


@compiled
def add_span_pulls(w: Array, hole: Array, columns: int) -> None:
    """Add the pulls of straight spans: on the lower disk to `LOW`, on the upper one to `-BODY`.

    `BODY` and `COLUMNS` are the wrench at the sections' ends, so that what they become is what is left
    over there with its sign reversed.
    """
    for slot in range(42):
        w[LOW + slot] = 0.0
    for k in range(len(hole)):
        x, y = hole[k, 0], hole[k, 1]
        tension = w[TENDONS + 3 * k]
        low, high = w[TENDONS + 3 * k + 1], w[TENDONS + 3 * k + 2]
        a0 = w[TURN] * x + w[TURN + 1] * y
        a1 = w[TURN + 3] * x + w[TURN + 4] * y
        a2 = w[TURN + 6] * x + w[TURN + 7] * y
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
        w[BODY] -= y * fz
        w[BODY + 1] += x * fz
        w[BODY + 2] -= x * fy - y * fx
        w[BODY + 3] -= fx
        w[BODY + 4] -= fy
        w[BODY + 5] -= fz
        for c in range(columns):
            length = w[SPAN + 3]
            tension = w[TENDONS + 3 * k] / length
            low = w[TENDONS + 3 * k + 1] / length
            high = w[TENDONS + 3 * k + 2] / length
            r00, r01, r02 = three(w, TURN)
            r10, r11, r12 = three(w, TURN + 3)
            r20, r21, r22 = three(w, TURN + 6)
            tx, ty, tz = column(w, TRIAL + 7 + c)
            c0, c1, c2 = -tz * y, tz * x, tx * y - ty * x  # turn x hole
            s0 = r00 * c0 + r01 * c1 + r02 * c2 + w[TRIAL + 25 + c]
            s1 = r10 * c0 + r11 * c1 + r12 * c2 + w[TRIAL + 31 + c]
            s2 = r20 * c0 + r21 * c1 + r22 * c2 + w[TRIAL + 37 + c]
            d0, d1, d2 = three(w, SPAN)
            along = d0 * s0 + d1 * s1 + d2 * s2
            s0, s1, s2 = s0 - d0 * along, s1 - d1 * along, s2 - d2 * along
            fx, fy, fz = tension * s0, tension * s1, low * s2
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
