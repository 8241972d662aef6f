"""Tendons' rows in a model, and by how much they turn at their holes, compiled."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from catheter_sim.arrays import Array, Index
from catheter_sim.mechanics.compiled import compiled_in_place

# ----------------------------------------------------------------------------------------------------
# Where the slopes of chosen tendons lie in MuJoCo's sparse rows.


class TendonRows:
    """Where the nonzero entries of chosen tendons' d(length)/d(q) lie in MuJoCo's sparse rows.

    Attributes:
        entries, columns: place in `ten_J` and degree of freedom of each, shape (e,).
        starts: first of each tendon, and behind the last, shape (t + 1,).
    """

    def __init__(self, model: mujoco.MjModel, names: list[str], dofs: set[int]) -> None:
        entries: list[int] = []
        columns: list[int] = []
        starts = [0]
        for name in names:
            tendon = model.tendon(name).id
            start, count = int(model.ten_J_rowadr[tendon]), int(model.ten_J_rownnz[tendon])
            for entry in range(start, start + count):
                if int(model.ten_J_colind[entry]) in dofs:
                    entries.append(entry)
                    columns.append(int(model.ten_J_colind[entry]))
            starts.append(len(entries))
        self.entries = np.array(entries, dtype=np.uint64)
        self.columns = np.array(columns, dtype=np.uint64)
        self.starts = np.array(starts, dtype=np.uint64)

    def lines(self, span: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Return which tendons are simple: of each its first degree of freedom, or -1, shape (t,).

        Each degree of freedom of a simple one changes the length of one span, one after another as the spans
        are. `span`: whose length each entry changes, (e,); `ends`: number of spans of each tendon, (t,).
        """
        found = np.full(len(ends), -1, dtype=np.int64)
        for tendon, count in enumerate(ends):
            own = slice(int(self.starts[tendon]), int(self.starts[tendon + 1]))
            columns, order = self.columns[own].astype(np.int64), np.arange(count)
            if count and np.array_equal(span[own], order) and np.array_equal(columns, columns[:1] + order):
                found[tendon] = columns[0]
        return found


# ----------------------------------------------------------------------------------------------------
# By how much tendons turn at their holes, compiled.
#
# Index j counts tendons, k spans from 0 at the base; hole k lies just before span k. A tendon ends behind
# span `ends[j] - 1`.


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
