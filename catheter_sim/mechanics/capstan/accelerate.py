"""What saves passes over tendons that share joints, compiled: where they start and how they are cut short."""

from __future__ import annotations

from catheter_sim.arrays import Array, Index, Places
from catheter_sim.mechanics.compiled import compiled_in_place


@compiled_in_place
def start_from_last_change(entering: Array, ends: Index, tension: Array, past: Array) -> None:
    """Let all tensions change as in the last step, by the share by which the actuators' tensions do so again.

    The passes start there; where they end does not depend on it. Where the actuators hold, nothing changes.

    Args:
        entering: tensions at the actuators now, shape (t,) [N].
        ends: as of `solve_tensions`.
        tension: in and out: shape (t, n) [N].
        past: in: the last step's changes of tension, and in the last two columns its `entering` and the
            change of that; out: the last step's tensions, and these two of this step, shape (t, n + 2) [N].
    """
    n = tension.shape[1]
    along, square = 0.0, 0.0
    for j in range(ends.shape[0]):
        now, before = entering[j] - past[j, n], past[j, n + 1]
        along += now * before
        square += before * before
        past[j, n], past[j, n + 1] = entering[j], now
    share = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
    for j in range(ends.shape[0]):
        for k in range(n):
            old = tension[j, k]
            if k < ends[j]:
                tension[j, k] = max(old + share * past[j, k], 0.0)
            past[j, k] = old


@compiled_in_place
def extrapolate_passes(
    times: float,
    ends: Index,
    row_start: Places,
    dof: Places,
    span: Places,
    gain: Array,
    moved: Array,
    tension: Array,
    ahead: Array,
) -> None:
    """Change all tensions by `times` what the last pass changed, as further passes of its kind would.

    No tension falls below zero. Where friction does not allow the new tensions, the next pass mends them.

    Args:
        ends, row_start, dof, span: as of `solve_tensions`.
        gain: of each nonzero of the tendons' Jacobian, shape (e,).
        moved: what the last pass changed; out: what is changed here, shape (t, n) [N].
        tension: in and out: shape (t, n) [N].
        ahead: in and out: velocities at the end of the step, shape (nv,).
    """
    for j in range(ends.shape[0]):
        for k in range(ends[j]):
            moved[j, k] = max(times * moved[j, k], -tension[j, k])
            tension[j, k] += moved[j, k]
        if ends[j] > 0:
            for place in range(row_start[j], row_start[j + 1]):
                ahead[dof[place]] -= gain[place] * moved[j, span[place]]
