"""The kinetostatic model, compiled: arcs in space, superelastic fibres, friction with history."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.mechanics.compiled import compiled, compiled_in_place
from catheter_sim.mechanics.vectors import cross3, dot3, solve_vector

# ----------------------------------------------------------------------------------------------------
# Columns of the tables that the compiled kernels take.

# Columns of `notch` [m, N m/rad, rad, m^2, m^4, m].
HEIGHT, UNCUT, CENTROID, TENDON, TORSION, STOP, CLOSING, CUBIC, QUINTIC = range(9)
PITCH, REST, SPAN = 9, 10, 13  # REST: rotation vector without load, three columns; SPAN: tendon's then
COLUMNS = 14
# Entries of `drive`: NaN where the tension is given; SCALE [N/m] weighs lengths against forces.
DISPLACEMENT, COMPLIANCE, PRETENSION, SCALE = range(4)


class NotchedTube(NamedTuple):
    """A tube of n notches; of B tubes all but `axes` have a row for each.

    Attributes:
        notch: columns above, shape (n, 14).
        fibre: place and area of the sections' fibres, shape (n, f, 3).
        metal: modulus, strains at which it softens in tension and compression, what is lost then, shape (4,).
        axes: 1: notches bend toward +-x only (`fibre` may then hold half of each, at twice the area);
            3: any way.
        mu: coefficient of friction, of B tubes shape (B,).
    """

    notch: Array
    fibre: Array
    metal: Array
    axes: int
    mu: Any


class NotchLoads(NamedTuple):
    """What acts on elements: weight in the middle of the uncut piece, force and moment on the distal face.

    Each has shape (n, 3), in the base frame [N, N m].
    """

    weight: Array
    force: Array
    moment: Array


class Bends(NamedTuple):
    """How the notches are bent: rotation vectors w, shape (n, 3) [rad], and stretches, shape (n,)."""

    w: Array
    stretch: Array


# ----------------------------------------------------------------------------------------------------
# Forces and slopes of a section of superelastic fibres.


@compiled_in_place
def fibre_forces(fibre: Array, metal: Array, stretch: float, kx: float, ky: float, out: Array) -> None:
    """Fill the section's forces and slopes: N, Mx, My, then N by e, kx, ky, Mx by kx, ky and My by ky."""
    for i in range(9):
        out[i] = 0.0
    modulus, tension, compression, lost = metal[0], metal[1], metal[2], metal[3]
    for i in range(fibre.shape[0]):
        x, y, area = fibre[i, 0], fibre[i, 1], fibre[i, 2]
        strain = stretch - x * ky + y * kx
        force, slope = modulus * area * strain, modulus * area
        if strain > tension:
            force -= lost * slope * (strain - tension)
            slope *= 1.0 - lost
        elif strain < -compression:
            force -= lost * slope * (strain + compression)
            slope *= 1.0 - lost
        out[0] += force
        out[1] += y * force
        out[2] -= x * force
        out[3] += slope
        out[4] += y * slope
        out[5] -= x * slope
        out[6] += y * y * slope
        out[7] -= x * y * slope
        out[8] += x * x * slope


# ----------------------------------------------------------------------------------------------------
# A notch as a piece of a helix: its strip's centroid line, the tendon's span, its distal face.


