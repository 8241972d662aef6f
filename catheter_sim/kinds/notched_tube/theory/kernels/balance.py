"""What is left of the balance of every notch, by virtual work, and its derivatives."""

from __future__ import annotations

import math

from catheter_sim.arrays import Array
from catheter_sim.kinds.notched_tube.theory.kernels.columns import (
    CENTROID,
    CLOSING,
    COMPLIANCE,
    CUBIC,
    DISPLACEMENT,
    HEIGHT,
    PITCH,
    PRETENSION,
    QUINTIC,
    REST,
    SCALE,
    SPAN,
    STOP,
    TENDON,
    TORSION,
)
from catheter_sim.kinds.notched_tube.theory.kernels.fibres import fibre_forces
from catheter_sim.kinds.notched_tube.theory.kernels.frames import place
from catheter_sim.kinds.notched_tube.theory.kernels.loads import couple, loads_beyond, swung_moment
from catheter_sim.kinds.notched_tube.theory.kernels.tension import tensions
from catheter_sim.mechanics.compiled import compiled_in_place
from catheter_sim.mechanics.vectors import dot3


@compiled_in_place
def balance(
    notch: Array, fibre: Array, metal: Array, axes: int, w: Array, stretch: Array, behind: Array,
    value: Array, jacobian: Array, work: tuple[Array, ...],
) -> float:  # fmt: skip
    """Fill what is left over at every notch, its stretch eliminated, and its own part of the Jacobian.

    Kept in `own`: axial balance left over [N m], its slope by the stretch, the span's slope by the stretch,
    then per w: slope of the axial balance, and the span's slope with the stretch eliminated. Returned is the
    largest size of what is left over, the axial balance included.
    """
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
    notch: Array, fibre: Array, metal: Array, axes: int, mu: float, tension: float, drive: Array,
    kept: Array, weight: Array, force: Array, moment: Array, w: Array, stretch: Array,
    behind: Array, value: Array, jacobian: Array, drag: float, start: Array, work: tuple[Array, ...],
) -> float:  # fmt: skip
    """Fill what is left of every balance and its derivative by w and the tension; return its size [N m].

    `drag` [N m/rad] resists all change of w from `start`.

    The last row is the tendon's length, where that is given: T >= 0, T = 0 or the length is met. `tension` is
    then that at the actuator, or of an inextensible tendon that behind the first edge: while it sticks there,
    the actuator's changes nothing.
    """
    n = w.shape[0]
    last = n * axes
    driven = not math.isnan(drive[DISPLACEMENT])
    inside = driven and drive[COMPLIANCE] == 0.0
    place(notch, axes, w, stretch, work)
    loaded = loads_beyond(notch, weight, force, moment, work)
    tensions(axes, mu, tension, inside, kept, behind, n, work)
    size = last + 1 if driven else last
    jacobian[:size, :size] = 0.0
    worst = balance(notch, fibre, metal, axes, w, stretch, behind, value, jacobian, work)
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
