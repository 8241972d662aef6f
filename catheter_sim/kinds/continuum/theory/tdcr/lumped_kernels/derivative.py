"""How the balances of a lumped robot change with its unknowns, compiled.

In the frame of the tip, the tendons' part of balance k depends on the unknowns of subsegments k and beyond
only; loads that keep their direction in the base frame add what the tip's rotation brings. So the
derivative is U + B C, U block upper triangular, B (n d, 3) the effect of turning the loads against the tip,
C (3, n d) the tip's rotation by the unknowns. Off its diagonal U is of low rank: a farther unknown acts
through the force and the moment that it changes and the turn that it gives the loads between, nine numbers
that the back substitution sums up. So Newton's step costs as much as the balances do, in proportion to n.
"""

from __future__ import annotations

from typing import Any

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.tdcr.lumped_kernels.models import ARC, PLANE
from catheter_sim.mechanics.compiled import inlined
from catheter_sim.mechanics.eight import room, select_less
from catheter_sim.mechanics.vectors import add_cross3, copy3, cross3, dot3, fill, turned, turned_back

_PLANE_FLOOR = 1e-9  # keeps the bending plane of an unloaded subsegment where it is


@inlined
def turn_loads(R: Array, here: Array, own: Array, loads: Array, swing: Array, B: Array, C: Array) -> None:
    """Write the effect of turning the loads against the tip, `B`, and the tip's turn by the unknowns, `C`.

    Args:
        here: angular velocity and velocity by the unknowns, axis and point of the balances in the
            subsegments' own frames, shape (n, 4, d, 3).
        own: the same in the base frame, shape (4, n, d, 3); the first two are written here.
        R, loads, swing, B, C: as of `balance.evaluate`.
    """
    n, d = B.shape[0], B.shape[1]
    spin, axis, point = own[0], own[2], own[3]
    turned_loads = room((3, 3), B)
    for k in range(n):
        for e in range(d):
            a, c = axis[k, e], point[k, e]
            for which in range(2):
                turned(R[k], here[k, which, e], own[which, k, e])
            copy3(spin[k, e], C[k, e])
            along = dot3(c, loads[k + 1])
            for i in range(3):
                for j in range(3):
                    turned_loads[i, j] = swing[k + 1, i, j] - loads[k + 1, i] * c[j]
                turned_loads[i, i] += along
            for j in range(3):
                B[k, e, j] = a[0] * turned_loads[0, j] + a[1] * turned_loads[1, j] + a[2] * turned_loads[2, j]


