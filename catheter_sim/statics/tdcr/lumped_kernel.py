"""Equilibrium of a robot whose subsegments have few degrees of freedom each, compiled.

All compiled code of CC_sub and PRB is in this file: the compiled form is kept on disk and renewed
when this file changes, not when another does.

**Equations.** Subsegment k (its base is disk k) has d unknowns and d balances: the moment M_k(c) of
everything beyond it about a point c, along an axis a, is the elastic moment s,

    r = a . (M_k about c) - s,

with a, c and s functions of the subsegment's own unknowns (`arc`, `links`). The forces on a disk are
those of Rao et al. 2021, Eqs. 30-33, without their part along the disk's normal (Eq. 58; but for the
disk in which the tendon ends), the tendons being straight from hole to hole.

**Derivative.** In the frame of the tip, the tendons' part of balance k depends on the unknowns of
subsegments k and beyond only; loads that keep their direction in the base frame add what the tip's
rotation brings. So the derivative is U + B C, U block upper triangular, B (n d, 3) the effect of
turning the loads against the tip, C (3, n d) the tip's rotation by the unknowns. Off its diagonal U is of
low rank: a farther unknown acts through the force and the moment that it changes and the turn that it gives
the loads between, nine numbers that the back substitution sums up. So Newton's step costs as much as the
balances do, in proportion to n.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from catheter_sim.compiled import compiled
from catheter_sim.robots.posture import Array

# Models: one arc per subsegment (d = 3); four rigid links (d = 5), the bending plane and the twist
# balanced at the subsegment's base; the same, balanced at its middle and its end.
ARC, LINKS, LINKS_MIDDLE = 0, 1, 2
DEGREES = (3, 5, 5)
PLANE = 3  # which unknown of the links is the bending plane's angle
# Rao 2021, Table 1, divided by their sum 0.999 so that the links are as long as the subsegment.
LINK_SHARES = np.array([0.125, 0.35, 0.388, 0.136]) / 0.999
SPRING_FACTORS = np.array([3.25, 2.84, 2.95])
TOLERANCE_RAD = 1e-12  # unbalanced moment over EI / length at which Newton's method stops
_BALANCED_RAD = 1e-9  # where rounding keeps it from that, what still counts as balance
_MOST_STEPS = 40
_LONGEST_STEP_RAD = 1.0  # of any unknown; longer ones are shortened
_ABSURD_STEP_RAD = 1e3
_SHORTEST_SHARE = 1e-3  # of the load
_SMALL_RAD2 = 1e-4  # squared angle below which the series is exact to the last bit
_PLANE_FLOOR = 1e-9  # keeps the bending plane of an unloaded subsegment where it is


@compiled
def _cross(a: Array, b: Array, out: Array) -> None:
    x = a[1] * b[2] - a[2] * b[1]
    y = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    out[0] = x
    out[1] = y


@compiled
def _add_cross(a: Array, b: Array, out: Array) -> None:
    out[0] += a[1] * b[2] - a[2] * b[1]
    out[1] += a[2] * b[0] - a[0] * b[2]
    out[2] += a[0] * b[1] - a[1] * b[0]


@compiled
def _dot(a: Array, b: Array) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def _copy(a: Array, out: Array) -> None:
    for i in range(3):
        out[i] = a[i]


@compiled
def _add(a: Array, out: Array) -> None:
    for i in range(3):
        out[i] += a[i]


@compiled
def _clear(out: Array) -> None:
    """Set a contiguous array to zero."""
    flat = out.reshape(-1)
    for i in range(len(flat)):
        flat[i] = 0.0


@compiled
def _chain(R: Array, turn: Array, out: Array) -> None:
    """Write R turn into `out`."""
    for i in range(3):
        for j in range(3):
            out[i, j] = R[i, 0] * turn[0, j] + R[i, 1] * turn[1, j] + R[i, 2] * turn[2, j]


@compiled
def _turned(R: Array, a: Array, out: Array) -> None:
    """Write R a into `out`, which must not be `a`."""
    for i in range(3):
        out[i] = R[i, 0] * a[0] + R[i, 1] * a[1] + R[i, 2] * a[2]


@compiled
def _turned_back(R: Array, a: Array, out: Array) -> None:
    """Write R^T a into `out`, which must not be `a`."""
    for i in range(3):
        out[i] = R[0, i] * a[0] + R[1, i] * a[1] + R[2, i] * a[2]


@compiled
def arc(
    x: Array,
    length: float,
    bending: float,
    torsion: float,
    p: Array,
    R: Array,
    spin: Array,
    drift: Array,
    axis: Array,
    point: Array,
    daxis: Array,
    dpoint: Array,
    law: Array,
    dlaw: Array,
) -> None:
    """Write one subsegment of CC_sub: bends toward +x and +y, and twist, `x`, shape (3,) [rad].

    Written: the pose `p`, `R` of its end in the frame of its base; by unknown the angular velocity
    `spin` and velocity `drift` of its end, shape (d, 3); by balance the axis and the point,
    shape (d, 3), their derivatives, shape (d, d, 3) (balance, unknown), and the elastic moment with
    its derivative, shapes (d,) and (d, d).

    Rao 2021, Eqs. 43-47: moments about the subsegment's base, twisting moment along its end's normal.
    Eq. 43 is resolved along the axes of the arc's end, so that a twist that is locked drops out.
    """
    bx, by, twist = x[0], x[1], x[2]
    t2 = bx * bx + by * by
    if t2 < _SMALL_RAD2:
        sine = 1.0 - t2 / 6.0 * (1.0 - t2 / 20.0)
        versine = 0.5 - t2 / 24.0 * (1.0 - t2 / 30.0)
        third = 1.0 / 6.0 - t2 / 120.0 * (1.0 - t2 / 42.0)
        dversine = -1.0 / 24.0 + t2 / 360.0
    else:
        t = math.sqrt(t2)
        half = math.sin(0.5 * t)
        sine = math.sin(t) / t
        versine = 2.0 * half * half / t2
        third = (1.0 - sine) / t2
        dversine = (sine - 2.0 * versine) / (2.0 * t2)
    dsine = (third - versine) / 2.0  # of sin(t) / t by t^2
    p[0], p[1], p[2] = length * versine * bx, length * versine * by, length * sine
    x_axis, y_axis, tangent = axis[1], axis[0], axis[2]  # R of the arc before its twist: -x, y, z
    x_axis[0], x_axis[1], x_axis[2] = -(1.0 - versine * bx * bx), versine * bx * by, sine * bx
    y_axis[0], y_axis[1], y_axis[2] = -versine * bx * by, 1.0 - versine * by * by, -sine * by
    tangent[0], tangent[1], tangent[2] = sine * bx, sine * by, 1.0 - versine * t2
    cosine, sine_twist = math.cos(twist), math.sin(twist)
    for i in range(3):
        R[i, 0] = -cosine * x_axis[i] + sine_twist * y_axis[i]
        R[i, 1] = sine_twist * x_axis[i] + cosine * y_axis[i]
        R[i, 2] = tangent[i]
    for b in range(2):
        other, own = (by, bx) if b == 0 else (bx, by)
        drift[b, b] = length * (versine + 2.0 * dversine * own * own)
        drift[b, 1 - b] = length * 2.0 * dversine * own * other
        drift[b, 2] = length * 2.0 * dsine * own
    # rotation vector w = (-by, bx, 0); spin = (1 + versine [w] + third [w]^2) dw
    spin[0, 0], spin[0, 1], spin[0, 2] = -third * bx * by, 1.0 - third * by * by, -versine * by
    spin[1, 0], spin[1, 1], spin[1, 2] = -1.0 + third * bx * bx, third * bx * by, versine * bx
    _copy(tangent, spin[2])
    _clear(drift[2])
    _clear(point)
    _clear(dpoint)
    _clear(dlaw)
    for e in range(3):
        for i in range(2):
            _cross(spin[i], axis[e], daxis[e, i])
        _clear(daxis[e, 2])
        stiffness = (torsion if e == 2 else bending) / length
        law[e] = stiffness * x[e]
        dlaw[e, e] = stiffness


@compiled
def links(
    model: int,
    x: Array,
    length: float,
    bending: float,
    torsion: float,
    p: Array,
    R: Array,
    spin: Array,
    drift: Array,
    axis: Array,
    point: Array,
    daxis: Array,
    dpoint: Array,
    law: Array,
    dlaw: Array,
) -> None:
    """Write one subsegment of PRB: three joints, plane and twist, `x`, shape (5,) [rad]; as `arc`.

    Rao 2021, Eqs. 11-12 and 48-54, moments in the plane's and the twist's balance about the base. The
    plane's balance is Eq. 52 in its one component: M* is the moment's part normal to the base's z
    axis, so that M* x y has the size of M* . e, e being the base's direction in the bending plane.
    `LINKS_MIDDLE`: plane balanced at the middle joint along the mean of base's and end's directions,
    twist at the end.
    """
    cosine, sine = math.cos(x[3]), math.sin(x[3])
    y, z, here, normal, arm = np.zeros(3), np.zeros(3), np.zeros(3), np.empty(3), np.empty(3)
    y[0], y[1], z[2] = -sine, cosine, 1.0
    here[2] = LINK_SHARES[0] * length
    turn = 0.0
    c, s = 1.0, 0.0
    for q in range(3):
        _copy(here, point[q])
        _copy(y, axis[q])
        turn += x[q]
        c, s = math.cos(turn), math.sin(turn)
        reach = LINK_SHARES[q + 1] * length
        here[0] += reach * s * cosine
        here[1] += reach * s * sine
        here[2] += reach * c
    _copy(here, p)
    half = 0.5 * turn if model == LINKS_MIDDLE else 0.0
    axis[3, 0], axis[3, 1], axis[3, 2] = math.cos(half) * cosine, math.cos(half) * sine, -math.sin(half)
    normal[0], normal[1], normal[2] = c * cosine, c * sine, -s
    tangent = axis[4]
    tangent[0], tangent[1], tangent[2] = s * cosine, s * sine, c
    across, along = math.cos(x[4] - x[3]), math.sin(x[4] - x[3])
    for i in range(3):
        R[i, 0] = across * normal[i] + along * y[i]
        R[i, 1] = -along * normal[i] + across * y[i]
        R[i, 2] = tangent[i]
    _clear(point[3])
    _clear(point[4])
    if model == LINKS_MIDDLE:
        _copy(point[1], point[3])
        _copy(p, point[4])
    _clear(daxis)
    _clear(dpoint)
    _clear(dlaw)
    for q in range(3):
        _copy(y, spin[q])
        for i in range(3):
            arm[i] = p[i] - point[q, i]
        _cross(y, arm, drift[q])
        for later in range(q + 1, 3):
            for i in range(3):
                arm[i] = point[later, i] - point[q, i]
            _cross(y, arm, dpoint[later, q])
        _cross(y, axis[4], daxis[4, q])
        if model == LINKS_MIDDLE:
            _cross(y, axis[3], daxis[3, q])
            for i in range(3):
                daxis[3, q, i] *= 0.5
        _cross(z, point[q], dpoint[q, 3])
        stiffness = SPRING_FACTORS[q] * bending / length
        law[q] = stiffness * x[q]
        dlaw[q, q] = stiffness
    for e in range(5):
        _cross(z, axis[e], daxis[e, 3])
    for i in range(3):
        spin[3, i] = z[i] - tangent[i]
        spin[4, i] = tangent[i]
    _cross(z, p, drift[3])
    _clear(drift[4])
    if model == LINKS_MIDDLE:
        for i in range(5):
            _copy(dpoint[1, i], dpoint[3, i])
            _copy(drift[i], dpoint[4, i])
    law[3] = 0.0
    law[4] = torsion / length * x[4]
    dlaw[4, 4] = torsion / length


@compiled
def _subsegment(
    model: int,
    x: Array,
    length: float,
    bending: float,
    torsion: float,
    p: Array,
    R: Array,
    spin: Array,
    drift: Array,
    axis: Array,
    point: Array,
    daxis: Array,
    dpoint: Array,
    law: Array,
    dlaw: Array,
) -> None:
    if model == ARC:
        arc(x, length, bending, torsion, p, R, spin, drift, axis, point, daxis, dpoint, law, dlaw)
    else:
        links(
            model, x, length, bending, torsion, p, R, spin, drift, axis, point, daxis, dpoint, law, dlaw
        )  # fmt: skip


@compiled
def frames(model: int, x: Array, length: Array, p: Array, R: Array) -> None:
    """Write the disks' positions `p`, shape (n + 1, 3), and orientations `R` at the unknowns `x`, (n, d)."""
    d = x.shape[1]
    step, turn = np.empty(3), np.empty((3, 3))
    by_unknown, by_balance = np.empty((2, d, 3)), np.empty((2, d, 3))
    by_both, law, dlaw = np.empty((2, d, d, 3)), np.empty(d), np.empty((d, d))
    _clear(p[0])
    _clear(R[0])
    R[0, 0, 0] = R[0, 1, 1] = R[0, 2, 2] = 1.0
    for k in range(len(x)):
        _subsegment(
            model, x[k], length[k], 1.0, 1.0, step, turn, by_unknown[0], by_unknown[1],
            by_balance[0], by_balance[1], by_both[0], by_both[1], law, dlaw,
        )  # fmt: skip
        _turned(R[k], step, p[k + 1])
        _add(p[k], p[k + 1])
        _chain(R[k], turn, R[k + 1])


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
        B, C: see the module's text, shapes (n, d, 3).
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
    step, turn = np.empty(3), np.empty((3, 3))
    own = np.empty((4, n, d, 3))  # spin, drift, axis, point in the base frame
    here = np.empty((n, 4, d, 3))  # the same in that of the subsegment, and there:
    daxis, dpoint = np.empty((n, d, d, 3)), np.empty((n, d, d, 3))
    law, dlaw = np.empty((n, d)), np.empty((n, d, d))
    _clear(p[0])
    _clear(R[0])
    R[0, 0, 0] = R[0, 1, 1] = R[0, 2, 2] = 1.0
    for k in range(n):
        stiffness = torsion[k] if math.isfinite(torsion[k]) else 0.0
        _subsegment(
            model, x[k], length[k], bending[k], stiffness, step, turn, here[k, 0], here[k, 1],
            here[k, 2], here[k, 3], daxis[k], dpoint[k], law[k], dlaw[k],
        )  # fmt: skip
        _turned(R[k], step, p[k + 1])
        _add(p[k], p[k + 1])
        _chain(R[k], turn, R[k + 1])
        for e in range(d):
            for which in range(2, 4):
                _turned(R[k], here[k, which, e], own[which, k, e])
            _add(p[k], own[3, k, e])
    spin, drift, axis, point = own[0], own[1], own[2], own[3]

    # Tendons: holes, directions of the spans, tensions, forces on the disks.
    h = np.empty((count, n + 1, 3))
    u = np.zeros((count, n + 1, 3))  # of span j, from disk j - 1 to disk j; 0: below the base
    u[:, 0, 2] = 1.0
    size = np.ones((count, n + 1))
    total, turning = np.zeros((n + 2, 3)), np.zeros((n + 2, 3))  # of disks k and beyond; about the origin
    F, M = np.empty(3), np.empty(3)
    for t in range(count):
        for m in range(last[t] + 1):
            for i in range(3):
                h[t, m, i] = p[m, i] + R[m, i, 0] * hole[t, 0] + R[m, i, 1] * hole[t, 1]
        now = tension[t]
        for m in range(1, last[t] + 1):
            for i in range(3):
                u[t, m, i] = h[t, m, i] - h[t, m - 1, i]
            size[t, m] = math.sqrt(_dot(u[t, m], u[t, m]))
            for i in range(3):
                u[t, m, i] /= size[t, m]
            if mu > 0.0:
                before = u[t, m - 1]
                _cross(before, u[t, m], F)
                now *= math.exp(-mu * math.atan2(math.sqrt(_dot(F, F)), _dot(before, u[t, m])))
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
            _add(F, total[m])
            _add_cross(h[t, m], F, turning[m])

    # What lies beyond each place.
    _clear(loads)
    _clear(swing)
    for m in range(n, 0, -1):
        f, g = force[m - 1], moment[m - 1]
        _add(f, total[m])
        _add(total[m + 1], total[m])
        _add_cross(p[m], f, turning[m])
        _add(g, turning[m])
        _add(turning[m + 1], turning[m])
        _copy(loads[m + 1], loads[m])
        _add(f, loads[m])
        along = _dot(p[m], f)
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

    # Balances.
    for k in range(n):
        _cross(p[k], total[k + 1], M)
        for i in range(3):
            wrench[k, i] = total[k + 1, i]
            wrench[k, 3 + i] = turning[k + 1, i] - M[i]
        for e in range(d):
            a, c = axis[k, e], point[k, e]
            _cross(c, total[k + 1], M)
            r[k, e] = a[0] * (turning[k + 1, 0] - M[0]) + a[1] * (turning[k + 1, 1] - M[1])
            r[k, e] += a[2] * (turning[k + 1, 2] - M[2]) - law[k, e]

    norm = 0.0
    for k in range(n):
        for e in range(d):
            if not free[k, e]:
                r[k, e] = -x[k, e] * bending[k] / length[k]
            norm = max(norm, abs(r[k, e]) * length[k] / bending[k])
    if norm < enough:
        return norm

    # The effect of turning the loads against the tip.
    turned = np.empty((3, 3))
    for k in range(n):
        for e in range(d):
            a, c = axis[k, e], point[k, e]
            for which in range(2):
                _turned(R[k], here[k, which, e], own[which, k, e])
            _copy(spin[k, e], C[k, e])
            along = _dot(c, loads[k + 1])
            for i in range(3):
                for j in range(3):
                    turned[i, j] = swing[k + 1, i, j] - loads[k + 1, i] * c[j]
                turned[i, i] += along
            for j in range(3):
                B[k, e, j] = a[0] * turned[0, j] + a[1] * turned[1, j] + a[2] * turned[2, j]

    # U: unknown i of subsegment k turns all beyond disk k about p[k + 1], loads included.
    N, dF, dM, near_F, near_M = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    w, du, arm = np.empty(3), np.empty(3), np.empty(3)
    axes, levers, by_force, by_moment = parts[0], parts[1], parts[2], parts[3]
    for k in range(n):
        end = k + 1
        _cross(p[end], total[end], N)
        _cross(p[k], total[end], M)
        for i in range(3):
            N[i] = turning[end, i] - N[i]
            M[i] = turning[end, i] - M[i]
        _turned_back(R[k], total[end], near_F)
        _turned_back(R[k], M, near_M)
        for e in range(d):  # what the balances' own axes and points bring
            a, c = here[k, 2, e], here[k, 3, e]
            _cross(c, near_F, M)
            for c3 in range(3):
                M[c3] = near_M[c3] - M[c3]
            for i in range(d):
                _cross(dpoint[k, e, i], near_F, w)
                D[k, e, i] = _dot(daxis[k, e, i], M) - _dot(a, w) - dlaw[k, e, i]
            _copy(axis[k, e], axes[k, e])
            _cross(axis[k, e], point[k, e], levers[k, e])
        for i in range(d):
            omega, velocity = spin[k, i], drift[k, i]
            _cross(omega, total[end], dF)
            _cross(omega, N, dM)
            _add_cross(p[end], dF, dM)
            _add_cross(velocity, total[end], dM)
            _clear(near_F)
            _clear(near_M)
            for t in range(count):
                if last[t] < end:
                    continue
                # span `end` changes direction against the body beyond it by du
                for c3 in range(3):
                    arm[c3] = h[t, k, c3] - p[end, c3]
                _cross(omega, arm, w)
                for c3 in range(3):
                    w[c3] += velocity[c3]
                along = _dot(u[t, end], w)
                for c3 in range(3):
                    du[c3] = (w[c3] - along * u[t, end, c3]) / size[t, end]
                pull = span[t, k]
                normal = 0.0
                if projected and end < last[t]:
                    normal = du[0] * R[end, 0, 2] + du[1] * R[end, 1, 2] + du[2] * R[end, 2, 2]
                for c3 in range(3):
                    F[c3] = -pull * (du[c3] - normal * R[end, c3, 2])
                    dF[c3] += F[c3]
                _add_cross(h[t, end], F, dM)
                if k > 0:
                    _add_cross(omega, u[t, end], du)
                    before = span[t, k - 1]
                    normal = 0.0
                    if projected:
                        normal = du[0] * R[k, 0, 2] + du[1] * R[k, 1, 2] + du[2] * R[k, 2, 2]
                    for c3 in range(3):
                        F[c3] = before * (du[c3] - normal * R[k, c3, 2]) + (pull - before) * du[c3]
                        near_F[c3] += F[c3]
                    _add_cross(h[t, k], F, near_M)
            for e in range(d):
                D[k, e, i] += _dot(axes[k, e], dM) - _dot(levers[k, e], dF)
            # On the subsegments before: with the near disk's part, and the loads up to here turning.
            _cross(omega, loads[end], F)
            for c3 in range(3):
                by_force[k, i, c3] = dF[c3] + near_F[c3] - F[c3]
                by_moment[k, i, c3] = dM[c3] + near_M[c3]
                for c4 in range(3):
                    by_moment[k, i, c3] += swing[end, c3, c4] * omega[c4]
    for k in range(n):
        if model != ARC:  # an unloaded subsegment has no bending plane
            floor = _PLANE_FLOOR * bending[k] / length[k]
            D[k, PLANE, PLANE] += -floor if D[k, PLANE, PLANE] <= 0.0 else floor
        for e in range(d):
            if not free[k, e]:
                _clear(D[k, e])
                _clear(B[k, e])
                _clear(axes[k, e])
                _clear(levers[k, e])
                D[k, e, e] = -bending[k] / length[k]
    return norm


