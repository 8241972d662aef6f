"""Newton's method for lumped robots, and loads raised in steps where it fails, compiled."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.tdcr.lumped_kernels.balance import evaluate
from catheter_sim.kinds.continuum.theory.tdcr.lumped_kernels.models import ARC, PLANE
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.eight import room
from catheter_sim.mechanics.linear_eights import solve_columns_of_any
from catheter_sim.mechanics.vectors import cross3, dot3, fill, largest_size

TOLERANCE_RAD = 1e-12  # unbalanced moment over EI / length at which Newton's method stops
_BALANCED_RAD = 1e-9  # where rounding keeps it from that, what still counts as balance
_MOST_STEPS = 40
LONGEST_STEP_RAD = 1.0  # of any unknown; longer ones are shortened
_ABSURD_STEP_RAD = 1e3
_SHORTEST_SHARE = 1e-3  # of the load


@compiled
def newton_step(
    r: Array, D: Array, parts: Array, loads: Array, swing: Array, B: Array, C: Array, step: Array
) -> None:
    """Write the solution of (U + B C) step = -r, NaN where there is none; D is used up.

    Arguments as of `balance.evaluate`.
    """
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
            if model == ARC or e != PLANE:
                x[k, e] = 0.0


@compiled
def solve_rows(
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
            found, and the row's posture is none. Rows that have 1 already are left as they are.
        steps: load steps that were taken, shape (r,).
    """
    rows, n, d = x.shape
    r, B, C = room((n, d), x), room((n, d, 3), x), room((n, d, 3), x)
    D, parts = room((n, d, d), x), room((4, n, d, 3), x)
    loads, swing = room((n + 2, 3), x), room((n + 2, 3, 3), x)
    step, good = room((n, d), x), room((n, d), x)
    for row in range(rows):
        if reached[row] == 1.0:
            continue
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
