"""Eight rows of a lumped robot solved together, compiled: Newton's method at the full load.

`newton.solve_rows` solves a row by itself; here the same balances are evaluated for eight rows at once. A row
that is balanced stays as it is while the others go on. Rows that do not get there soon are left to
`solve_rows`, which raises their loads in steps.
"""

from __future__ import annotations

from typing import Any

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.tdcr.lumped_kernels.balance import evaluate
from catheter_sim.kinds.continuum.theory.tdcr.lumped_kernels.newton import (
    LONGEST_STEP_RAD,
    TOLERANCE_RAD,
    newton_step,
)
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.eight import (
    LANES,
    all_less,
    eights,
    floats_of_eights,
    lane,
    larger,
    room,
    select_less,
    take_lane,
)
from catheter_sim.mechanics.vectors import fill

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
    """Solve r rows, a multiple of LANES; arguments as of `newton.solve_rows`.

    Args:
        reached: result; 1.0: balanced; else the row is left as it was, to be solved by itself.
    """
    rows, n, d = x.shape
    count = len(hole)
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
    fill(spans, 0.0)
    for start in range(0, rows, LANES):
        at_once = True
        for i in range(LANES):
            at_once = at_once and first_share[start + i] == 1.0
        if not at_once:  # their loads are raised in steps
            continue
        _spread(tension, start, pulls)
        _spread(force, start, forces)
        _spread(moment, start, moments)
        _spread(x, start, guess)
        for rounds in range(_MOST_ROUNDS):
            norm = evaluate(
                model, now, free, length, bending, torsion, hole, last, mu, projected,
                eights(pulls), eights(forces), eights(moments), r, D, parts, loads, swing, B, C,
                eights(spans), eights(wrenches), eights(places), eights(turns), TOLERANCE_RAD,
            )  # fmt: skip
            if all_less(norm, TOLERANCE_RAD) or rounds + 1 == _MOST_ROUNDS:
                break
            newton_step(r, D, parts, loads, swing, B, C, step)
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
            take_lane(spans, i, span[row])
            take_lane(wrenches, i, wrench[row])
            take_lane(places, i, p[row])
            take_lane(turns, i, R[row])
            residual[row] = 0.0
            for k in range(n):
                for e in range(d):
                    residual[row] = max(residual[row], abs(left[k, e, i]))