@compiled_in_place
def shape(
    w: Array, length: float, arm: float, p: Array, pw: Array, V: Array, lw: Array, rest: Array
) -> None:  # fmt: skip
    """Fill a notch's geometry in the frame of its lower edge.

    - p: upper end of the centroid line from the lower one.
    - pw: its derivative by w; V: the turn by w (left Jacobian).
    - lw: derivative of the tendon's span by w.
    - rest: the span, its derivative by the centroid line's length, and its turns at the lower and the upper
      edge.
    """
    a, b, c = w[0], w[1], w[2]
    q = a * a + b * b + c * c
    if q < 1e-3:
        c0, d0 = 1.0 - q / 6.0 * (1.0 - q / 20.0), -1.0 / 6.0 + q / 60.0
        c1, d1 = 0.5 - q / 24.0 * (1.0 - q / 30.0), -1.0 / 24.0 + q / 360.0 - q * q / 13440.0
        c2, d2 = 1.0 / 6.0 - q / 120.0 * (1.0 - q / 42.0), -1.0 / 120.0 + q / 2520.0 - q * q / 120960.0
        d0 -= q * q / 1680.0
    else:
        angle = math.sqrt(q)
        cosine = math.cos(angle)
        c0 = math.sin(angle) / angle
        c1, c2 = (1.0 - cosine) / q, (1.0 - c0) / q
        d0 = 0.5 * (cosine - c0) / q
        d1, d2 = (0.5 * c0 - c1) / q, (-d0 - c2) / q
    p[0], p[1] = length * (c1 * b + c2 * a * c), length * (c2 * b * c - c1 * a)
    p[2] = length * (1.0 - c2 * (a * a + b * b))
    x0, x1, x2 = -c1 * (b * b + c * c), c0 * c + c1 * a * b, c1 * a * c - c0 * b  # what x turns into, less x
    u0, u1, u2 = p[0] + arm * x0, p[1] + arm * x1, p[2] + arm * x2  # the span
    span = math.sqrt(u0 * u0 + u1 * u1 + u2 * u2)
    for k in range(3):
        twice = 2.0 * w[k]
        e1, e2, e0 = d1 * twice, d2 * twice, d0 * twice
        ka, kb, kc = (1.0 if k == 0 else 0.0), (1.0 if k == 1 else 0.0), (1.0 if k == 2 else 0.0)
        pw[0, k] = length * (e1 * b + c1 * kb + e2 * a * c + c2 * (ka * c + a * kc))
        pw[1, k] = length * (e2 * b * c + c2 * (kb * c + b * kc) - e1 * a - c1 * ka)
        pw[2, k] = -length * (e2 * (a * a + b * b) + 2.0 * c2 * (a * ka + b * kb))
        y0 = -e1 * (b * b + c * c) - 2.0 * c1 * (b * kb + c * kc)
        y1 = e0 * c + c0 * kc + e1 * a * b + c1 * (ka * b + a * kb)
        y2 = e1 * a * c + c1 * (ka * c + a * kc) - e0 * b - c0 * kb
        lw[k] = (u0 * (pw[0, k] + arm * y0) + u1 * (pw[1, k] + arm * y1) + u2 * (pw[2, k] + arm * y2)) / span
    V[0, 0], V[0, 1], V[0, 2] = 1 - c2 * (b * b + c * c), c2 * a * b - c1 * c, c2 * a * c + c1 * b
    V[1, 0], V[1, 1], V[1, 2] = c2 * a * b + c1 * c, 1 - c2 * (a * a + c * c), c2 * b * c - c1 * a
    V[2, 0], V[2, 1], V[2, 2] = c2 * a * c - c1 * b, c2 * b * c + c1 * a, 1 - c2 * (a * a + b * b)
    rest[0] = span
    rest[1] = (u0 * p[0] + u1 * p[1] + u2 * p[2]) / (span * length)
    rest[2] = math.atan2(math.hypot(u0, u1), u2)
    upper = u0 * (c0 * b + c1 * a * c) + u1 * (c1 * b * c - c0 * a) + u2 * (1.0 - c1 * (a * a + b * b))
    rest[3] = math.atan2(math.sqrt(max(span * span - upper * upper, 0.0)), upper)


@compiled
def spans(notch: Array, w: Array) -> Array:
    """Return the tendon's spans in notches turned by w, shape (n, 3), without stretch, shape (n,) [m]."""
    p, pw, V, lw, span = np.empty(3), np.empty((3, 3)), np.empty((3, 3)), np.empty(3), np.empty(4)
    result = np.empty(w.shape[0])
    for i in range(w.shape[0]):
        shape(w[i], notch[i, HEIGHT], notch[i, TENDON] + notch[i, CENTROID], p, pw, V, lw, span)
        result[i] = span[0]
    return result


@compiled_in_place
def turned_by(w: Array, R: Array, out: Array) -> None:
    """Fill R times the rotation by w."""
    q = w[0] * w[0] + w[1] * w[1] + w[2] * w[2]
    if q < 1e-6:
        c0, c1 = 1.0 - q / 6.0, 0.5 - q / 24.0
    else:
        angle = math.sqrt(q)
        c0, c1 = math.sin(angle) / angle, (1.0 - math.cos(angle)) / q
    for i in range(3):
        r0, r1, r2 = R[i, 0], R[i, 1], R[i, 2]
        along = c1 * (r0 * w[0] + r1 * w[1] + r2 * w[2])
        out[i, 0] = (1.0 - c1 * q) * r0 + along * w[0] + c0 * (r1 * w[2] - r2 * w[1])
        out[i, 1] = (1.0 - c1 * q) * r1 + along * w[1] + c0 * (r2 * w[0] - r0 * w[2])
        out[i, 2] = (1.0 - c1 * q) * r2 + along * w[2] + c0 * (r0 * w[1] - r1 * w[0])


