"""A robot's way along its inputs, with the tensions that friction keeps, compiled."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.rolling.theory.kernels.balance import workspace
from catheter_sim.kinds.rolling.theory.kernels.columns import LENGTH, REST
from catheter_sim.kinds.rolling.theory.kernels.newton import (
    find_equilibrium,
    find_equilibrium_by_sliding,
)
from catheter_sim.kinds.rolling.theory.kernels.sliding import SLIP, guess_shares
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.vectors import blend, copy

_SHORTEST_STEP = 1e-4  # share of the way between two inputs
_STEPS_FROM_REST = 8


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
    memory: Array,
    length: Array,
    load_link: np.ndarray,
    load_point: Array,
    force_from: Array,
    force_to: Array,
    moment_from: Array,
    moment_to: Array,
    pre_sliding_m: Array,
    steps: int,
    guide: Array,
    made: Array,
    at_joint: Array,
    value: Array,
    work: tuple[Array, ...],
) -> float:
    """Go from one row of inputs to the next in `steps` or more steps; return the share reached.

    `theta`, `memory` and `length` are moved along; `at_joint` and `value` are filled. The search for each
    equilibrium begins where its row of `guide` leads to, see `follow`. A step that finds none begins once
    more without, and then is cut in halves. Less than 1 is returned where none is found however short it is.
    """
    renewed, guess, lengths = np.empty_like(memory), np.empty_like(theta), np.empty_like(length)
    start, there = np.empty_like(theta), np.empty_like(drive_to)
    drive, force, moment = np.empty_like(drive_to), np.empty_like(force_to), np.empty_like(moment_to)
    done, stride, sliding = 0.0, 1.0 / steps, len(pre_sliding_m) > 0
    for step in range(steps):
        goal = (step + 1.0) / steps if step + 1 < steps else 1.0
        foreseen = len(guide) > 0 and not math.isnan(guide[step, 0, 0])
        whole, tries = True, 0
        copy(theta, start)
        while done < goal:
            part = done + stride
            if goal - part < 1e-9:
                part = goal
            for k in range(theta.shape[0]):
                guess[k] = theta[k] + (guide[step, 0, k] if foreseen else 0.0)
            copy(length, lengths)
            blend(drive_from, drive_to, part, drive)
            blend(drive_from, drive_to, done, there)
            for p in range(force.shape[0]):
                blend(force_from[p], force_to[p], part, force[p])
            blend(moment_from, moment_to, part, moment)
            if sliding:
                if foreseen:
                    renewed[SLIP] = guide[step, 1:]
                elif tries > 0:
                    renewed[SLIP] = memory[SLIP]
                else:
                    guess_shares(joint, rod, pulled, mu, there, drive, memory, theta, renewed)
                found = find_equilibrium_by_sliding(
                    joint, rod, stiffness, pulled, mu, pre_sliding_m[tries], drive, memory, guess, lengths,
                    load_link, load_point, force, moment, at_joint, renewed, value, work,
                )  # fmt: skip
            else:
                found = find_equilibrium(
                    joint, rod, stiffness, pulled, mu, drive, memory, guess, lengths,
                    load_link, load_point, force, moment, at_joint, renewed, value, work,
                )  # fmt: skip
            if found:
                copy(guess, theta)
                copy(lengths, length)
                memory[:] = renewed
                for r in range(pulled if sliding else 0):
                    if drive[r] == 0.0:
                        memory[SLIP, r] = 0.0  # without tension nothing rubs
                done = part
            elif sliding and not foreseen and tries < len(pre_sliding_m) - 1:
                tries += 1
                continue
            elif not foreseen:
                whole = False
                stride *= 0.5
                if stride < _SHORTEST_STEP:
                    return done
            foreseen, tries = False, 0
        for k in range(theta.shape[0]):
            made[step, 0, k] = theta[k] - start[k] if whole else math.nan
        if sliding:
            made[step, 1:] = memory[SLIP]
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
    pre_sliding_m: Array,
    guide: Array,
    made: Array,
    first: int,
    angle: Array,
    lengths: Array,
    memory: Array,
    theta: Array,
    length: Array,
    at_joint: Array,
    value: Array,
) -> int:
    """Go through rows of inputs, from the `first` on; return how many were reached.

    `angle`, shape (n,), `lengths`, (n,), and `memory`, (k, t, n), are those where the way begins and, when it
    returns, where it ended. From rest without load the way to row 0 is gone, too: `first` is 0; else row 0 is
    where the robot stands, and `first` is 1.

    Friction goes by how rods slide, by the first `pre_sliding_m` with which an equilibrium is found; of none,
    by the tensions that it keeps.
    `made` is filled for all s steps with what each did to the angles, NaN where it had to be cut, and where
    rods slide with their shares after it: shape (s, 1, n) or (s, 1 + t, n). `guide` is `made` of a robot that
    is much alike; of no steps: none is known.
    `drive`, shape (r, t), `load_force`, (r, p, 3), `tip_moment`, (r, 3), and `steps`, (r,), are those of the
    rows; `theta`, `length`, `value`, shape (r, n), and `at_joint`, (r, t, n), are filled.
    """
    rows, n = theta.shape
    before, start, work = 0, 0, workspace(n, pulled)
    for row in range(first, rows):
        end = start + steps[row]
        reached = advance(
            joint, rod, stiffness, pulled, mu, drive[before], drive[row], angle, memory, lengths,
            load_link, load_point, load_force[before], load_force[row], tip_moment[before], tip_moment[row],
            pre_sliding_m, steps[row], guide[start:end], made[start:end], at_joint[row], value[row], work,
        )  # fmt: skip
        if reached < 1.0:
            return row
        copy(angle, theta[row])
        copy(lengths, length[row])
        before, start = row, end
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
    nothing, memory, renewed = np.zeros((1, pulled, n)), np.zeros((1, pulled, n)), np.empty((1, pulled, n))
    slack, work = np.zeros(pulled), workspace(n, pulled)
    nothing_slides, nothing_known, made = np.empty(0), np.empty((0, 1, n)), np.empty((_STEPS_FROM_REST, 1, n))
    for b in range(batch):
        for k in range(n):
            theta[b, k] = theta[b - 1, k] if b > 0 else joint[k, REST]
            length[b, k] = length[b - 1, k] if b > 0 else joint[k, LENGTH]
        found = find_equilibrium(
            joint, rod, stiffness, pulled, mu, drive[b], nothing, theta[b], length[b],
            load_link, load_point, load_force, tip_moment, at_joint[b], renewed, value[b], work,
        )  # fmt: skip
        if not found:
            for k in range(n):
                theta[b, k] = joint[k, REST]
                length[b, k] = joint[k, LENGTH]
            memory[:] = 0.0
            reached = advance(
                joint, rod, stiffness, pulled, mu, slack, drive[b], theta[b], memory, length[b],
                load_link, load_point, load_force, load_force, tip_moment, tip_moment,
                nothing_slides, _STEPS_FROM_REST, nothing_known, made, at_joint[b], value[b], work,
            )  # fmt: skip
            if reached < 1.0:
                return b
    return -1
