"""Newton's method for the joints' angles, compiled."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.rolling.theory.kernels.balance import evaluate
from catheter_sim.kinds.rolling.theory.kernels.columns import HIGH, LOW
from catheter_sim.kinds.rolling.theory.kernels.sliding import renew_shares
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.linear import solve_lower, solve_vector
from catheter_sim.mechanics.vectors import copy, largest_size

ANGLE_TOLERANCE_RAD = 1e-11
_MOST_ROUNDS = 40
_MOST_SLIDING_ROUNDS = 14
_FARTHEST_RAD = 0.3  # of a joint in one search that may overshoot: beyond, it fell to another equilibrium
_MOST_HALVINGS = 10
_TOWARD_LIMIT = 0.9  # of the way to a closing gap that one step may go


@compiled
def find_equilibrium(
    joint: Array,
    rod: Array,
    stiffness: Array,
    pulled: int,
    mu: float,
    drive: Array,
    memory: Array,
    theta: Array,
    length: Array,
    load_link: np.ndarray,
    load_point: Array,
    load_force: Array,
    tip_moment: Array,
    at_joint: Array,
    renewed: Array,
    value: Array,
    work: tuple[Array, ...],
) -> bool:
    """Move `theta` to the equilibrium nearest to it; return whether one was found."""
    n = joint.shape[0]
    jacobian, step, trial = np.empty((n, n)), np.empty(n), np.empty(n)
    loaded = evaluate(
        joint, rod, stiffness, pulled, mu, 0.0, drive, memory, theta, length,
        load_link, load_point, load_force, tip_moment, at_joint, renewed, value, jacobian, work,
    )  # fmt: skip
    for _ in range(_MOST_ROUNDS):
        worst = largest_size(value)
        for k in range(n):
            step[k] = -value[k]
        if not (solve_vector(jacobian, step, 0.0) if loaded else solve_lower(jacobian, step)):
            return False
        share = 1.0
        for k in range(n):
            room = joint[k, HIGH] - theta[k] if step[k] > 0.0 else theta[k] - joint[k, LOW]
            if abs(step[k]) * share > _TOWARD_LIMIT * room:
                share = _TOWARD_LIMIT * room / abs(step[k])
        largest = largest_size(step)
        if not math.isfinite(largest):
            return False
        # Where a rod starts or stops sticking the slope jumps. Then no share of the step may leave less over
        # than there is, and the one that leaves least is still the way across.
        best, best_share = math.inf, share
        for halvings in range(_MOST_HALVINGS + 1):
            if halvings == _MOST_HALVINGS:
                share = best_share
            for k in range(n):
                trial[k] = theta[k] + share * step[k]
            loaded = evaluate(
                joint, rod, stiffness, pulled, mu, 0.0, drive, memory, trial, length,
                load_link, load_point, load_force, tip_moment, at_joint, renewed, value, jacobian, work,
            )  # fmt: skip
            left = largest_size(value)
            if left <= worst or largest < ANGLE_TOLERANCE_RAD:
                break
            if left < best:
                best, best_share = left, share
            share *= 0.5
        copy(trial, theta)
        # The next step would be smaller than this one by as much as what is left over is.
        if largest < ANGLE_TOLERANCE_RAD or largest * largest_size(value) < 0.1 * ANGLE_TOLERANCE_RAD * worst:
            return True
    return False


@compiled
def find_equilibrium_by_sliding(
    joint: Array,
    rod: Array,
    stiffness: Array,
    pulled: int,
    mu: float,
    pre_sliding_m: float,
    drive: Array,
    memory: Array,
    theta: Array,
    length: Array,
    load_link: np.ndarray,
    load_point: Array,
    load_force: Array,
    tip_moment: Array,
    at_joint: Array,
    renewed: Array,
    value: Array,
    work: tuple[Array, ...],
) -> bool:
    """Move `theta` to the equilibrium nearest to it, rods sliding (`sliding`); return whether one was found.

    `renewed[SLIP]` holds the shares with which the search begins.
    """
    n = joint.shape[0]
    jacobian, step = np.empty((n, n)), np.empty(n)
    along, rods = work[4], work[20]
    before, largest, start = math.inf, math.inf, theta.copy()
    for _ in range(_MOST_SLIDING_ROUNDS):
        evaluate(
            joint, rod, stiffness, pulled, mu, pre_sliding_m, drive, memory, theta, length,
            load_link, load_point, load_force, tip_moment, at_joint, renewed, value, jacobian, work,
        )  # fmt: skip
        worst = 0.0
        for k in range(n):
            step[k] = -value[k] - along[2, k]
            worst = max(worst, abs(step[k]))
        if largest < ANGLE_TOLERANCE_RAD or largest * worst < 0.1 * ANGLE_TOLERANCE_RAD * before:
            farthest = 0.0
            for k in range(n):
                farthest = max(farthest, abs(theta[k] - start[k]))
            return farthest <= _FARTHEST_RAD
        before = worst
        if not solve_vector(jacobian, step, 0.0):
            return False
        share = 1.0
        for k in range(n):
            room = joint[k, HIGH] - theta[k] if step[k] > 0.0 else theta[k] - joint[k, LOW]
            if abs(step[k]) * share > _TOWARD_LIMIT * room:
                share = _TOWARD_LIMIT * room / abs(step[k])
        largest = largest_size(step)
        if not math.isfinite(largest):
            return False
        renew_shares(rod, pre_sliding_m, share, step, rods, renewed)
        for k in range(n):
            theta[k] += share * step[k]
    return False