@compiled
def _eliminate(A: Array, b: Array) -> None:
    """Solve A y = b in place, `b` of shape (m, columns), by elimination with row exchange."""
    m, columns = b.shape
    for i in range(m):
        best = i
        for j in range(i + 1, m):
            if abs(A[j, i]) > abs(A[best, i]):
                best = j
        if best != i:
            for j in range(m):
                A[i, j], A[best, j] = A[best, j], A[i, j]
            for j in range(columns):
                b[i, j], b[best, j] = b[best, j], b[i, j]
        for j in range(i + 1, m):
            factor = A[j, i] / A[i, i]
            for q in range(i + 1, m):
                A[j, q] -= factor * A[i, q]
            for q in range(columns):
                b[j, q] -= factor * b[i, q]
    for i in range(m - 1, -1, -1):
        for q in range(columns):
            for j in range(i + 1, m):
                b[i, q] -= A[i, j] * b[j, q]
            b[i, q] /= A[i, i]


@compiled
def newton_step(
    r: Array, D: Array, parts: Array, loads: Array, swing: Array, B: Array, C: Array, step: Array
) -> None:
    """Write the solution of (U + B C) step = -r, shapes as in `evaluate`; D is overwritten."""
    n, d = r.shape
    axes, levers, by_force, by_moment = parts[0], parts[1], parts[2], parts[3]
    y = np.empty((n, d, 4))
    force, moment, turn = np.zeros((4, 3)), np.zeros((4, 3)), np.zeros((4, 3))  # of the subsegments beyond
    F, M = np.empty(3), np.empty(3)
    for k in range(n - 1, -1, -1):
        for q in range(4):
            _cross(turn[q], loads[k + 1], F)
            for i in range(3):
                F[i] += force[q, i]
                M[i] = moment[q, i]
                for j in range(3):
                    M[i] -= swing[k + 1, i, j] * turn[q, j]
            for e in range(d):
                y[k, e, q] = r[k, e] if q == 0 else B[k, e, q - 1]
                y[k, e, q] -= _dot(axes[k, e], M) - _dot(levers[k, e], F)
        _eliminate(D[k], y[k])
        for q in range(4):
            for e in range(d):
                for i in range(3):
                    force[q, i] += by_force[k, e, i] * y[k, e, q]
                    moment[q, i] += by_moment[k, e, i] * y[k, e, q]
                    turn[q, i] += C[k, e, i] * y[k, e, q]
    tip, answer = np.zeros((3, 3)), np.zeros((3, 1))
    tip[0, 0] = tip[1, 1] = tip[2, 2] = 1.0
    for k in range(n):
        for e in range(d):
            for i in range(3):
                answer[i, 0] += C[k, e, i] * y[k, e, 0]
                for q in range(3):
                    tip[i, q] += C[k, e, i] * y[k, e, q + 1]
    _eliminate(tip, answer)
    for k in range(n):
        for e in range(d):
            step[k, e] = -y[k, e, 0]
            for q in range(3):
                step[k, e] += y[k, e, q + 1] * answer[q, 0]