@compiled
def faces(notch: Array, w: Array, stretch: Array, p_w: Array, R_w: Array) -> None:
    """Fill the elements' distal faces, (B, r, n, 3) [m] and (B, r, n, 3, 3), from `march`'s w and stretch."""
    p, pw, V, lw, span = np.empty(3), np.empty((3, 3)), np.empty((3, 3)), np.empty(3), np.empty(4)
    R, above, here = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for b in range(w.shape[0]):
        for row in range(w.shape[1]):
            R[:, :] = np.eye(3)
            here[:] = 0.0
            for i in range(w.shape[2]):
                offset, uncut = notch[b, i, CENTROID], notch[b, i, UNCUT]
                length = notch[b, i, HEIGHT] * (1.0 + stretch[b, row, i])
                shape(w[b, row, i], length, 0.0, p, pw, V, lw, span)
                turned_by(w[b, row, i], R, above)
                for k in range(3):
                    here[k] += offset * (above[k, 0] - R[k, 0]) + dot3(R[k], p) + uncut * above[k, 2]
                    p_w[b, row, i, k] = here[k]
                R[:, :] = above
                R_w[b, row, i] = above


# ----------------------------------------------------------------------------------------------------
# Frames and points of all notches of a bent tube, and how they move with the bends.

_NUDGE = 1e-6  # of w, for second derivatives of a notch's shape


@compiled
def workspace(n: int) -> tuple[Array, ...]:
    """Return the arrays that `evaluate` works in: made once for a whole history.

    Of every notch:

    - frames below and above, upper end of the centroid line, distal face, that line and its slope by w, turn
      by w, slope of the span, the span;
    - how these change with w, and what acts beyond it;
    - how it moves and turns the rest;
    - its tension's slope by all unknowns, its axial balance, and scratch.
    """
    size = 3 * n + 1
    return (
        np.empty((n + 1, 3, 3)), np.empty((n, 3)), np.empty((n, 3)),
        np.empty((n, 3)), np.empty((n, 3, 3)), np.empty((n, 3, 3)), np.empty((n, 3)), np.empty((n, 4)),
        np.empty((n, 3, 3, 3)), np.empty((n, 3, 3, 3)), np.empty((n, 3, 3)), np.empty((n, 3, 2)),
        np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3, 3)),
        np.empty((n, 3, 3)), np.empty((n, 3, 3)),
        np.empty((n, size)), np.empty((n, 9)), np.empty((n, 9)), np.empty((8, 3)), np.empty((3, 3)),
        np.empty(4), np.empty(size),
    )  # fmt: skip


@compiled_in_place
def place(notch: Array, axes: int, w: Array, stretch: Array, work: tuple[Array, ...]) -> None:
    """Fill frames, points and geometry of all notches, and how the geometry changes with w."""
    R, top, face, p, pw, V, lw, span, pw2, V2, lw2, edges2 = work[:12]
    moves, turns = work[15:17]
    small, first = work[20], 1 if axes == 1 else 0
    here, nudged, unused = small[0], small[1], small[2]
    changed = work[22]
    here[:] = 0.0
    for k in range(3):
        for j in range(3):
            R[0, k, j] = 1.0 if k == j else 0.0
    for i in range(w.shape[0]):
        length, offset = notch[i, HEIGHT] * (1.0 + stretch[i]), notch[i, CENTROID]
        arm = notch[i, TENDON] + offset
        shape(w[i], length, arm, p[i], pw[i], V[i], lw[i], span[i])
        for b in range(axes):
            for k in range(3):
                nudged[k] = w[i, k]
            nudged[first + b] += _NUDGE
            shape(nudged, length, arm, unused, pw2[i, b], V2[i, b], lw2[i, b], changed)
            for k in range(3):
                lw2[i, b, k] = (lw2[i, b, k] - lw[i, k]) / _NUDGE
                for j in range(3):
                    pw2[i, b, k, j] = (pw2[i, b, k, j] - pw[i, k, j]) / _NUDGE
                    V2[i, b, k, j] = (V2[i, b, k, j] - V[i, k, j]) / _NUDGE
            for edge in range(2):
                edges2[i, b, edge] = (changed[2 + edge] - span[i, 2 + edge]) / _NUDGE
        turned_by(w[i], R[i], R[i + 1])
        for k in range(3):
            top[i, k] = here[k] - offset * R[i, k, 0] + dot3(R[i, k], p[i])
            here[k] = top[i, k] + offset * R[i + 1, k, 0] + notch[i, UNCUT] * R[i + 1, k, 2]
            face[i, k] = here[k]
            for a in range(axes):
                moves[i, a, k] = turns[i, a, k] = 0.0
                for j in range(3):
                    moves[i, a, k] += R[i, k, j] * pw[i, j, first + a]
                    turns[i, a, k] += R[i, k, j] * V[i, j, first + a]


