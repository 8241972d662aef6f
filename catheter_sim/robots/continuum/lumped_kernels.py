"""Equilibria of robots with few unknowns per subsegment, compiled."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.mechanics.compiled import compiled, inlined
from catheter_sim.mechanics.eight import (
    LANES,
    all_less,
    eights,
    exponential,
    floats_of_eights,
    lane,
    larger,
    plane_angle,
    room,
    select_less,
    sine_cosine,
    solve_columns_of_any,
    take_lane,
)
from catheter_sim.mechanics.vectors import (
    add3,
    add_cross3,
    copy3,
    cross3,
    dot3,
    fill,
    largest_size,
    product3,
    turned,
    turned_back,
)

# ----------------------------------------------------------------------------------------------------
# The lumped models of a subsegment and their numbers.

# Models: one arc per subsegment (d = 3); four rigid links (d = 5), the bending plane and the twist
# balanced at the subsegment's base; the same, balanced at its middle and its end; two rigid links with one
# joint (d = 3), balanced so, too. The last two unknowns of links are the bending plane's angle and the twist.
ARC, LINKS, LINKS_MIDDLE, LINKS_ONE = 0, 1, 2, 3
DEGREES = (3, 5, 5, 3)
PLANE = -2  # which unknown of the links is the bending plane's angle
# Rao 2021, Table 1, divided by their sum 0.999 so that the links are as long as the subsegment.
LINK_SHARES = np.array([0.125, 0.35, 0.388, 0.136]) / 0.999
SPRING_FACTORS = np.array([3.25, 2.84, 2.95])
# Of one joint (Rao 2021, Section 3.2.2, prints none): in the middle and as stiff as the subsegment, so that a
# moment turns its end as a rod's. Assumed.
ONE_SHARES = np.array([0.5, 0.5])
ONE_FACTOR = np.array([1.0])


# ----------------------------------------------------------------------------------------------------
# Poses, balances and elastic moments of one subsegment, compiled: an arc, or four rigid links.


class LumpedRod(NamedTuple):
    """A robot of n subsegments and t tendons as the loops take it.

    Attributes:
        model: `ARC`, `LINKS`, `LINKS_MIDDLE` or `LINKS_ONE`.
        free: which unknowns may move, shape (n, d); the others are held at zero.
        length, bending, torsion: of the subsegments, shape (n,).
        hole, last: of the tendons in each disk, and their ends, shapes (t, n + 1, 2), (t,).
        mu: capstan coefficient; every tendon slides toward the base.
        projected: whether Eq. 58 is applied.
    """

    model: int
    free: Any
    length: Array
    bending: Array
    torsion: Array
    hole: Array
    last: Any
    mu: float
    projected: bool


class DiskLoads(NamedTuple):
    """What acts on a robot; of several rows each array has a row for each.

    Attributes:
        tension: at the base, shape (t,) [N].
        force, moment: on disks 1 to n, base frame, shape (n, 3).
    """

    tension: Array
    force: Array
    moment: Array


class DiskStates(NamedTuple):
    """Where the disks are and what they feel; of several rows each array has a row for each.

    Attributes:
        span: tension in each span, shape (t, n) [N]; it enters the derivative as a constant.
        wrench: force [N] and moment [N m] about the subsegment's base of what acts beyond it, base
            frame, shape (n, 6).
        p, R: poses of the disks, shapes (n + 1, 3), (n + 1, 3, 3).
    """

    span: Array
    wrench: Array
    p: Array
    R: Array


class Unbalanced(NamedTuple):
    """What the balances lack, and their derivative U + B C.

    Attributes:
        r: unbalanced moment, shape (n, d) [N m].
        D: the diagonal of U, shape (n, d, d).
        parts: axes and axes x points by balance, force and moment by unknown, shape (4, n, d, 3).
        loads, swing: force of the loads on disks k and beyond, shape (n + 2, 3). G with a turn w of
            these loads adding -G w to their moment about the origin, shape (n + 2, 3, 3).
        B, C: the effect of turning the loads against the tip, and the tip's turn by the unknowns, (n, d, 3).
    """

    r: Array
    D: Array
    parts: Array
    loads: Array
    swing: Array
    B: Array
    C: Array


class LumpedPiece(NamedTuple):
    """What one subsegment with d unknowns does, in the frame of its base.

    Attributes:
        p, R: pose of its end, shapes (3,) [m] and (3, 3).
        spin, drift: angular velocity and velocity of its end by unknown, shape (d, 3).
        axis, point: of each balance, shape (d, 3).
        daxis, dpoint: their derivatives, shape (d, d, 3) (balance, unknown).
        law, dlaw: elastic moment and its derivative, shapes (d,) and (d, d).
    """

    p: Array
    R: Array
    spin: Array
    drift: Array
    axis: Array
    point: Array
    daxis: Array
    dpoint: Array
    law: Array
    dlaw: Array


_SMALL_RAD2 = 0.3  # squared angle below which the series is exact to the last bits


@compiled
def _arc_factors(t2: Any) -> tuple[Any, Any, Any, Any]:
    """Return sin(t) / t, (1 - cos t) / t^2, (t - sin t) / t^3, and the second one's derivative by t^2.

    Each is a series in t^2 whose next term is below 1e-16 of the first up to `_SMALL_RAD2`.
    """
    a = (
        t2
        * (1.0 / 42.0)
        * (1.0 - t2 * (1.0 / 72.0) * (1.0 - t2 * (1.0 / 110.0) * (1.0 - t2 * (1.0 / 156.0))))
    )
    third = (1.0 - t2 * (1.0 / 20.0) * (1.0 - a)) * (1.0 / 6.0)
    sine = 1.0 - t2 * third
    b = (
        t2
        * (1.0 / 56.0)
        * (1.0 - t2 * (1.0 / 90.0) * (1.0 - t2 * (1.0 / 132.0) * (1.0 - t2 * (1.0 / 182.0))))
    )
    versine = 0.5 - t2 * (1.0 / 24.0) * (1.0 - t2 * (1.0 / 30.0) * (1.0 - b))
    d = t2 * (4.0 / 270.0) * (1.0 - t2 * (5.0 / 528.0) * (1.0 - t2 * (6.0 / 910.0)))
    dversine = -(1.0 - t2 * (2.0 / 30.0) * (1.0 - t2 * (3.0 / 112.0) * (1.0 - d))) * (1.0 / 24.0)
    if not all_less(t2, _SMALL_RAD2):
        square = larger(t2, _SMALL_RAD2)
        t = math.sqrt(square)
        whole, _ = sine_cosine(t)
        half, _ = sine_cosine(0.5 * t)
        far_sine, far_versine = whole / t, 2.0 * half * half / square
        sine = select_less(t2, _SMALL_RAD2, sine, far_sine)
        versine = select_less(t2, _SMALL_RAD2, versine, far_versine)
        third = select_less(t2, _SMALL_RAD2, third, (1.0 - far_sine) / square)
        dversine = select_less(t2, _SMALL_RAD2, dversine, (far_sine - 2.0 * far_versine) / (2.0 * square))
    return sine, versine, third, dversine


@compiled
def arc(
    x: Array,
    length: float,
    bending: float,
    torsion: float,
    piece: LumpedPiece,
) -> None:
    """Write one subsegment of CC_sub: bends toward +x and +y, and twist, `x`, shape (3,) [rad].

    Rao 2021, Eqs. 43-47: moments about the subsegment's base, twisting moment along its end's normal.
    Eq. 43 is resolved along the axes of the arc's end, so that a twist that is locked drops out.
    """
    p, R, spin, drift, axis, point, daxis, dpoint, law, dlaw = piece
    bx, by, twist = x[0], x[1], x[2]
    t2 = bx * bx + by * by
    sine, versine, third, dversine = _arc_factors(t2)
    dsine = (third - versine) / 2.0  # of sin(t) / t by t^2
    p[0], p[1], p[2] = length * versine * bx, length * versine * by, length * sine
    x_axis, y_axis, tangent = axis[1], axis[0], axis[2]  # R of the arc before its twist: -x, y, z
    x_axis[0], x_axis[1], x_axis[2] = -(1.0 - versine * bx * bx), versine * bx * by, sine * bx
    y_axis[0], y_axis[1], y_axis[2] = -versine * bx * by, 1.0 - versine * by * by, -sine * by
    tangent[0], tangent[1], tangent[2] = sine * bx, sine * by, 1.0 - versine * t2
    sine_twist, cosine = sine_cosine(twist)
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
    copy3(tangent, spin[2])
    fill(drift[2], 0.0)
    fill(point, 0.0)
    fill(dpoint, 0.0)
    fill(dlaw, 0.0)
    for e in range(3):
        for i in range(2):
            cross3(spin[i], axis[e], daxis[e, i])
        fill(daxis[e, 2], 0.0)
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
    piece: LumpedPiece,
) -> None:
    """Write one subsegment of PRB: its joints, plane and twist, `x`, shape (d,) [rad]; as `arc`.

    Rao 2021, Eqs. 11-12 and 48-54, moments in the plane's and the twist's balance about the base. The
    plane's balance is Eq. 52 in its one component: M* is the moment's part normal to the base's z
    axis, so that M* x y has the size of M* . e, e being the base's direction in the bending plane.
    `LINKS_MIDDLE` and `LINKS_ONE`: plane balanced at the middle joint along the mean of base's and end's
    directions, twist at the end.
    """
    p, R, spin, drift, axis, point, daxis, dpoint, law, dlaw = piece
    plane = len(x) - 2  # of the unknowns; those before it are the joints, that beyond it is the twist
    joints, twist, at_middle = plane, plane + 1, model != LINKS
    shares, factors = LINK_SHARES, SPRING_FACTORS
    if model == LINKS_ONE:
        shares, factors = ONE_SHARES, ONE_FACTOR
    sine, cosine = sine_cosine(x[plane])
    y, z, here = room((3,), x), room((3,), x), room((3,), x)
    normal, arm = room((3,), x), room((3,), x)
    y[0], y[1], y[2] = -sine, cosine, 0.0
    z[0], z[1], z[2] = 0.0, 0.0, 1.0
    here[0], here[1] = 0.0, 0.0
    here[2] = shares[0] * length
    turn = 0.0
    c, s = 1.0, 0.0
    for q in range(joints):
        copy3(here, point[q])
        copy3(y, axis[q])
        turn += x[q]
        s, c = sine_cosine(turn)
        reach = shares[q + 1] * length
        here[0] += reach * s * cosine
        here[1] += reach * s * sine
        here[2] += reach * c
    copy3(here, p)
    half = 0.5 * turn if at_middle else 0.0
    half_sine, half_cosine = sine_cosine(half)
    axis[plane, 0], axis[plane, 1], axis[plane, 2] = half_cosine * cosine, half_cosine * sine, -half_sine
    normal[0], normal[1], normal[2] = c * cosine, c * sine, -s
    tangent = axis[twist]
    tangent[0], tangent[1], tangent[2] = s * cosine, s * sine, c
    along, across = sine_cosine(x[twist] - x[plane])
    for i in range(3):
        R[i, 0] = across * normal[i] + along * y[i]
        R[i, 1] = -along * normal[i] + across * y[i]
        R[i, 2] = tangent[i]
    fill(point[plane], 0.0)
    fill(point[twist], 0.0)
    if at_middle:
        copy3(point[joints // 2], point[plane])
        copy3(p, point[twist])
    fill(daxis, 0.0)
    fill(dpoint, 0.0)
    fill(dlaw, 0.0)
    for q in range(joints):
        copy3(y, spin[q])
        for i in range(3):
            arm[i] = p[i] - point[q, i]
        cross3(y, arm, drift[q])
        for later in range(q + 1, joints):
            for i in range(3):
                arm[i] = point[later, i] - point[q, i]
            cross3(y, arm, dpoint[later, q])
        cross3(y, axis[twist], daxis[twist, q])
        if at_middle:
            cross3(y, axis[plane], daxis[plane, q])
            for i in range(3):
                daxis[plane, q, i] *= 0.5
        cross3(z, point[q], dpoint[q, plane])
        stiffness = factors[q] * bending / length
        law[q] = stiffness * x[q]
        dlaw[q, q] = stiffness
    for e in range(len(x)):
        cross3(z, axis[e], daxis[e, plane])
    for i in range(3):
        spin[plane, i] = z[i] - tangent[i]
        spin[twist, i] = tangent[i]
    cross3(z, p, drift[plane])
    fill(drift[twist], 0.0)
    if at_middle:
        for i in range(len(x)):
            copy3(dpoint[joints // 2, i], dpoint[plane, i])
            copy3(drift[i], dpoint[twist, i])
    law[plane] = 0.0
    law[twist] = torsion / length * x[twist]
    dlaw[twist, twist] = torsion / length


@compiled
def subsegment(
    model: int,
    x: Array,
    length: float,
    bending: float,
    torsion: float,
    piece: LumpedPiece,
) -> None:
    if model == ARC:
        arc(x, length, bending, torsion, piece)
    else:
        links(model, x, length, bending, torsion, piece)


@compiled
def frames(model: int, x: Array, length: Array, p: Array, R: Array) -> None:
    """Write the disks' positions `p`, shape (n + 1, 3), and orientations `R` at the unknowns `x`, (n, d)."""
    d = x.shape[1]
    step, turn = room((3,), x), room((3, 3), x)
    by_unknown, by_balance = room((2, d, 3), x), room((2, d, 3), x)
    by_both, law, dlaw = room((2, d, d, 3), x), room((d,), x), room((d, d), x)
    piece = LumpedPiece(
        step, turn, by_unknown[0], by_unknown[1], by_balance[0], by_balance[1], by_both[0], by_both[1],
        law, dlaw,
    )  # fmt: skip
    fill(p[0], 0.0)
    fill(R[0], 0.0)
    R[0, 0, 0] = R[0, 1, 1] = R[0, 2, 2] = 1.0
    for k in range(len(x)):
        subsegment(model, x[k], length[k], 1.0, 1.0, piece)
        turned(R[k], step, p[k + 1])
        add3(p[k], p[k + 1])
        product3(R[k], turn, R[k + 1])


