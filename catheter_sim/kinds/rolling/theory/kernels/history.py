"""A robot's way along its inputs, with the tensions that friction keeps, compiled."""

from __future__ import annotations

import numpy as np

from catheter_sim.kinds.rolling.theory.kernels.balance import workspace
from catheter_sim.kinds.rolling.theory.kernels.columns import LENGTH, REST
from catheter_sim.kinds.rolling.theory.kernels.newton import find_equilibrium
from catheter_sim.mechanics.arrays import Array
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.vectors import blend, copy

_SHORTEST_STEP = 1e-4  # share of the way between two inputs


@compiled
def advance(
    joint: Array,
    rod: Array,
    stiffness: Array,
    pulled: int,
    mu: float,
    drive_from: Array,
    drive_to: Array,
    theta: Array,
    kept: Array,
    length: Array,
    load_link: np.ndarray,
    load_point: Array,
    force_from: Array,
    force_to: Array,
    moment_from: Array,
    moment_to: Array,
    steps: int,
    trend: Array,
    at_joint: Array,
    value: Array,
    work: tuple[Array, ...],
) -> float:
    """Go from one row of inputs to the next in `steps` or more equal steps; return the share reached.

    `theta`, `kept` and `length` are moved along; `at_joint` and `value` are filled. The search for each
    equilibrium begins where its share of `trend`, the change of `theta` that is expected, leads to. A step
    that finds none begins once more without, and then is halved. Less than 1 is returned where none is found
    however short the step.
    """
    done, stride, foreseen = 0.0, 1.0 / steps, True
    above, guess, lengths = np.empty_like(kept), np.empty_like(theta), np.empty_like(length)
    drive, force, moment = np.empty_like(drive_to), np.empty_like(force_to), np.empty_like(moment_to)
    while done < 1.0:
        part = min(done + stride, 1.0)
        if 1.0 - part < 1e-9:
            part = 1.0
        for k in range(theta.shape[0]):
            guess[k] = theta[k] + ((part - done) * trend[k] if foreseen else 0.0)
        copy(length, lengths)
        blend(drive_from, drive_to, part, drive)
        for p in range(force.shape[0]):
            blend(force_from[p], force_to[p], part, force[p])
        blend(moment_from, moment_to, part, moment)
        found = find_equilibrium(
            joint, rod, stiffness, pulled, mu, drive, kept, guess, lengths,
            load_link, load_point, force, moment, at_joint, above, value, work,
        )  # fmt: skip
        if not found and foreseen:
            foreseen = False
            continue
        if not found:
            stride *= 0.5
            if stride < _SHORTEST_STEP:
                return done
            continue
        copy(guess, theta)
        copy(lengths, length)
        kept[:] = above
        done = part
    return 1.0


@compiled
def follow(
    joint: Array,
    rod: Array,
    stiffness: Array,
    pulled: int,
    mu: float,
    drive: Array,
    load_link: np.ndarray,
    load_point: Array,
    load_force: Array,
    tip_moment: Array,
    steps: np.ndarray,
    guide: Array,
    theta: Array,
    length: Array,
    at_joint: Array,
    value: Array,
) -> int:
    """Go from rest without load through rows of inputs; return how many were reached.

    `guide`, shape (r, n), is the way of a robot that is much alike; (0, n): none is known.
    `drive`, shape (r, t), `load_force`, (r, p, 3), `tip_moment`, (r, 3), and `steps`, (r,), are those of the
    rows; `theta`, `length`, `value`, shape (r, n), and `at_joint`, (r, t, n), are filled.
    """
    rows, n = theta.shape
    angle, lengths = joint[:, REST].copy(), joint[:, LENGTH].copy()
    kept, before, work = np.zeros((pulled, n)), 0, workspace(n, pulled)
    trend = np.zeros(n)
    for row in range(rows):
        if row > 0 and len(guide) > 0:
            for k in range(n):
                trend[k] = guide[row, k] - guide[row - 1, k]
        reached = advance(
            joint, rod, stiffness, pulled, mu, drive[before], drive[row], angle, kept, lengths,
            load_link, load_point, load_force[before], load_force[row], tip_moment[before], tip_moment[row],
            steps[row], trend, at_joint[row], value[row], work,
        )  # fmt: skip
        if reached < 1.0:
            return row
        copy(angle, theta[row])
        copy(lengths, length[row])
        before = row
    return rows


@compiled
def load_batch(
    joint: Array,
    rod: Array,
    stiffness: Array,
    pulled: int,
    mu: float,
    drive: Array,
    length: Array,
    load_link: np.ndarray,
    load_point: Array,
    load_force: Array,
    tip_moment: Array,
    theta: Array,
    at_joint: Array,
    value: Array,
) -> int:
    """Solve configurations that are each loaded from rest; return the index of one that fails, or -1.

    `drive`, shape (b, t); `theta`, `length`, shape (b, n), `at_joint` (b, t, n) and `value` (b, n) are
    filled. Each starts from the one before, and from rest in steps where that leads nowhere.
    """
    batch, n = theta.shape
    nothing, kept, above = np.zeros((pulled, n)), np.zeros((pulled, n)), np.empty((pulled, n))
    slack, still, work = np.zeros(pulled), np.zeros(n), workspace(n, pulled)
    for b in range(batch):
        for k in range(n):
            theta[b, k] = theta[b - 1, k] if b > 0 else joint[k, REST]
            length[b, k] = length[b - 1, k] if b > 0 else joint[k, LENGTH]
        found = find_equilibrium(
            joint, rod, stiffness, pulled, mu, drive[b], nothing, theta[b], length[b],
            load_link, load_point, load_force, tip_moment, at_joint[b], above, value[b], work,
        )  # fmt: skip
        if not found:
            for k in range(n):
                theta[b, k] = joint[k, REST]
                length[b, k] = joint[k, LENGTH]
            kept[:] = 0.0
            reached = advance(
                joint, rod, stiffness, pulled, mu, slack, drive[b], theta[b], kept, length[b],
                load_link, load_point, load_force, load_force, tip_moment, tip_moment, 8,
                still, at_joint[b], value[b], work,
            )  # fmt: skip
            if reached < 1.0:
                return b
    return -1