# ----------------------------------------------------------------------------------------------------
# What acts beyond each notch, and what it makes of one notch's bend in another's balance.


@compiled_in_place
def loads_beyond(notch: Array, loads: NotchLoads, work: tuple[Array, ...]) -> bool:
    """Fill force, moment about the centroid line's upper end, and arms times forces, of all beyond a notch.

    Returned is whether there are any.
    """
    weight, force, moment = loads
    R, top, face = work[:3]
    pull, torque, tensor = work[12:15]
    small, sums = work[20], work[21]
    arm, product, total, about = small[0], small[1], small[2], small[3]
    total[:] = 0.0
    about[:] = 0.0
    sums[:, :] = 0.0
    loaded = False
    for i in range(notch.shape[0] - 1, -1, -1):
        for part in range(2):
            acting = force[i] if part == 0 else weight[i]
            if acting[0] == 0.0 and acting[1] == 0.0 and acting[2] == 0.0:
                continue
            loaded = True
            back = 0.5 * notch[i, UNCUT] * part
            for k in range(3):
                arm[k] = face[i, k] - back * R[i + 1, k, 2]
            cross3(arm, acting, product)
            for k in range(3):
                total[k] += acting[k]
                about[k] += product[k]
                for j in range(3):
                    sums[k, j] += arm[k] * acting[j]
        for k in range(3):
            loaded = loaded or moment[i, k] != 0.0
            about[k] += moment[i, k]
        cross3(top[i], total, product)
        for k in range(3):
            pull[i, k] = total[k]
            torque[i, k] = about[k] - product[k]
            for j in range(3):
                tensor[i, k, j] = sums[k, j] - top[i, k] * total[j]
    return loaded


@compiled_in_place
def swung_moment(tensor: Array, turn: Array, out: Array) -> None:
    """Fill the change of the moment of forces where their arms turn; `tensor`: arms times forces."""
    trace = tensor[0, 0] + tensor[1, 1] + tensor[2, 2]
    for k in range(3):
        out[k] = dot3(tensor[k], turn) - trace * turn[k]


@compiled_in_place
def couple(axes: int, n: int, jacobian: Array, work: tuple[Array, ...]) -> None:
    """Add to the Jacobian what loads make of one notch's bend in another's balance."""
    pull, torque, tensor, moves, turns = work[12:17]
    product, change = work[20][4], work[20][5]
    for i in range(n):
        for a in range(axes):
            for m in range(n):
                if m == i:
                    continue
                for b in range(axes):
                    turn = turns[m, b]
                    gain = 0.0
                    if m < i:
                        cross3(turn, moves[i, a], product)
                        gain += dot3(product, pull[i])
                        cross3(turn, turns[i, a], product)
                        gain += dot3(product, torque[i])
                        swung_moment(tensor[i], turn, change)
                    else:
                        swung_moment(tensor[m], turn, change)
                        cross3(moves[m, b], pull[m], product)
                        for k in range(3):
                            change[k] += product[k]
                    jacobian[i * axes + a, m * axes + b] -= gain + dot3(turns[i, a], change)


# ----------------------------------------------------------------------------------------------------
# The tendon's tension along the notches' edges: the capstan's law with history.


@compiled_in_place
def tensions(
    axes: int,
    mu: float,
    tension: float,
    inside: bool,
    kept: Array,
    behind: Array,
    n: int,
    work: tuple[Array, ...],
) -> None:
    """Fill the tensions behind the edges, and the slope of each notch's tension by all unknowns.

    Behind an edge the tension keeps its value unless it would leave [T / E, T E], E = exp(mu turn), T the
    tension before the edge. `kept`, `behind`, shape (2 n,): a moment ago, and now. `inside`: `tension` is
    that behind the first edge.
    """
    span, edges2, grows, running = work[7], work[11], work[17], work[23]
    last = n * axes
    running[: last + 1] = 0.0
    running[last] = 1.0
    here = tension
    for i in range(n):
        for edge in range(2):
            factor = math.exp(mu * span[i, 2 + edge])
            held, sense = kept[2 * i + edge], 0.0
            if held <= here / factor:
                sense, factor = -1.0, 1.0 / factor
            elif held >= here * factor:
                sense = 1.0
            if inside and i + edge == 0:
                pass
            elif sense == 0.0:
                here = held
                running[: last + 1] = 0.0
            else:
                here *= factor
                for j in range(last + 1):
                    running[j] *= factor
                for a in range(axes):
                    running[i * axes + a] += sense * mu * here * edges2[i, a, edge]
            behind[2 * i + edge] = here
            if edge == 0:
                for j in range(last + 1):
                    grows[i, j] = running[j]


