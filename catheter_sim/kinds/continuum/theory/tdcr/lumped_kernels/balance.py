"""What the balances of a lumped robot lack, and how that changes with its unknowns, compiled."""

from __future__ import annotations

import math
from typing import Any

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.tdcr.lumped_kernels.derivative import (
    derive_own,
    hold_locked,
    turn_loads,
)
from catheter_sim.kinds.continuum.theory.tdcr.lumped_kernels.forces import sum_beyond, tendon_forces
from catheter_sim.kinds.continuum.theory.tdcr.lumped_kernels.subsegments import subsegment
from catheter_sim.mechanics.compiled import compiled, inlined
from catheter_sim.mechanics.eight import all_less, larger, room
from catheter_sim.mechanics.vectors import add3, cross3, fill, product3, turned


@inlined
def _balances(
    x: Array,
    free: Any,
    length: Array,
    bending: Array,
    p: Array,
    axis: Array,
    point: Array,
    law: Array,
    total: Array,
    turning: Array,
    r: Array,
    wrench: Array,
) -> float:
    """Write the unbalanced moments and the wrenches; return the largest moment over EI / length [rad].

    Args:
        axis, point, law: of the balances in the base frame, shapes (n, d, 3), (n, d, 3), and (n, d).
        total, turning: as `forces.sum_beyond` left them.
        x, free, length, bending, p, r, wrench: as of `evaluate`.
    """
    n, d = x.shape
    M = room((3,), x)
    for k in range(n):
        cross3(p[k], total[k + 1], M)
        for i in range(3):
            wrench[k, i] = total[k + 1, i]
            wrench[k, 3 + i] = turning[k + 1, i] - M[i]
        for e in range(d):
            a, c = axis[k, e], point[k, e]
            cross3(c, total[k + 1], M)
            r[k, e] = a[0] * (turning[k + 1, 0] - M[0]) + a[1] * (turning[k + 1, 1] - M[1])
            r[k, e] += a[2] * (turning[k + 1, 2] - M[2]) - law[k, e]

    norm = 0.0
    for k in range(n):
        for e in range(d):
            if not free[k, e]:
                r[k, e] = -x[k, e] * bending[k] / length[k]
            norm = larger(norm, abs(r[k, e]) * length[k] / bending[k])
    return norm


@compiled
def evaluate(
    model: int,
    x: Array,
    free: Any,
    length: Array,
    bending: Array,
    torsion: Array,
    hole: Array,
    last: Any,
    mu: float,
    projected: bool,
    tension: Array,
    force: Array,
    moment: Array,
    r: Array,
    D: Array,
    parts: Array,
    loads: Array,
    swing: Array,
    B: Array,
    C: Array,
    span: Array,
    wrench: Array,
    p: Array,
    R: Array,
    enough: float,
) -> float:
    """Write the balances and their derivative at the unknowns `x`, shape (n, d).

    Args:
        model: `ARC` or `LINKS`.
        x: unknowns [rad].
        free: which of them may move, shape (n, d); the others are held at zero.
        length, bending, torsion: of the subsegments, shape (n,).
        hole, last: of the tendons, shapes (t, 2), (t,).
        mu: capstan coefficient; every tendon slides toward the base.
        projected: whether Eq. 58 is applied.
        tension: at the base, shape (t,) [N].
        force, moment: on disks 1 to n, base frame, shape (n, 3).
        r: unbalanced moment, shape (n, d) [N m].
        D: the diagonal of U, shape (n, d, d).
        parts: axes and axes x points by balance, force and moment by unknown, shape (4, n, d, 3).
        loads, swing: force of the loads on disks k and beyond, shape (n + 2, 3), and G with a turn w of
            these loads adding -G w to their moment about the origin, shape (n + 2, 3, 3).
        B, C: see the text of `derivative`, shapes (n, d, 3).
        span: tension in each span, shape (t, n) [N]; it enters the derivative as a constant.
        wrench: force [N] and moment [N m] about the subsegment's base of what acts beyond it, base
            frame, shape (n, 6).
        p, R: poses of the disks, shapes (n + 1, 3), (n + 1, 3, 3).
        enough: where nothing is further from balance than this, the derivative is left out [rad].

    Returns:
        The largest unbalanced moment over EI / length [rad].
    """
    n, d = x.shape
    count = len(hole)
    step, turn = room((3,), x), room((3, 3), x)
    own = room((4, n, d, 3), x)  # spin, drift, axis, point in the base frame
    here = room((n, 4, d, 3), x)  # the same in that of the subsegment, and there:
    daxis, dpoint = room((n, d, d, 3), x), room((n, d, d, 3), x)
    law, dlaw = room((n, d), x), room((n, d, d), x)
    fill(p[0], 0.0)
    fill(R[0], 0.0)
    R[0, 0, 0] = R[0, 1, 1] = R[0, 2, 2] = 1.0
    for k in range(n):
        stiffness = torsion[k] if math.isfinite(torsion[k]) else 0.0
        subsegment(
            model, x[k], length[k], bending[k], stiffness, step, turn, here[k, 0], here[k, 1],
            here[k, 2], here[k, 3], daxis[k], dpoint[k], law[k], dlaw[k],
        )  # fmt: skip
        turned(R[k], step, p[k + 1])
        add3(p[k], p[k + 1])
        product3(R[k], turn, R[k + 1])
        for e in range(d):
            for which in range(2, 4):
                turned(R[k], here[k, which, e], own[which, k, e])
            add3(p[k], own[3, k, e])
    axis, point = own[2], own[3]

    h, u, size = room((count, n + 1, 3), x), room((count, n + 1, 3), x), room((count, n + 1), x)
    total, turning = room((n + 2, 3), x), room((n + 2, 3), x)
    fill(u, 0.0)
    for t in range(count):
        u[t, 0, 2] = 1.0
    fill(size, 1.0)
    fill(total, 0.0)
    fill(turning, 0.0)
    tendon_forces(hole, last, mu, projected, tension, p, R, h, u, size, span, total, turning)
    sum_beyond(p, force, moment, total, turning, loads, swing)
    norm = _balances(x, free, length, bending, p, axis, point, law, total, turning, r, wrench)
    if all_less(norm, enough):
        return norm
    turn_loads(R, here, own, loads, swing, B, C)
    derive_own(
        hole, last, projected, p, R, here, own, daxis, dpoint, dlaw, h, u, size, span, total, turning,
        loads, swing, D, parts,
    )  # fmt: skip
    hold_locked(model, free, length, bending, D, B, parts)
    return norm