# ----------------------------------------------------------------------------------------------------
# What acts beyond each place of a lumped robot, compiled: tendons and loads.


@inlined
def tendon_forces(
    robot: LumpedRod,
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
        tension, p, R: as of `DiskLoads` and `DiskStates`.
        h: out: positions of the holes, shape (t, n + 1, 3) [m].
        u, size: out: direction and length of span j, from disk j - 1 to disk j; at j = 0 the base's axis and
            1, shapes (t, n + 1, 3) and (t, n + 1).
        span: out: tension in each span, shape (t, n) [N].
        total, turning: in and out: force on each disk and its moment about the origin, shape (n + 2, 3).
    """
    hole, last, mu, projected = robot.hole, robot.last, robot.mu, robot.projected
    count = len(hole)
    F = room((3,), p)
    for t in range(count):
        for m in range(last[t] + 1):
            for i in range(3):
                h[t, m, i] = p[m, i] + R[m, i, 0] * hole[t, m, 0] + R[m, i, 1] * hole[t, m, 1]
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
        p, force, moment, loads, swing: as of `evaluate`.
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


# ----------------------------------------------------------------------------------------------------
# How the balances of a lumped robot change with its unknowns, compiled.
#
# In the frame of the tip, the tendons' part of balance k depends on the unknowns of subsegments k and
# beyond only; loads that keep their direction in the base frame add what the tip's rotation brings. So the
# derivative is U + B C, U block upper triangular, B (n d, 3) the effect of turning the loads against the
# tip, C (3, n d) the tip's rotation by the unknowns. Off its diagonal U is of low rank: a farther unknown
# acts through the force and the moment that it changes and the turn that it gives the loads between, nine
# numbers that the back substitution sums up. So Newton's step costs as much as the balances do, in
# proportion to n.

_PLANE_FLOOR = 1e-9  # keeps the bending plane of an unloaded subsegment where it is


@inlined
def turn_loads(R: Array, here: Array, own: Array, loads: Array, swing: Array, B: Array, C: Array) -> None:
    """Write the effect of turning the loads against the tip, `B`, and the tip's turn by the unknowns, `C`.

    Args:
        here: angular velocity and velocity by the unknowns, axis and point of the balances in the
            subsegments' own frames, shape (n, 4, d, 3).
        own: the same in the base frame, shape (4, n, d, 3); the first two are written here.
        R, loads, swing, B, C: as of `evaluate`.
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
    robot: LumpedRod,
    p: Array,
    R: Array,
    here: Array,
    own: Array,
    slopes: tuple[Array, Array, Array],
    pulls: tuple[Array, Array, Array, Array],
    sums: tuple[Array, Array],
    lacks: Unbalanced,
) -> None:
    """Write U: unknown i of subsegment k turns all beyond disk k about p[k + 1], loads included.

    Args:
        here, own: as of `turn_loads`.
        slopes: derivatives of the balances' axes, points and elastic moments by the unknowns, in the
            subsegments' own frames, shapes (n, d, d, 3), (n, d, d, 3), and (n, d, d).
        pulls: h, u, size and span as `tendon_forces` left them; sums: as `sum_beyond` left its last two.
    """
    hole, last, projected = robot.hole, robot.last, robot.projected
    daxis, dpoint, dlaw = slopes
    h, u, size, span = pulls
    total, turning = sums
    _, D, parts, loads, swing, _, _ = lacks
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
def hold_locked(robot: LumpedRod, lacks: Unbalanced) -> None:
    """Hold what may not move, and the bending planes of unloaded subsegments."""
    model, free, length, bending = robot.model, robot.free, robot.length, robot.bending
    _, D, parts, _, _, B, _ = lacks
    n, d = D.shape[0], D.shape[1]
    axes, levers = parts[0], parts[1]
    for k in range(n):
        if model != ARC:  # an unloaded subsegment has no bending plane
            floor = _PLANE_FLOOR * bending[k] / length[k]
            D[k, d + PLANE, d + PLANE] += select_less(0.0, D[k, d + PLANE, d + PLANE], floor, -floor)
        for e in range(d):
            if not free[k, e]:
                fill(D[k, e], 0.0)
                fill(B[k, e], 0.0)
                fill(axes[k, e], 0.0)
                fill(levers[k, e], 0.0)
                D[k, e, e] = -bending[k] / length[k]