@inlined
def derive_own(
    hole: Array,
    last: Any,
    projected: bool,
    p: Array,
    R: Array,
    here: Array,
    own: Array,
    daxis: Array,
    dpoint: Array,
    dlaw: Array,
    h: Array,
    u: Array,
    size: Array,
    span: Array,
    total: Array,
    turning: Array,
    loads: Array,
    swing: Array,
    D: Array,
    parts: Array,
) -> None:
    """Write U: unknown i of subsegment k turns all beyond disk k about p[k + 1], loads included.

    Args:
        here, own: as of `turn_loads`.
        daxis, dpoint, dlaw: derivatives of the balances' axes, points and elastic moments by the unknowns, in
            the subsegments' own frames, shapes (n, d, d, 3), (n, d, d, 3), and (n, d, d).
        h, u, size: as `forces.tendon_forces` left them; total, turning: as `forces.sum_beyond` did.
        hole, last, projected, p, R, span, loads, swing, D, parts: as of `balance.evaluate`.
    """
    count, n, d = len(hole), D.shape[0], D.shape[1]
    spin, drift, axis, point = own[0], own[1], own[2], own[3]
    F, M = room((3,), D), room((3,), D)
    N, dF, dM = room((3,), D), room((3,), D), room((3,), D)
    near_F, near_M = room((3,), D), room((3,), D)
    w, du, arm = room((3,), D), room((3,), D), room((3,), D)
    axes, levers, by_force, by_moment = parts[0], parts[1], parts[2], parts[3]
    for k in range(n):
        end = k + 1
        cross3(p[end], total[end], N)
        cross3(p[k], total[end], M)
        for i in range(3):
            N[i] = turning[end, i] - N[i]
            M[i] = turning[end, i] - M[i]
        turned_back(R[k], total[end], near_F)
        turned_back(R[k], M, near_M)
        for e in range(d):  # what the balances' own axes and points bring
            a, c = here[k, 2, e], here[k, 3, e]
            cross3(c, near_F, M)
            for c3 in range(3):
                M[c3] = near_M[c3] - M[c3]
            for i in range(d):
                cross3(dpoint[k, e, i], near_F, w)
                D[k, e, i] = dot3(daxis[k, e, i], M) - dot3(a, w) - dlaw[k, e, i]
            copy3(axis[k, e], axes[k, e])
            cross3(axis[k, e], point[k, e], levers[k, e])
        for i in range(d):
            omega, velocity = spin[k, i], drift[k, i]
            cross3(omega, total[end], dF)
            cross3(omega, N, dM)
            add_cross3(p[end], dF, dM)
            add_cross3(velocity, total[end], dM)
            fill(near_F, 0.0)
            fill(near_M, 0.0)
            for t in range(count):
                if last[t] < end:
                    continue
                # span `end` changes direction against the body beyond it by du
                for c3 in range(3):
                    arm[c3] = h[t, k, c3] - p[end, c3]
                cross3(omega, arm, w)
                for c3 in range(3):
                    w[c3] += velocity[c3]
                along = dot3(u[t, end], w)
                for c3 in range(3):
                    du[c3] = (w[c3] - along * u[t, end, c3]) / size[t, end]
                pull = span[t, k]
                normal = 0.0
                if projected and end < last[t]:
                    normal = du[0] * R[end, 0, 2] + du[1] * R[end, 1, 2] + du[2] * R[end, 2, 2]
                for c3 in range(3):
                    F[c3] = -pull * (du[c3] - normal * R[end, c3, 2])
                    dF[c3] += F[c3]
                add_cross3(h[t, end], F, dM)
                if k > 0:
                    add_cross3(omega, u[t, end], du)
                    before = span[t, k - 1]
                    normal = 0.0
                    if projected:
                        normal = du[0] * R[k, 0, 2] + du[1] * R[k, 1, 2] + du[2] * R[k, 2, 2]
                    for c3 in range(3):
                        F[c3] = before * (du[c3] - normal * R[k, c3, 2]) + (pull - before) * du[c3]
                        near_F[c3] += F[c3]
                    add_cross3(h[t, k], F, near_M)
            for e in range(d):
                D[k, e, i] += dot3(axes[k, e], dM) - dot3(levers[k, e], dF)
            # On the subsegments before: with the near disk's part, and the loads up to here turning.
            cross3(omega, loads[end], F)
            for c3 in range(3):
                by_force[k, i, c3] = dF[c3] + near_F[c3] - F[c3]
                by_moment[k, i, c3] = dM[c3] + near_M[c3]
                for c4 in range(3):
                    by_moment[k, i, c3] += swing[end, c3, c4] * omega[c4]


@inlined
def hold_locked(
    model: int, free: Any, length: Array, bending: Array, D: Array, B: Array, parts: Array
) -> None:
    """Hold what may not move, and the bending planes of unloaded subsegments; arguments as of `evaluate`."""
    n, d = D.shape[0], D.shape[1]
    axes, levers = parts[0], parts[1]
    for k in range(n):
        if model != ARC:  # an unloaded subsegment has no bending plane
            floor = _PLANE_FLOOR * bending[k] / length[k]
            D[k, PLANE, PLANE] += select_less(0.0, D[k, PLANE, PLANE], floor, -floor)
        for e in range(d):
            if not free[k, e]:
                fill(D[k, e], 0.0)
                fill(B[k, e], 0.0)
                fill(axes[k, e], 0.0)
                fill(levers[k, e], 0.0)
                D[k, e, e] = -bending[k] / length[k]