@compiled
def _largest(values: Array) -> float:
    """Return the largest size in a matrix; NaN where it holds one."""
    largest = 0.0
    for k in range(values.shape[0]):
        for e in range(values.shape[1]):
            if not abs(values[k, e]) <= largest:
                largest = abs(values[k, e])
    return largest


@compiled
def _straighten(model: int, x: Array) -> None:
    """Set all bends and twists to zero; the bending planes stay."""
    for k in range(len(x)):
        for e in range(x.shape[1]):
            if model == ARC or e != PLANE:
                x[k, e] = 0.0


@compiled
def solve(
    model: int,
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
    first_share: Array,
    x: Array,
    span: Array,
    wrench: Array,
    p: Array,
    R: Array,
    residual: Array,
    reached: Array,
    steps: Any,
) -> None:
    """Solve r rows; arguments as of `evaluate` with rows in front.

    Where Newton's method fails at the full load, the load is raised from zero in steps that halve
    where it fails and double where it does not; no row reads another, so that their order is nothing.

    Args:
        first_share: of the load, with which to begin, shape (r,); below 1: begin at the straight robot.
        x: a guess, overwritten by the unknowns, shape (r, n, d) [rad]; likewise `span` to `R`.
        residual: largest unbalanced moment, shape (r,) [N m].
        reached: share of the load at which there is balance, shape (r,); below 1: no equilibrium was
            found, and the row's posture is none.
        steps: load steps that were taken, shape (r,).
    """
    rows, n, d = x.shape
    r, B, C = np.empty((n, d)), np.empty((n, d, 3)), np.empty((n, d, 3))
    D, parts = np.empty((n, d, d)), np.empty((4, n, d, 3))
    loads, swing = np.empty((n + 2, 3)), np.empty((n + 2, 3, 3))
    step, good = np.empty((n, d)), np.empty((n, d))
    for row in range(rows):
        now = x[row]
        good[:] = now
        if first_share[row] < 1.0:
            _straighten(model, good)
        done, share, count = 0.0, first_share[row], 0
        while done < 1.0 and share > _SHORTEST_SHARE:
            part = min(1.0, done + share)
            now[:] = good
            norm = np.inf
            for _ in range(_MOST_STEPS):
                norm = evaluate(
                    model, now, free, length, bending, torsion, hole, last, mu, projected,
                    part * tension[row], part * force[row], part * moment[row],
                    r, D, parts, loads, swing, B, C, span[row], wrench[row], p[row], R[row], TOLERANCE_RAD,
                )  # fmt: skip
                if norm < TOLERANCE_RAD:
                    break
                newton_step(r, D, parts, loads, swing, B, C, step)
                longest = _largest(step)
                if not longest < _ABSURD_STEP_RAD:
                    norm = np.inf
                    break
                scale = min(1.0, _LONGEST_STEP_RAD / longest)
                for k in range(n):
                    for e in range(d):
                        now[k, e] += scale * step[k, e]
            if norm < _BALANCED_RAD:
                good[:] = now
                done = part
                count += 1
                share = min(2.0 * share, first_share[row])
            else:
                if done == 0.0:
                    _straighten(model, good)
                share *= 0.5
        now[:] = good
        reached[row] = done
        steps[row] = count
        residual[row] = _largest(r)