# ----------------------------------------------------------------------------------------------------
# What the balances of a lumped robot lack, and how that changes with its unknowns, compiled.


@inlined
def _balances(
    robot: LumpedRod,
    x: Array,
    own: Array,
    law: Array,
    sums: tuple[Array, Array],
    p: Array,
    r: Array,
    wrench: Array,
) -> float:
    """Write the unbalanced moments and the wrenches; return the largest moment over EI / length [rad].

    Args:
        own: axes and points of the balances in the base frame, as of `turn_loads`; law: shape (n, d).
        sums: as of `derive_own`. x, p, r, wrench: as of `evaluate`.
    """
    free, length, bending = robot.free, robot.length, robot.bending
    axis, point = own[2], own[3]
    total, turning = sums
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
    robot: LumpedRod, x: Array, acting: DiskLoads, lacks: Unbalanced, found: DiskStates, enough: float
) -> float:
    """Write the balances and their derivative, and the states, at the unknowns `x`, shape (n, d) [rad].

    Where nothing is further from balance than `enough` [rad], the derivative is left out.

    Returns:
        The largest unbalanced moment over EI / length [rad].
    """
    model, _, length, bending, torsion, hole, _, _, _ = robot
    _, _, _, loads, swing, B, C = lacks
    span, wrench, p, R = found
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
        piece = LumpedPiece(
            step, turn, here[k, 0], here[k, 1], here[k, 2], here[k, 3], daxis[k], dpoint[k], law[k], dlaw[k]
        )
        subsegment(model, x[k], length[k], bending[k], stiffness, piece)
        turned(R[k], step, p[k + 1])
        add3(p[k], p[k + 1])
        product3(R[k], turn, R[k + 1])
        for e in range(d):
            for which in range(2, 4):
                turned(R[k], here[k, which, e], own[which, k, e])
            add3(p[k], own[3, k, e])

    h, u, size = room((count, n + 1, 3), x), room((count, n + 1, 3), x), room((count, n + 1), x)
    total, turning = room((n + 2, 3), x), room((n + 2, 3), x)
    fill(u, 0.0)
    for t in range(count):
        u[t, 0, 2] = 1.0
    fill(size, 1.0)
    fill(total, 0.0)
    fill(turning, 0.0)
    tendon_forces(robot, acting.tension, p, R, h, u, size, span, total, turning)
    sum_beyond(p, acting.force, acting.moment, total, turning, loads, swing)
    norm = _balances(robot, x, own, law, (total, turning), p, lacks.r, wrench)
    if all_less(norm, enough):
        return norm
    turn_loads(R, here, own, loads, swing, B, C)
    slopes, pulls = (daxis, dpoint, dlaw), (h, u, size, span)
    derive_own(robot, p, R, here, own, slopes, pulls, (total, turning), lacks)
    hold_locked(robot, lacks)
    return norm