# ----------------------------------------------------------------------------------------------------
# What is left of the balance of every notch, by virtual work, and its derivatives.


@compiled_in_place
def balance(
    tube: NotchedTube, bends: Bends, behind: Array, value: Array, jacobian: Array, work: tuple[Array, ...]
) -> float:
    """Fill what is left over at every notch, its stretch eliminated, and its own part of the Jacobian.

    Kept in `own`: axial balance left over [N m], its slope by the stretch, the span's slope by the stretch.
    Then per w: slope of the axial balance, and the span's slope with the stretch eliminated. Returned is
    the largest size of what is left over, the axial balance included.
    """
    notch, fibre, metal, axes, _ = tube
    w, stretch = bends
    R, _, _, p, pw, V, lw, span, pw2, V2, lw2 = work[:11]
    pull, torque, tensor = work[12:15]
    turns, section, own = work[16], work[18], work[19]
    force, moment, swung = work[20][4], work[20][5], work[20][6]
    first, worst = (1 if axes == 1 else 0), 0.0
    for i in range(w.shape[0]):
        height, tension = notch[i, HEIGHT], behind[2 * i]
        bent = (w[i, 0] - notch[i, REST]), (w[i, 1] - notch[i, REST + 1]), (w[i, 2] - notch[i, REST + 2])
        found = section[i]
        fibre_forces(fibre[i], metal, stretch[i], bent[0] / height, bent[1] / height, found)
        for k in range(3):
            force[k] = R[i, 0, k] * pull[i, 0] + R[i, 1, k] * pull[i, 1] + R[i, 2, k] * pull[i, 2]
            moment[k] = R[i, 0, k] * torque[i, 0] + R[i, 1, k] * torque[i, 1] + R[i, 2, k] * torque[i, 2]
        lengthen = height * span[i, 1]
        axial = height * found[0] + tension * lengthen - dot3(force, p[i]) / (1.0 + stretch[i])
        slope = height * found[3]
        own[i, 0], own[i, 1], own[i, 2] = axial, slope, lengthen
        worst = max(worst, abs(axial))
        square = (bent[0] * bent[0] + bent[1] * bent[1]) / notch[i, PITCH] ** 2
        law = 1.0 + square * (notch[i, CUBIC] + square * notch[i, QUINTIC])
        steeper = 2.0 * (notch[i, CUBIC] + 2.0 * square * notch[i, QUINTIC]) / notch[i, PITCH] ** 2
        for a in range(axes):
            c, row = first + a, i * axes + a
            mixed = found[4 + c] if c < 2 else 0.0
            own[i, 3 + a] = mixed
            own[i, 6 + a] = lw[i, c] - lengthen * mixed / slope
            left = tension * lw[i, c] - dot3(moment, V[i, :, c]) - dot3(force, pw[i, :, c])
            left += law * found[1 + c] if c < 2 else notch[i, TORSION] * bent[2]
            closed = c == 1 and w[i, 1] > notch[i, CLOSING]
            if closed:
                left += notch[i, STOP] * (w[i, 1] - notch[i, CLOSING])
            worst = max(worst, abs(left))
            value[row] = left - law * mixed * axial / slope
            for b in range(axes):
                d = first + b
                gain = tension * lw2[i, b, c] - dot3(moment, V2[i, b, :, c]) - dot3(force, pw2[i, b, :, c])
                swung_moment(tensor[i], turns[i, b], swung)
                gain -= dot3(turns[i, a], swung)
                if c < 2 and d < 2:
                    gain += law * (found[6 + c + d] / height - mixed * found[4 + d] / slope)
                    gain += found[1 + c] * steeper * bent[d]
                elif c == 2 and d == 2:
                    gain += notch[i, TORSION]
                if closed and d == 1:
                    gain += notch[i, STOP]
                jacobian[row, i * axes + b] += gain
    return worst


