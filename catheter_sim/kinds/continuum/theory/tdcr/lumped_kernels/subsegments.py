"""Poses, balances and elastic moments of one subsegment, compiled: an arc, or four rigid links."""

from __future__ import annotations

import math
from typing import Any

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.tdcr.lumped_kernels.models import (
    ARC,
    LINK_SHARES,
    LINKS_MIDDLE,
    SPRING_FACTORS,
)
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.eight import all_less, larger, room, select_less, sine_cosine
from catheter_sim.mechanics.vectors import add3, copy3, cross3, fill, product3, turned

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
    sine, cosine = sine_cosine(x[3])
    y, z, here = room((3,), x), room((3,), x), room((3,), x)
    normal, arm = room((3,), x), room((3,), x)
    y[0], y[1], y[2] = -sine, cosine, 0.0
    z[0], z[1], z[2] = 0.0, 0.0, 1.0
    here[0], here[1] = 0.0, 0.0
    here[2] = LINK_SHARES[0] * length
    turn = 0.0
    c, s = 1.0, 0.0
    for q in range(3):
        copy3(here, point[q])
        copy3(y, axis[q])
        turn += x[q]
        s, c = sine_cosine(turn)
        reach = LINK_SHARES[q + 1] * length
        here[0] += reach * s * cosine
        here[1] += reach * s * sine
        here[2] += reach * c
    copy3(here, p)
    half = 0.5 * turn if model == LINKS_MIDDLE else 0.0
    half_sine, half_cosine = sine_cosine(half)
    axis[3, 0], axis[3, 1], axis[3, 2] = half_cosine * cosine, half_cosine * sine, -half_sine
    normal[0], normal[1], normal[2] = c * cosine, c * sine, -s
    tangent = axis[4]
    tangent[0], tangent[1], tangent[2] = s * cosine, s * sine, c
    along, across = sine_cosine(x[4] - x[3])
    for i in range(3):
        R[i, 0] = across * normal[i] + along * y[i]
        R[i, 1] = -along * normal[i] + across * y[i]
        R[i, 2] = tangent[i]
    fill(point[3], 0.0)
    fill(point[4], 0.0)
    if model == LINKS_MIDDLE:
        copy3(point[1], point[3])
        copy3(p, point[4])
    fill(daxis, 0.0)
    fill(dpoint, 0.0)
    fill(dlaw, 0.0)
    for q in range(3):
        copy3(y, spin[q])
        for i in range(3):
            arm[i] = p[i] - point[q, i]
        cross3(y, arm, drift[q])
        for later in range(q + 1, 3):
            for i in range(3):
                arm[i] = point[later, i] - point[q, i]
            cross3(y, arm, dpoint[later, q])
        cross3(y, axis[4], daxis[4, q])
        if model == LINKS_MIDDLE:
            cross3(y, axis[3], daxis[3, q])
            for i in range(3):
                daxis[3, q, i] *= 0.5
        cross3(z, point[q], dpoint[q, 3])
        stiffness = SPRING_FACTORS[q] * bending / length
        law[q] = stiffness * x[q]
        dlaw[q, q] = stiffness
    for e in range(5):
        cross3(z, axis[e], daxis[e, 3])
    for i in range(3):
        spin[3, i] = z[i] - tangent[i]
        spin[4, i] = tangent[i]
    cross3(z, p, drift[3])
    fill(drift[4], 0.0)
    if model == LINKS_MIDDLE:
        for i in range(5):
            copy3(dpoint[1, i], dpoint[3, i])
            copy3(drift[i], dpoint[4, i])
    law[3] = 0.0
    law[4] = torsion / length * x[4]
    dlaw[4, 4] = torsion / length


@compiled
def subsegment(
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
    step, turn = room((3,), x), room((3, 3), x)
    by_unknown, by_balance = room((2, d, 3), x), room((2, d, 3), x)
    by_both, law, dlaw = room((2, d, d, 3), x), room((d,), x), room((d, d), x)
    fill(p[0], 0.0)
    fill(R[0], 0.0)
    R[0, 0, 0] = R[0, 1, 1] = R[0, 2, 2] = 1.0
    for k in range(len(x)):
        subsegment(
            model, x[k], length[k], 1.0, 1.0, step, turn, by_unknown[0], by_unknown[1],
            by_balance[0], by_balance[1], by_both[0], by_both[1], law, dlaw,
        )  # fmt: skip
        turned(R[k], step, p[k + 1])
        add3(p[k], p[k + 1])
        product3(R[k], turn, R[k + 1])