# ----------------------------------------------------------------------------------------------------
# Newton's method for lumped robots, and loads raised in steps where it fails, compiled.

TOLERANCE_RAD = 1e-12  # unbalanced moment over EI / length at which Newton's method stops
_BALANCED_RAD = 1e-9  # where rounding keeps it from that, what still counts as balance
_MOST_STEPS = 40
LONGEST_STEP_RAD = 1.0  # of any unknown; longer ones are shortened
_ABSURD_STEP_RAD = 1e3
_SHORTEST_SHARE = 1e-3  # of the load


@compiled
def newton_step(lacks: Unbalanced, step: Array) -> None:
    """Write the solution of (U + B C) step = -r, NaN where there is none; D is used up."""
    r, D, parts, loads, swing, B, C = lacks
    n, d = r.shape
    axes, levers, by_force, by_moment = parts[0], parts[1], parts[2], parts[3]
    y = room((n, d, 4), r)
    force, moment, turn = room((4, 3), r), room((4, 3), r), room((4, 3), r)  # of the subsegments beyond
    fill(force, 0.0)
    fill(moment, 0.0)
    fill(turn, 0.0)
    F, M = room((3,), r), room((3,), r)
    for k in range(n - 1, -1, -1):
        for q in range(4):
            cross3(turn[q], loads[k + 1], F)
            for i in range(3):
                F[i] += force[q, i]
                M[i] = moment[q, i]
                for j in range(3):
                    M[i] -= swing[k + 1, i, j] * turn[q, j]
            for e in range(d):
                y[k, e, q] = r[k, e] if q == 0 else B[k, e, q - 1]
                y[k, e, q] -= dot3(axes[k, e], M) - dot3(levers[k, e], F)
        if not solve_columns_of_any(D[k], y[k]):
            fill(step, math.nan)
            return
        for q in range(4):
            for e in range(d):
                for i in range(3):
                    force[q, i] += by_force[k, e, i] * y[k, e, q]
                    moment[q, i] += by_moment[k, e, i] * y[k, e, q]
                    turn[q, i] += C[k, e, i] * y[k, e, q]
    tip, answer = room((3, 3), r), room((3, 1), r)
    fill(tip, 0.0)
    fill(answer, 0.0)
    tip[0, 0] = tip[1, 1] = tip[2, 2] = 1.0
    for k in range(n):
        for e in range(d):
            for i in range(3):
                answer[i, 0] += C[k, e, i] * y[k, e, 0]
                for q in range(3):
                    tip[i, q] += C[k, e, i] * y[k, e, q + 1]
    if not solve_columns_of_any(tip, answer):
        fill(step, math.nan)
        return
    for k in range(n):
        for e in range(d):
            step[k, e] = -y[k, e, 0]
            for q in range(3):
                step[k, e] += y[k, e, q + 1] * answer[q, 0]