@compiled_in_place
def evaluate(
    tube: NotchedTube, tension: float, drive: Array, kept: Array, loads: NotchLoads, bends: Bends,
    behind: Array, value: Array, jacobian: Array, drag: float, start: Array, work: tuple[Array, ...],
) -> float:  # fmt: skip
    """Fill what is left of every balance and its derivative by w and the tension; return its size [N m].

    `drag` [N m/rad] resists all change of w from `start`.

    The last row is the tendon's length, where that is given: T >= 0, T = 0 or the length is met. `tension` is
    then that at the actuator, or of an inextensible tendon that behind the first edge: while it sticks there,
    the actuator's changes nothing.
    """
    notch, axes, w = tube.notch, tube.axes, bends.w
    n = w.shape[0]
    last = n * axes
    driven = not math.isnan(drive[DISPLACEMENT])
    inside = driven and drive[COMPLIANCE] == 0.0
    place(notch, axes, w, bends.stretch, work)
    loaded = loads_beyond(notch, loads, work)
    tensions(axes, tube.mu, tension, inside, kept, behind, n, work)
    size = last + 1 if driven else last
    jacobian[:size, :size] = 0.0
    worst = balance(tube, bends, behind, value, jacobian, work)
    span, grows, own = work[7], work[17], work[19]
    for i in range(n):
        for a in range(axes):
            for j in range(size):
                jacobian[i * axes + a, j] += grows[i, j] * own[i, 6 + a]
    if loaded:
        couple(axes, n, jacobian, work)
    if drag > 0.0:
        first, worst = 1 if axes == 1 else 0, 0.0
        for i in range(n):
            worst = max(worst, abs(own[i, 0]))
            for a in range(axes):
                row = i * axes + a
                value[row] += drag * (w[i, first + a] - start[i, first + a])
                jacobian[row, row] += drag
                worst = max(worst, abs(value[row]))
    if driven:
        longer = drive[COMPLIANCE] * (tension - drive[PRETENSION]) - drive[DISPLACEMENT]
        for i in range(n):
            longer += notch[i, SPAN] - span[i, 0]
        arm = notch[0, TENDON] + notch[0, CENTROID]
        if tension < drive[SCALE] * longer:  # the path is shorter than the tendon
            jacobian[last, last] = 1.0
            value[last] = tension
            return float(max(worst, tension * arm))
        value[last] = longer
        jacobian[last, last] = drive[COMPLIANCE]
        for i in range(n):
            value[last] += own[i, 2] * own[i, 0] / own[i, 1]
            jacobian[last, last] += own[i, 2] ** 2 * grows[i, last] / own[i, 1]
            for a in range(axes):
                jacobian[last, i * axes + a] = -own[i, 6 + a]
        worst = max(worst, abs(longer) * drive[SCALE] * arm)
    return float(worst)


# ----------------------------------------------------------------------------------------------------
# The way to an equilibrium: Newton's method, and where none is near, creeping against a drag.

_TOLERANCE_RAD = 1e-10
_LEFT_RAD = 1e-7  # what may be left over would bend the whole tube by so much
_NO_WORSE = 1.001  # a step may leave so much more than the one before: where a tendon sticks, all stays
_MOST_ROUNDS = 40
_MOST_HALVINGS = 8
_LARGEST_STEP_RAD = 0.2
_LARGEST_PULL = 0.5  # of a step: share of the tension, and of what bends the tube by a radian
_MOST_CREEPS = 100
_FIRST_DRAG = 0.3  # of what bends the whole tube by a radian


@compiled_in_place
def _step(
    axes: int, size: int, right: Array, move: Array, lengthen: Array, work: tuple[Array, ...]
) -> float:  # fmt: skip
    """Turn a solved right-hand side into steps of w and of the stretches; return the largest of w."""
    grows, own = work[17], work[19]
    n, first, largest = move.shape[0], 1 if axes == 1 else 0, 0.0
    move[:, :] = 0.0
    for i in range(n):
        tension = 0.0
        for j in range(size):
            tension += grows[i, j] * right[j]
        change = own[i, 0] + own[i, 2] * tension
        for a in range(axes):
            move[i, first + a] = right[i * axes + a]
            change += own[i, 3 + a] * right[i * axes + a]
            if not abs(right[i * axes + a]) <= largest:
                largest = abs(right[i * axes + a])
        lengthen[i] = -change / own[i, 1]
    return largest


