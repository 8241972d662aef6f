"""Newton's step of `fkm_sliding`, compiled: solved from the tip to the base and back.

Arrays as in `sliding_balance`.
"""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.planar_kernels.columns import LENGTH, PRE_SLIDING_RAD
from catheter_sim.kinds.continuum.theory.planar_kernels.elastic import elastic_slope
from catheter_sim.mechanics.compiled import compiled


@compiled
def _stuck_losses(
    stiff: float,
    m: int,
    is_stuck: np.ndarray,
    stuck: np.ndarray,
    arm: Array,
    beyond: Array,
    alpha: Array,
    row: Array,
    matrix: Array,
) -> None:
    """Find the losses, alpha u + row, of the tendons that stick, from how far these are drawn in.

    A stuck tendon's loss grows by `stiff` for each unit drawn in, arm u + E, and E depends on the losses.
    """
    width = row.shape[1]
    lean, one = width - 2, width - 1
    count = 0
    for j in range(m):
        if is_stuck[j]:
            stuck[count] = j
            count += 1
    for p in range(count):
        s = stuck[p]
        for c in range(width):
            row[s, c] = 0.0
        row[s, 0] = alpha[s]
        row[s, 1 + s] = 1.0
        alpha[s] += stiff * (arm[s] + beyond[s, 0] + beyond[s, lean])
        row[s, lean] += stiff * beyond[s, lean]
        row[s, one] += stiff * beyond[s, one]
        for i in range(m):
            if not is_stuck[i]:
                alpha[s] += stiff * beyond[s, 1 + i] * alpha[i]
                row[s, 0] += stiff * beyond[s, 1 + i] * alpha[i]
                row[s, 1 + i] += stiff * beyond[s, 1 + i]
        for q in range(count):
            matrix[p, q] = (1.0 if p == q else 0.0) - stiff * beyond[s, 1 + stuck[q]]
    for p in range(count):
        for q in range(p + 1, count):
            share = matrix[q, p] / matrix[p, p]
            for c in range(p + 1, count):
                matrix[q, c] -= share * matrix[p, c]
            alpha[stuck[q]] -= share * alpha[stuck[p]]
            for c in range(width):
                row[stuck[q], c] -= share * row[stuck[p], c]
    for p in range(count - 1, -1, -1):
        s = stuck[p]
        for q in range(p + 1, count):
            alpha[s] -= matrix[p, q] * alpha[stuck[q]]
            for c in range(width):
                row[s, c] -= matrix[p, q] * row[stuck[q], c]
        alpha[s] /= matrix[p, p]
        for c in range(width):
            row[s, c] /= matrix[p, p]