@compiled
def _straighten(model: int, x: Array) -> None:
    """Set all bends and twists to zero; the bending planes stay."""
    for k in range(len(x)):
        for e in range(x.shape[1]):
            if model == ARC or e != x.shape[1] + PLANE:
                x[k, e] = 0.0


@compiled
def solve_rows(
    robot: LumpedRod,
    acting: DiskLoads,
    first_share: Array,
    x: Array,
    found: DiskStates,
    residual: Array,
    reached: Array,
    steps: Any,
) -> None:
    """Solve r rows.

    Where Newton's method fails at the full load, the load is raised from zero in steps that halve
    where it fails and double where it does not. No row reads another, so that their order is nothing.

    Args:
        first_share: of the load, with which to begin, shape (r,); below 1: begin at the straight robot.
        x: a guess, overwritten by the unknowns, shape (r, n, d) [rad]; `found` is filled.
        residual: largest unbalanced moment, shape (r,) [N m].
        reached: share of the load at which there is balance, shape (r,); below 1: no equilibrium was
            found, and the row's posture is none. Rows that have 1 already are left as they are.
        steps: load steps that were taken, shape (r,).
    """
    rows, n, d = x.shape
    r, B, C = room((n, d), x), room((n, d, 3), x), room((n, d, 3), x)
    D, parts = room((n, d, d), x), room((4, n, d, 3), x)
    loads, swing = room((n + 2, 3), x), room((n + 2, 3, 3), x)
    step, good = room((n, d), x), room((n, d), x)
    model, lacks = robot.model, Unbalanced(r, D, parts, loads, swing, B, C)
    for row in range(rows):
        if reached[row] == 1.0:
            continue
        now, there = x[row], DiskStates(found.span[row], found.wrench[row], found.p[row], found.R[row])
        good[:] = now
        if first_share[row] < 1.0:
            _straighten(model, good)
        done, share, count = 0.0, first_share[row], 0
        while done < 1.0 and share > _SHORTEST_SHARE:
            part = min(1.0, done + share)
            now[:] = good
            norm = np.inf
            for _ in range(_MOST_STEPS):
                raised = DiskLoads(
                    part * acting.tension[row], part * acting.force[row], part * acting.moment[row]
                )
                norm = evaluate(robot, now, raised, lacks, there, TOLERANCE_RAD)
                if norm < TOLERANCE_RAD:
                    break
                newton_step(lacks, step)
                longest = largest_size(step)
                if not longest < _ABSURD_STEP_RAD:
                    norm = np.inf
                    break
                scale = min(1.0, LONGEST_STEP_RAD / longest)
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
        residual[row] = largest_size(r)


