"""Tensions of a robot in motion, compiled: joints that all carry the same masses, so that none yields alone.

A pass of `solve_tensions` lets each degree of freedom yield by its own implicit inertia, as if the others
stood still. That bounds how far all of them together yield: a pass is a step down the same convex problem
whose derivative, the velocities at the end of the step, is here found with the whole inertia. Such steps are
short where many joints move as one; what the last one changed is added again before each (Nesterov 1983, as
in Beck and Teboulle 2009, Eqs 4.1-4.3), and forgotten where it points up (O'Donoghue and Candes 2015).
"""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array, Index, Places
from catheter_sim.mechanics.compiled import compiled, compiled_in_place


@compiled_in_place
def go_on(momentum: float, ends: Index, moved: Array, last: Array, tension: Array) -> float:
    """Let the tensions go on as the last pass changed them; return the next momentum.

    Args:
        momentum: 1 at first.
        ends: as of `solve_tensions`.
        moved: what the last pass changed, from where it began, shape (t, n) [N].
        last: in: tensions after the pass before it; out: after the last one, shape (t, n) [N].
        tension: in: after the last pass; out: where the next one begins, shape (t, n) [N].
    """
    up = 0.0
    for j in range(ends.shape[0]):
        for k in range(ends[j]):
            up -= moved[j, k] * (tension[j, k] - last[j, k])
    if up > 0.0:
        momentum = 1.0
    following = 0.5 * (1.0 + np.sqrt(1.0 + 4.0 * momentum * momentum))
    share = (momentum - 1.0) / following
    for j in range(ends.shape[0]):
        for k in range(ends[j]):
            now = tension[j, k]
            tension[j, k] = max(now + share * (now - last[j, k]), 0.0)
            last[j, k] = now
    return following


@compiled_in_place
def look_ahead(
    velocity: Array,
    free: Array,
    inverse: Array,
    ends: Index,
    row_start: Places,
    dof: Places,
    span: Places,
    arm: Array,
    tension: Array,
    torque: Array,
    ahead: Array,
) -> None:
    """Write the velocities at the end of the step under `tension` into `ahead`, shape (nv,).

    Args:
        velocity: now, shape (nv,).
        free: all generalised forces but the tendons', shape (nv,).
        inverse, ends, row_start, dof, span: as of `solve_tensions`.
        arm: d(length)/d(q) of each entry, shape (e,).
        tension: shape (t, n) [N].
        torque: workspace, shape (nv,).
    """
    count = velocity.shape[0]
    for i in range(count):
        torque[i] = free[i]
    for j in range(ends.shape[0]):
        if ends[j] > 0:
            for place in range(row_start[j], row_start[j + 1]):
                torque[dof[place]] -= arm[place] * tension[j, span[place]]
    for i in range(count):
        total = 0.0
        for j in range(count):
            total += inverse[i, j] * torque[j]
        ahead[i] = velocity[i] + total


@compiled
def step_over_inertia(
    entries: Array,
    row_start: Index,
    row_count: Index,
    column: Index,
    own: Array,
    timestep: float,
) -> Array:
    """Return the timestep times the inverse of the whole implicit inertia, shape (nv, nv).

    Args:
        entries: of MuJoCo's inertia matrix, its lower triangle row by row, shape (nM,).
        row_start, row_count, column: where they are.
        own: what damping and springs add to each degree of freedom's, shape (nv,).
        timestep: [s].
    """
    count = own.shape[0]
    inertia = np.zeros((count, count))
    for i in range(count):
        for place in range(row_start[i], row_start[i] + row_count[i]):
            inertia[i, column[place]] = entries[place]
            inertia[column[place], i] = entries[place]
    for i in range(count):
        inertia[i, i] += own[i]
    inertia[:] = timestep * np.linalg.inv(inertia)
    return inertia