@compiled_in_place
def equilibrium(
    tube: NotchedTube, tension: float, drive: Array, kept: Array, loads: NotchLoads, bends: Bends,
    behind: Array, drag: float, start: Array, space: tuple[Array, ...], work: tuple[Array, ...],
) -> tuple[bool, float, float]:  # fmt: skip
    """Move `bends` to the equilibrium near them; return whether found, tension, what is left."""
    notch, axes = tube.notch, tube.axes
    w, stretch = bends
    value, jacobian, move, lengthen, w_from, stretch_from = space
    n = w.shape[0]
    near = _LEFT_RAD * drive[SCALE] * (notch[0, TENDON] + notch[0, CENTROID]) ** 2
    size = n * axes + (0 if math.isnan(drive[DISPLACEMENT]) else 1)
    worst = evaluate(tube, tension, drive, kept, loads, bends, behind, value, jacobian, drag, start, work)
    for _ in range(_MOST_ROUNDS):
        for k in range(size):
            value[k] = -value[k]
        if not solve_vector(jacobian, value, 0.0):
            return False, tension, worst
        largest = _step(axes, size, value, move, lengthen, work)
        if not math.isfinite(largest):
            return False, tension, worst
        pull = value[size - 1] if size > n * axes else 0.0
        share = min(1.0, _LARGEST_STEP_RAD / largest) if largest > 0.0 else 1.0
        most = _LARGEST_PULL * (tension + near / _LEFT_RAD / (notch[0, TENDON] + notch[0, CENTROID]))
        if abs(pull) * share > most:
            share = most / abs(pull)
        before, tension_from = worst, tension
        for i in range(n):
            stretch_from[i] = stretch[i]
            for k in range(3):
                w_from[i, k] = w[i, k]
        for _ in range(_MOST_HALVINGS):
            for i in range(n):
                stretch[i] = stretch_from[i] + share * lengthen[i]
                for k in range(3):
                    w[i, k] = w_from[i, k] + share * move[i, k]
            tension = max(tension_from + share * pull, 0.0)
            worst = evaluate(
                tube, tension, drive, kept, loads, bends, behind, value, jacobian, drag, start, work
            )
            if worst <= _NO_WORSE * before or largest < _TOLERANCE_RAD:
                break
            share *= 0.5
        # The next step would be smaller than this one by as much as what is left over is.
        if worst < near and (largest < _TOLERANCE_RAD or largest * worst < 0.1 * _TOLERANCE_RAD * before):
            return True, tension, worst
    return False, tension, worst


@compiled_in_place
def let_go(
    tube: NotchedTube, tension: float, drive: Array, kept: Array, loads: NotchLoads, bends: Bends,
    trial: Bends, behind: Array, space: tuple[Array, ...], work: tuple[Array, ...],
) -> tuple[bool, float, float]:  # fmt: skip
    """Follow a snap: creep against a drag until an equilibrium is near; return as `equilibrium` does.

    Where notches soften, the way of equilibria ends, and the tube moves on its own, its friction with it.
    `bends` and `kept` creep along; `trial` is the equilibrium.
    """
    notch = tube.notch
    w, stretch = bends
    w_try, stretch_try = trial
    n = w.shape[0]
    full = drive[SCALE] * (notch[0, TENDON] + notch[0, CENTROID]) ** 2
    drag, worst = _FIRST_DRAG * full, 0.0
    for _ in range(_MOST_CREEPS):
        for i in range(n):
            stretch_try[i] = stretch[i]
            for k in range(3):
                w_try[i, k] = w[i, k]
        found, trying, worst = equilibrium(
            tube, tension, drive, kept, loads, trial, behind, drag, w, space, work
        )
        if not found:
            drag *= 4.0
            continue
        drag *= 0.7
        tension = trying
        for i in range(n):
            stretch[i] = stretch_try[i]
            kept[2 * i], kept[2 * i + 1] = behind[2 * i], behind[2 * i + 1]
            for k in range(3):
                w[i, k] = w_try[i, k]
        found, trying, worst = equilibrium(
            tube, tension, drive, kept, loads, trial, behind, 0.0, w, space, work
        )
        if found:
            return True, trying, worst
    return False, tension, worst


# ----------------------------------------------------------------------------------------------------
# The way through rows of inputs, from rest under the weight.

_SHORTEST_STEP = 1e-2  # share of the way between two rows