# ----------------------------------------------------------------------------------------------------
# Eight rows of a lumped robot solved together, compiled: Newton's method at the full load.
#
# `solve_rows` solves a row by itself; here the same balances are evaluated for eight rows at once. A
# row that is balanced stays as it is while the others go on. Rows that do not get there soon are left to
# `solve_rows`, which raises their loads in steps.

_MOST_ROUNDS = 12  # beyond it a row is better off by itself


@compiled
def _spread(rows: Array, start: int, out: Array) -> None:
    """Write LANES rows, from `start` on, (r, ...), side by side, (..., LANES)."""
    flat, to = rows.reshape(len(rows), -1), out.reshape(-1, LANES)
    for i in range(LANES):
        for k in range(len(to)):
            to[k, i] = flat[start + i, k]


@compiled
def solve_eights(
    robot: LumpedRod,
    acting: DiskLoads,
    first_share: Array,
    x: Array,
    found: DiskStates,
    residual: Array,
    reached: Array,
    steps: Any,
) -> None:
    """Solve r rows, a multiple of LANES; arguments as of `solve_rows`.

    Args:
        reached: result; 1.0: balanced; else the row is left as it was, to be solved by itself.
    """
    rows, n, d = x.shape
    count = len(robot.hole)
    pulls, forces, moments = (
        floats_of_eights((count,)), floats_of_eights((n, 3)), floats_of_eights((n, 3)),
    )  # fmt: skip
    guess, spans, wrenches = (
        floats_of_eights((n, d)), floats_of_eights((count, n)), floats_of_eights((n, 6)),
    )  # fmt: skip
    places, turns, left = (
        floats_of_eights((n + 1, 3)), floats_of_eights((n + 1, 3, 3)), floats_of_eights((n, d)),
    )  # fmt: skip
    now, r = eights(guess), eights(left)
    B, C = room((n, d, 3), now), room((n, d, 3), now)
    D, parts = room((n, d, d), now), room((4, n, d, 3), now)
    loads, swing = room((n + 2, 3), now), room((n + 2, 3, 3), now)
    step = room((n, d), now)
    lacks = Unbalanced(r, D, parts, loads, swing, B, C)
    of_eights = DiskLoads(eights(pulls), eights(forces), eights(moments))
    there = DiskStates(eights(spans), eights(wrenches), eights(places), eights(turns))
    fill(spans, 0.0)
    for start in range(0, rows, LANES):
        at_once = True
        for i in range(LANES):
            at_once = at_once and first_share[start + i] == 1.0
        if not at_once:  # their loads are raised in steps
            continue
        _spread(acting.tension, start, pulls)
        _spread(acting.force, start, forces)
        _spread(acting.moment, start, moments)
        _spread(x, start, guess)
        for rounds in range(_MOST_ROUNDS):
            norm = evaluate(robot, now, of_eights, lacks, there, TOLERANCE_RAD)
            if all_less(norm, TOLERANCE_RAD) or rounds + 1 == _MOST_ROUNDS:
                break
            newton_step(lacks, step)
            longest = 0.0 * norm
            for k in range(n):
                for e in range(d):
                    longest = larger(longest, abs(step[k, e]))
            scale = select_less(longest, LONGEST_STEP_RAD, 1.0, LONGEST_STEP_RAD / longest)
            for k in range(n):
                for e in range(d):
                    further = now[k, e] + scale * step[k, e]
                    now[k, e] = select_less(norm, TOLERANCE_RAD, now[k, e], further)
        for i in range(LANES):
            row = start + i
            if not lane(norm, i) < TOLERANCE_RAD:
                continue
            reached[row] = 1.0
            steps[row] = 1
            take_lane(guess, i, x[row])
            take_lane(spans, i, found.span[row])
            take_lane(wrenches, i, found.wrench[row])
            take_lane(places, i, found.p[row])
            take_lane(turns, i, found.R[row])
            residual[row] = 0.0
            for k in range(n):
                for e in range(d):
                    residual[row] = max(residual[row], abs(left[k, e, i]))
