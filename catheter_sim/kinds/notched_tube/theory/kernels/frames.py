"""Frames and points of all notches of a bent tube, and how they move with the bends."""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.notched_tube.theory.kernels.columns import CENTROID, HEIGHT, TENDON, UNCUT
from catheter_sim.kinds.notched_tube.theory.kernels.geometry import shape, turned_by
from catheter_sim.mechanics.compiled import compiled, compiled_in_place
from catheter_sim.mechanics.vectors import dot3

_NUDGE = 1e-6  # of w, for second derivatives of a notch's shape


@compiled
def workspace(n: int) -> tuple[Array, ...]:
    """Return the arrays that `evaluate` works in: made once for a whole history.

    Of every notch: frames below and above, upper end of the centroid line, distal face, that line and its
    slope by w, turn by w, slope of the span, the span; how these change with w; what acts beyond it; how it
    moves and turns the rest; its tension's slope by all unknowns; its axial balance; and scratch.
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
