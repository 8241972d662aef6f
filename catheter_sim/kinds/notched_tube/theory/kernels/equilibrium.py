"""The way to an equilibrium: Newton's method, and where none is near, creeping against a drag."""

from __future__ import annotations

import math

from catheter_sim.arrays import Array
from catheter_sim.kinds.notched_tube.theory.kernels.balance import evaluate
from catheter_sim.kinds.notched_tube.theory.kernels.columns import CENTROID, DISPLACEMENT, SCALE, TENDON
from catheter_sim.mechanics.compiled import compiled_in_place
from catheter_sim.mechanics.linear import solve_vector

_TOLERANCE_RAD = 1e-10
_LEFT_RAD = 1e-7  # what may be left over would bend the whole tube by so much
_NO_WORSE = 1.001  # a step may leave so much more than the one before: where a tendon sticks, all stays
_MOST_ROUNDS = 40
_MOST_HALVINGS = 8
_LARGEST_STEP_RAD = 0.2
_LARGEST_PULL = 0.5  # of a step: share of the tension, and of what bends the tube by a radian
_MOST_CREEPS = 100
_FIRST_DRAG = 0.3  # of what bends the whole tube by a radian


@compiled_in_place
def _step(
    axes: int, size: int, right: Array, move: Array, lengthen: Array, work: tuple[Array, ...]
) -> float:  # fmt: skip
    """Turn a solved right-hand side into steps of w and of the stretches; return the largest of w."""
    grows, own = work[17], work[19]
    n, first, largest = move.shape[0], 1 if axes == 1 else 0, 0.0
    move[:, :] = 0.0
    for i in range(n):
        tension = 0.0
        for j in range(size):
            tension += grows[i, j] * right[j]
        change = own[i, 0] + own[i, 2] * tension
        for a in range(axes):
            move[i, first + a] = right[i * axes + a]
            change += own[i, 3 + a] * right[i * axes + a]
            if not abs(right[i * axes + a]) <= largest:
                largest = abs(right[i * axes + a])
        lengthen[i] = -change / own[i, 1]
    return largest


@compiled_in_place
def equilibrium(
    notch: Array, fibre: Array, metal: Array, axes: int, mu: float, tension: float, drive: Array,
    kept: Array, weight: Array, force: Array, moment: Array, w: Array, stretch: Array,
    behind: Array, drag: float, start: Array, space: tuple[Array, ...], work: tuple[Array, ...],
) -> tuple[bool, float, float]:  # fmt: skip
    """Move `w` and `stretch` to the equilibrium near them; return whether found, tension, what is left."""
    value, jacobian, move, lengthen, w_from, stretch_from = space
    n = w.shape[0]
    near = _LEFT_RAD * drive[SCALE] * (notch[0, TENDON] + notch[0, CENTROID]) ** 2
    size = n * axes + (0 if math.isnan(drive[DISPLACEMENT]) else 1)
    worst = evaluate(
        notch, fibre, metal, axes, mu, tension, drive, kept, weight, force, moment, w, stretch,
        behind, value, jacobian, drag, start, work,
    )  # fmt: skip
    for _ in range(_MOST_ROUNDS):
        for k in range(size):
            value[k] = -value[k]
        if not solve_vector(jacobian, value, 0.0):
            return False, tension, worst
        largest = _step(axes, size, value, move, lengthen, work)
        if not math.isfinite(largest):
            return False, tension, worst
        pull = value[size - 1] if size > n * axes else 0.0
        share = min(1.0, _LARGEST_STEP_RAD / largest) if largest > 0.0 else 1.0
        most = _LARGEST_PULL * (tension + near / _LEFT_RAD / (notch[0, TENDON] + notch[0, CENTROID]))
        if abs(pull) * share > most:
            share = most / abs(pull)
        before, tension_from = worst, tension
        for i in range(n):
            stretch_from[i] = stretch[i]
            for k in range(3):
                w_from[i, k] = w[i, k]
        for _ in range(_MOST_HALVINGS):
            for i in range(n):
                stretch[i] = stretch_from[i] + share * lengthen[i]
                for k in range(3):
                    w[i, k] = w_from[i, k] + share * move[i, k]
            tension = max(tension_from + share * pull, 0.0)
            worst = evaluate(
                notch, fibre, metal, axes, mu, tension, drive, kept, weight, force, moment, w, stretch,
                behind, value, jacobian, drag, start, work,
            )  # fmt: skip
            if worst <= _NO_WORSE * before or largest < _TOLERANCE_RAD:
                break
            share *= 0.5
        # The next step would be smaller than this one by as much as what is left over is.
        if worst < near and (largest < _TOLERANCE_RAD or largest * worst < 0.1 * _TOLERANCE_RAD * before):
            return True, tension, worst
    return False, tension, worst


@compiled_in_place
def let_go(
    notch: Array, fibre: Array, metal: Array, axes: int, mu: float, tension: float, drive: Array,
    kept: Array, weight: Array, force: Array, moment: Array, w: Array, stretch: Array,
    w_try: Array, stretch_try: Array, behind: Array, space: tuple[Array, ...], work: tuple[Array, ...],
) -> tuple[bool, float, float]:  # fmt: skip
    """Follow a snap: creep against a drag until an equilibrium is near; return as `equilibrium` does.

    Where notches soften, the way of equilibria ends, and the tube moves on its own, its friction with it.
    `w`, `stretch` and `kept` creep along; `w_try` and `stretch_try` are the equilibrium.
    """
    n = w.shape[0]
    full = drive[SCALE] * (notch[0, TENDON] + notch[0, CENTROID]) ** 2
    drag, worst = _FIRST_DRAG * full, 0.0
    for _ in range(_MOST_CREEPS):
        for i in range(n):
            stretch_try[i] = stretch[i]
            for k in range(3):
                w_try[i, k] = w[i, k]
        found, trying, worst = equilibrium(
            notch, fibre, metal, axes, mu, tension, drive, kept, weight, force, moment,
            w_try, stretch_try, behind, drag, w, space, work,
        )  # fmt: skip
        if not found:
            drag *= 4.0
            continue
        drag *= 0.7
        tension = trying
        for i in range(n):
            stretch[i] = stretch_try[i]
            kept[2 * i], kept[2 * i + 1] = behind[2 * i], behind[2 * i + 1]
            for k in range(3):
                w[i, k] = w_try[i, k]
        found, trying, worst = equilibrium(
            notch, fibre, metal, axes, mu, tension, drive, kept, weight, force, moment,
            w_try, stretch_try, behind, 0.0, w, space, work,
        )  # fmt: skip
        if found:
            return True, trying, worst
    return False, tension, worst
