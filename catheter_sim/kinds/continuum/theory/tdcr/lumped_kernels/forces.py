"""What acts beyond each place of a lumped robot, compiled: tendons and loads."""

from __future__ import annotations

import math
from typing import Any

from catheter_sim.arrays import Array
from catheter_sim.mechanics.compiled import inlined
from catheter_sim.mechanics.eight import exponential, plane_angle, room
from catheter_sim.mechanics.vectors import add3, add_cross3, copy3, cross3, dot3, fill


@inlined
def tendon_forces(
    hole: Array,
    last: Any,
    mu: float,
    projected: bool,
    tension: Array,
    p: Array,
    R: Array,
    h: Array,
    u: Array,
    size: Array,
    span: Array,
    total: Array,
    turning: Array,
) -> None:
    """Write where tendons run and how they pull, and add their forces on the disks.

    Args:
        hole, last, mu, projected, tension: as of `balance.evaluate`.
        p, R: poses of the disks, shapes (n + 1, 3), (n + 1, 3, 3).
        h: out: positions of the holes, shape (t, n + 1, 3) [m].
        u, size: out: direction and length of span j, from disk j - 1 to disk j; at j = 0 the base's axis and
            1, shapes (t, n + 1, 3) and (t, n + 1).
        span: out: tension in each span, shape (t, n) [N].
        total, turning: in and out: force on each disk and its moment about the origin, shape (n + 2, 3).
    """
    count = len(hole)
    F = room((3,), p)
    for t in range(count):
        for m in range(last[t] + 1):
            for i in range(3):
                h[t, m, i] = p[m, i] + R[m, i, 0] * hole[t, 0] + R[m, i, 1] * hole[t, 1]
        now = tension[t]
        for m in range(1, last[t] + 1):
            for i in range(3):
                u[t, m, i] = h[t, m, i] - h[t, m - 1, i]
            size[t, m] = math.sqrt(dot3(u[t, m], u[t, m]))
            for i in range(3):
                u[t, m, i] /= size[t, m]
            if mu > 0.0:
                before = u[t, m - 1]
                cross3(before, u[t, m], F)
                now *= exponential(-mu * plane_angle(math.sqrt(dot3(F, F)), dot3(before, u[t, m])))
            span[t, m - 1] = now
        for m in range(1, last[t] + 1):
            for i in range(3):
                F[i] = -span[t, m - 1] * u[t, m, i]
            if m < last[t]:
                for i in range(3):
                    F[i] += span[t, m - 1] * u[t, m + 1, i]
                if projected:
                    normal = F[0] * R[m, 0, 2] + F[1] * R[m, 1, 2] + F[2] * R[m, 2, 2]
                    for i in range(3):
                        F[i] -= normal * R[m, i, 2]
                for i in range(3):  # friction acts along the tendon
                    F[i] += (span[t, m] - span[t, m - 1]) * u[t, m + 1, i]
            add3(F, total[m])
            add_cross3(h[t, m], F, turning[m])


@inlined
def sum_beyond(
    p: Array, force: Array, moment: Array, total: Array, turning: Array, loads: Array, swing: Array
) -> None:
    """Add the loads and sum up, from the tip on, what acts on each disk and beyond.

    Args:
        p, force, moment, loads, swing: as of `balance.evaluate`.
        total, turning: in: force and moment about the origin of the tendons on each disk; out: of tendons and
            loads on that disk and beyond, shape (n + 2, 3).
    """
    n = len(force)
    fill(loads, 0.0)
    fill(swing, 0.0)
    for m in range(n, 0, -1):
        f, g = force[m - 1], moment[m - 1]
        add3(f, total[m])
        add3(total[m + 1], total[m])
        add_cross3(p[m], f, turning[m])
        add3(g, turning[m])
        add3(turning[m + 1], turning[m])
        copy3(loads[m + 1], loads[m])
        add3(f, loads[m])
        along = dot3(p[m], f)
        for i in range(3):
            for j in range(3):
                swing[m, i, j] = swing[m + 1, i, j] + f[i] * p[m, j]
            swing[m, i, i] -= along
        swing[m, 0, 1] -= g[2]
        swing[m, 0, 2] += g[1]
        swing[m, 1, 0] += g[2]
        swing[m, 1, 2] -= g[0]
        swing[m, 2, 0] -= g[1]
        swing[m, 2, 1] += g[0]
