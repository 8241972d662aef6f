"""Newton's method for the joints' angles, compiled."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.kinds.rolling.theory.kernels.balance import evaluate
from catheter_sim.kinds.rolling.theory.kernels.columns import HIGH, LOW
from catheter_sim.mechanics.arrays import Array
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.linear import solve_lower, solve_vector
from catheter_sim.mechanics.vectors import copy, largest_size

ANGLE_TOLERANCE_RAD = 1e-11
_MOST_ROUNDS = 40
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
    kept: Array,
    theta: Array,
    length: Array,
    load_link: np.ndarray,
    load_point: Array,
    load_force: Array,
    tip_moment: Array,
    at_joint: Array,
    above: Array,
    value: Array,
    work: tuple[Array, ...],
) -> bool:
    """Move `theta` to the equilibrium nearest to it; return whether one was found."""
    n = joint.shape[0]
    jacobian, step, trial = np.empty((n, n)), np.empty(n), np.empty(n)
    loaded = evaluate(
        joint, rod, stiffness, pulled, mu, drive, kept, theta, length,
        load_link, load_point, load_force, tip_moment, at_joint, above, value, jacobian, work,
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
        for _ in range(_MOST_HALVINGS):
            for k in range(n):
                trial[k] = theta[k] + share * step[k]
            loaded = evaluate(
                joint, rod, stiffness, pulled, mu, drive, kept, trial, length,
                load_link, load_point, load_force, tip_moment, at_joint, above, value, jacobian, work,
            )  # fmt: skip
            if largest_size(value) <= worst or largest < ANGLE_TOLERANCE_RAD:
                break
            share *= 0.5
        copy(trial, theta)
        # The next step would be smaller than this one by as much as what is left over is.
        if largest < ANGLE_TOLERANCE_RAD or largest * largest_size(value) < 0.1 * ANGLE_TOLERANCE_RAD * worst:
            return True
    return False
