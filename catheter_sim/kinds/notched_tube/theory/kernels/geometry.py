"""A notch as a piece of a helix: its strip's centroid line, the tendon's span, its distal face."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.notched_tube.theory.kernels.columns import CENTROID, HEIGHT, TENDON, UNCUT
from catheter_sim.mechanics.compiled import compiled, compiled_in_place
from catheter_sim.mechanics.vectors import dot3


@compiled_in_place
def shape(
    w: Array, length: float, arm: float, p: Array, pw: Array, V: Array, lw: Array, rest: Array
) -> None:  # fmt: skip
    """Fill a notch's geometry in the frame of its lower edge.

    p: upper end of the centroid line from the lower one; pw: its derivative by w, V: the turn by w (left
    Jacobian); lw: derivative of the tendon's span by w; rest: the span, its derivative by the centroid
    line's length, and its turns at the lower and the upper edge.
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