@compiled
def newton_step(
    cell: Array,
    offset: Array,
    passing: np.ndarray,
    mu: float,
    loaded: bool,
    drag: float,
    angles: Array,
    slip: Array,
    pulled: Array,
    half: Array,
    lack: Array,
    outer: Array,
    step: Array,
) -> None:
    """Fill the change of the angles that brings `lack` to zero, to first order; NaN where none does.

    Unknown in cell k are the change u of its angle and, of each tendon, the change of what friction has
    taken so far (the exponent). They feel the cells before through those of cell k - 1 and through the
    lean, the sum of u so far; and the cells beyond through two kinds of sums: by how much each tendon is
    drawn in over the eyelet (E, where it sticks), and what loads add (G). From the tip on these sums are
    linear in what is unknown in the cell before, `beyond`. So the unknowns of a cell are linear in those of
    the cell before, `bend_by` and `lost_by`, and from the base on all are known. A tendon that slips loses
    `alpha` times the change of both adjoining angles, which needs no row of its own.

    Columns of `beyond`, `bend_by`, `lost_by`: u, each tendon's loss, lean, 1. Rows of `beyond`: E, then G.
    """
    n, t = slip.shape
    width, lean, one = t + 3, t + 1, t + 2
    beyond, renewed = np.zeros((t + 1, width)), np.zeros((t + 1, width))
    bend_by, lost_by = np.zeros((n, width)), np.empty((n, t, width))
    alpha, row, arm, weigh = np.empty((n, t)), np.empty((t, width)), np.empty(t), np.empty(t)
    is_stuck, stuck, matrix = np.zeros((n, t), np.bool_), np.empty(t, np.intp), np.empty((t, t))
    first = np.empty(t, np.intp)  # cell where each tendon sticks first
    widest = 1e-9
    for j in range(t):
        first[j] = n
        widest = max(widest, abs(offset[j]))
        for k in range(n - 1, -1, -1):
            if j < passing[k] and abs(slip[k, j]) < 1.0:
                is_stuck[k, j] = True
                first[j] = k
    pre_sliding = PRE_SLIDING_RAD * widest
    for k in range(n - 1, -1, -1):
        m, length = passing[k], cell[k, LENGTH]
        turn = 0.5 * (angles[k] + (angles[k - 1] if k > 0 else 0.0))
        side = 0.5 if turn > 0.0 else (-0.5 if turn < 0.0 else 0.0)
        own = elastic_slope(cell, k, angles[k]) + drag
        sticks = False
        for j in range(m):
            arm[j] = offset[j] * half[k, 0] + 0.5 * length * half[k, 1]
            weigh[j] = mu * arm[j] * pulled[k, j]
            own -= pulled[k, j] * (0.25 * length * half[k, 0] - 0.5 * offset[j] * half[k, 1])
            alpha[k, j] = slip[k, j] * side
            sticks = sticks or is_stuck[k, j]
        if sticks:
            _stuck_losses(abs(turn) / pre_sliding, m, is_stuck[k], stuck, arm, beyond, alpha[k], row, matrix)
        bend = bend_by[k]
        bend[one] = lack[k]
        if loaded:
            own -= outer[k] + beyond[t, 0] + beyond[t, lean]
            bend[lean] += outer[k] + beyond[t, lean]
            bend[one] += beyond[t, one]
        for j in range(m):
            felt = weigh[j] - beyond[t, 1 + j]
            own += felt * alpha[k, j]
            if is_stuck[k, j]:
                for c in range(width):
                    bend[c] -= felt * row[j, c]
            else:
                bend[0] -= felt * alpha[k, j]
                bend[1 + j] -= felt
        for c in range(width):
            bend[c] /= own
        for j in range(m):
            if is_stuck[k, j]:
                for c in range(width):
                    row[j, c] += alpha[k, j] * bend[c]
                    lost_by[k, j, c] = row[j, c]
        for i in range(t + 1):
            if (i < t and (i >= m or first[i] >= k)) or (i == t and not loaded):
                continue  # nobody before this cell asks for it
            share = beyond[i, 0] + beyond[i, lean] + (arm[i] if i < t else outer[k])
            for c in range(width):
                renewed[i, c] = 0.0
            for j in range(m):
                if is_stuck[k, j]:
                    for c in range(width):
                        renewed[i, c] += beyond[i, 1 + j] * row[j, c]
                else:
                    renewed[i, 0] += beyond[i, 1 + j] * alpha[k, j]
                    renewed[i, 1 + j] += beyond[i, 1 + j]
                    share += beyond[i, 1 + j] * alpha[k, j]
            for c in range(width):
                renewed[i, c] += share * bend[c]
            renewed[i, lean] += beyond[i, lean]
            renewed[i, one] += beyond[i, one]
        beyond, renewed = renewed, beyond
    known, following = np.zeros(width), np.zeros(width)
    known[one] = following[one] = 1.0
    for k in range(n):
        u = 0.0
        for c in range(width):
            u += bend_by[k, c] * known[c]
        for j in range(passing[k]):
            if is_stuck[k, j]:
                value = 0.0
                for c in range(width):
                    value += lost_by[k, j, c] * known[c]
            else:
                value = known[1 + j] + alpha[k, j] * (known[0] + u)
            following[1 + j] = value
        following[0] = step[k] = u
        following[lean] = known[lean] + u
        known, following = following, known
