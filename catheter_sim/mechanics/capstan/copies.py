"""The capstan law of many copies of one robot, compiled."""

from __future__ import annotations

from catheter_sim.arrays import Array, Index, Places
from catheter_sim.mechanics.capstan.together import busy_spans, solve_tensions
from catheter_sim.mechanics.compiled import compiled_in_place


@compiled_in_place
def solve_tensions_of_copies(
    copies: Index,
    mu: float,
    entering: Array,
    drive: Array,
    turn: Array,
    ends: Index,
    ten_J: Array,
    row_start: Places,
    entry: Places,
    dof: Places,
    span: Places,
    lines: Index,
    velocity: Array,
    passive: Array,
    bias: Array,
    constraint: Array,
    applied: Array,
    yielding: Array,
    sweeps: int,
    tolerance: float,
    tension: Array,
    slip: Index,
    past: Array,
    holes: Array,
    pulls: Array,
    scratch: Array,
    shared: Array,
    busy: Index,
    inverse: Array,
) -> None:
    """`solve_tensions` of many robots.

    Args:
        copies: which of the m robots.
        entering, turn, ten_J, velocity, passive, bias, constraint, applied, tension, slip, past: as there, of
            each: one axis of m more before theirs.
        mu, drive, row_start, entry, dof, span, lines, yielding, sweeps, tolerance: as there, of all.
        ends: number of spans of each tendon, shape (t,).
        holes, pulls, scratch, shared: as there.
        busy: workspace, shape (t,).
        inverse: as there, of shape (0, 0): copies do not move.
    """
    for i in copies:
        busy_spans(entering[i], drive, ends, tension[i], busy)
        solve_tensions(
            mu,
            entering[i],
            drive,
            turn[i],
            busy,
            ten_J[i],
            row_start,
            entry,
            dof,
            span,
            lines,
            velocity[i],
            passive[i],
            bias[i],
            constraint[i],
            applied[i],
            yielding,
            sweeps,
            tolerance,
            tension[i],
            slip[i],
            past[i],
            holes,
            pulls,
            scratch,
            shared,
            inverse,
        )
