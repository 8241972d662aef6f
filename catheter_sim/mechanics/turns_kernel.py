"""By how much tendons turn at their holes, compiled.

Index j counts tendons, k spans from 0 at the base; hole k lies just before span k. A tendon ends behind span
`ends[j] - 1`.
"""

from __future__ import annotations

import math

from catheter_sim.arrays import Array, Index
from catheter_sim.mechanics.compiled import compiled_in_place


@compiled_in_place
def planar_turns(qpos: Array, joint_index: Index, turn: Array) -> None:
    """Write the turns of all tendons of a planar robot into `turn`, shape (t, n) [rad].

    The chord of a cell bent by theta lies at theta / 2, so a turn is half the sum of the two
    adjoining cells' angles; at the base's hole half of the first cell's.
    """
    before = 0.0
    for k in range(turn.shape[1]):
        angle = qpos[joint_index[k]]
        value = abs(0.5 * (before + angle))
        before = angle
        for j in range(turn.shape[0]):
            turn[j, k] = value


@compiled_in_place
def spatial_turns(points: Array, site_index: Index, ends: Index, axis: Array, turn: Array) -> None:
    """Write the turns of tendons given by their holes' positions into `turn`, shape (t, n) [rad].

    Before the base's hole a tendon comes along the base's axis, `axis`, shape (3,).
    """
    for j in range(turn.shape[0]):
        ax, ay, az = axis[0], axis[1], axis[2]
        for k in range(ends[j]):
            here, there = site_index[j, k], site_index[j, k + 1]
            bx = points[there, 0] - points[here, 0]
            by = points[there, 1] - points[here, 1]
            bz = points[there, 2] - points[here, 2]
            cx, cy, cz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            turn[j, k] = math.atan2(math.sqrt(cx * cx + cy * cy + cz * cz), ax * bx + ay * by + az * bz)
            ax, ay, az = bx, by, bz


@compiled_in_place
def planar_turns_of(copies: Index, qpos: Array, joint_index: Index, turn: Array) -> None:
    """`planar_turns` of many robots: `qpos` (m, nq) and `turn` (m, t, n); `copies` picks some of them."""
    for i in copies:
        planar_turns(qpos[i], joint_index, turn[i])


@compiled_in_place
def spatial_turns_of(
    copies: Index, points: Array, site_index: Index, ends: Index, axis: Array, turn: Array
) -> None:
    """`spatial_turns` of many robots: `points` (m, s, 3) and `turn` (m, t, n); `copies` picks some."""
    for i in copies:
        spatial_turns(points[i], site_index, ends, axis, turn[i])
