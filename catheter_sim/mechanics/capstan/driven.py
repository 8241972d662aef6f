"""Tendons on drives that give way: how their tensions rise and fall together, compiled."""

from __future__ import annotations

from catheter_sim.arrays import Array, Index, Places
from catheter_sim.mechanics.compiled import compiled_in_place
from catheter_sim.mechanics.linear import solve_definite


@compiled_in_place
def couple_driven(
    ends: Index, drive: Array, row_start: Places, dof: Places, arm: Array, gain: Array, shared: Array
) -> int:
    """Write how fast driven tendons shorten where the tension of one of them rises alike in all its spans.

    Args:
        ends, drive, row_start, dof: as of `solve_tensions`.
        arm, gain: of each nonzero of the tendons' Jacobian, shape (e,).
        shared: out: rows 0 to t: fall of the length rate of tendon j per unit of the tension of tendon l,
            [j, l], and on the diagonal 1 / drive besides; the rest is workspace, shape (2 t + 4 + nv, t).

    Returns:
        How many tendons are driven.
    """
    tendons = ends.shape[0]
    driven, arms = 0, shared[2 * tendons + 4 :]
    for j in range(tendons):
        driven += drive[j] > 0.0
    if driven < 2:
        return driven
    arms[:] = 0.0
    for j in range(tendons):
        if drive[j] > 0.0:
            for place in range(row_start[j], row_start[j + 1]):
                arms[dof[place], j] += arm[place]
    for j in range(tendons):
        if drive[j] > 0.0:
            shared[j] = 0.0
            for place in range(row_start[j], row_start[j + 1]):
                for other in range(tendons):
                    shared[j, other] += gain[place] * arms[dof[place], other]
            shared[j, j] += 1.0 / drive[j]
    return driven


@compiled_in_place
def raise_together(
    entering: Array,
    drive: Array,
    ends: Index,
    row_start: Places,
    dof: Places,
    span: Places,
    arm: Array,
    gain: Array,
    shared: Array,
    reached: Array,
    tension: Array,
    ahead: Array,
) -> float:
    """Raise each driven tendon's tensions alike in all spans by what is best for all of them at once.

    The differences at the holes stay as they are. Without this, tendons that pull against one another on
    stiff drives would come down together by next to nothing in a pass, since each by itself only holds the
    other's pull. No tension falls below zero (a quadratic programme with bounds, by active sets).

    Args:
        entering, drive, ends, row_start, dof, span: as of `solve_tensions`.
        arm, gain: of each nonzero of the tendons' Jacobian, shape (e,).
        shared: as `couple_driven` left it.
        reached: in and out: tensions at the actuators at the end of the step, shape (t,) [N].
        tension: in and out: shape (t, n) [N].
        ahead: in and out: velocities at the end of the step, shape (nv,).

    Returns:
        The largest change of a tension [N].
    """
    tendons = ends.shape[0]
    matrix, slope = shared[tendons : 2 * tendons], shared[2 * tendons]
    goal, shift, held = shared[2 * tendons + 1], shared[2 * tendons + 2], shared[2 * tendons + 3]
    for j in range(tendons):
        slope[j], shift[j], held[j] = 0.0, 0.0, 1.0
        if drive[j] > 0.0:
            held[j] = 0.0
            slope[j] = (reached[j] - entering[j]) / drive[j]
            for place in range(row_start[j], row_start[j + 1]):
                slope[j] -= arm[place] * ahead[dof[place]]
    for _ in range(4 * tendons):
        for j in range(tendons):
            for other in range(tendons):
                matrix[j, other] = shared[j, other] if held[j] == 0.0 and drive[other] > 0.0 else 0.0
            goal[j] = -slope[j]
            if held[j] > 0.0:
                matrix[j, j], goal[j] = 1.0, shift[j]
        solve_definite(matrix, goal)
        part, first = 1.0, -1  # of the way to the goal, up to where the first tension is zero
        for j in range(tendons):
            if held[j] == 0.0 and goal[j] < -reached[j]:
                share = (-reached[j] - shift[j]) / (goal[j] - shift[j])
                if share < part or first < 0:
                    part, first = share, j
        for j in range(tendons):
            shift[j] += part * (goal[j] - shift[j])
        if first >= 0:
            shift[first], held[first] = -reached[first], 1.0
            continue
        strongest = 0.0
        for j in range(tendons):  # which of those that are held would rather rise
            if drive[j] > 0.0 and held[j] > 0.0:
                push = slope[j]
                for other in range(tendons):
                    if drive[other] > 0.0:
                        push += shared[j, other] * shift[other]
                if push < strongest:
                    strongest, first = push, j
        if first < 0:
            break
        held[first] = 0.0
    change = 0.0
    for j in range(tendons):
        if drive[j] == 0.0:
            continue
        reached[j] = max(reached[j] + shift[j], 0.0)
        for place in range(row_start[j], row_start[j + 1]):
            risen = max(shift[j], -tension[j, span[place]])
            ahead[dof[place]] -= gain[place] * risen
        for k in range(ends[j]):
            risen = max(shift[j], -tension[j, k])
            tension[j, k] += risen
            change = max(change, abs(risen))
    return change