@compiled
def _follow(
    tube: NotchedTube, drive: Array, drives: Array, weight: Array, element: np.ndarray, forces: Array,
    moments: Array, steps: np.ndarray, rows_of: Bends, tension_rows: Array, left: Array,
) -> int:  # fmt: skip
    """Lead one robot from rest through rows of inputs; return how many were reached. See `march`."""
    notch, axes, mu = tube.notch, tube.axes, tube.mu
    n, rows = notch.shape[0], drives.shape[0] - 1
    size = n * axes + (0 if math.isnan(drive[DISPLACEMENT]) else 1)
    work = workspace(n)
    space = (
        np.empty(size), np.empty((size, size)), np.empty((n, 3)), np.empty(n), np.empty((n, 3)), np.empty(n),
    )  # fmt: skip
    w, stretch = notch[:, REST : REST + 3].copy(), np.zeros(n)
    w_try, stretch_try = np.empty((n, 3)), np.empty(n)
    kept, behind = np.zeros(2 * n), np.empty(2 * n)
    force, moment = np.zeros((n, 3)), np.zeros((n, 3))
    hanging, now = np.empty((n, 3)), drive.copy()
    loads, bends, trial = NotchLoads(hanging, force, moment), Bends(w, stretch), Bends(w_try, stretch_try)
    by_length, tension, actuator = not math.isnan(drive[DISPLACEMENT]), 0.0, 0.0
    for row in range(rows + 1):  # the first way is to rest under the weight
        start, done, stride = max(row - 1, 0), 0.0, 1.0 / steps[row]
        while done < 1.0:
            part = done + stride
            if part > 1.0 - 1e-9:
                part = 1.0
            aim = drives[start] + part * (drives[row] - drives[start])
            for k in range(3):
                for i in range(n):
                    hanging[i, k] = weight[i, k] * (part if row == 0 else 1.0)
                    force[i, k] = moment[i, k] = 0.0
                for q in range(element.shape[0]):
                    i = element[q]
                    force[i, k] += forces[start, q, k] + part * (forces[row, q, k] - forces[start, q, k])
                    moment[i, k] += moments[start, q, k] + part * (moments[row, q, k] - moments[start, q, k])
            trying = tension if by_length else aim
            if by_length:
                now[DISPLACEMENT] = aim
                now[PRETENSION] = drive[PRETENSION] * (part if row == 0 else 1.0)
            w_try[:, :] = w
            stretch_try[:] = stretch
            found, trying, worst = equilibrium(
                tube, trying, now, kept, loads, trial, behind, 0.0, w, space, work
            )
            if not found and stride > _SHORTEST_STEP:
                stride *= 0.5
                continue
            if not found:  # no equilibrium near by: let the tube go, slowly
                held = tension if by_length else aim
                found, trying, worst = let_go(tube, held, now, kept, loads, bends, trial, behind, space, work)
                stride = 1.0 / steps[row]
            if not found:
                return max(row - 1, 0)
            actuator = trying
            if by_length and drive[COMPLIANCE] == 0.0:
                turn = math.exp(mu * work[7][0, 2])
                actuator = trying * turn if trying >= kept[0] else trying / turn
            w[:, :] = w_try
            stretch[:] = stretch_try
            kept[:] = behind
            tension, done = trying, part
            left[max(row - 1, 0)] = worst
        if row > 0:
            rows_of.w[row - 1] = w
            rows_of.stretch[row - 1] = stretch
            tension_rows[row - 1, 0] = actuator
            for i in range(n):
                tension_rows[row - 1, 1 + i] = behind[2 * i]
    return int(rows)


@compiled
def march(
    tubes: NotchedTube, drive: Array, drives: Array, weight: Array, element: np.ndarray, forces: Array,
    moments: Array, steps: np.ndarray, bends: Bends, tension: Array, left: Array,
) -> None:  # fmt: skip
    """Lead many robots from rest, first under their weight, then through rows of inputs.

    NaN from the row on at which a robot finds no equilibrium.

    Args:
        tubes: B of them.
        drive: (B, 4), its first entry NaN where the tension is given.
        drives: tension [N] or displacement [m], zero first, (B, r + 1).
        weight: of the elements, in the base frame, (B, n, 3) [N].
        element: which are loaded on their distal faces, (p,).
        forces, moments: on these, zero first, (B, r + 1, p, 3) [N, N m].
        steps: at least so many to each row, (r + 1,).
        bends: filled, (B, r, n, 3) [rad] and (B, r, n).
        tension: filled, (B, r, n + 1): at the actuator, then in each notch [N].
        left: filled, what no balance accounts for, (B, r) [N m].
    """
    for b in range(tubes.notch.shape[0]):
        tube = NotchedTube(tubes.notch[b], tubes.fibre[b], tubes.metal[b], tubes.axes, tubes.mu[b])
        filled = Bends(bends.w[b], bends.stretch[b])
        reached = _follow(
            tube, drive[b], drives[b], weight[b], element, forces[b], moments[b], steps,
            filled, tension[b], left[b],
        )  # fmt: skip
        filled.w[reached:] = np.nan
        filled.stretch[reached:] = np.nan
        tension[b, reached:] = np.nan
        left[b, reached:] = np.nan
