"""`fkm_sliding`, compiled: many robots along their inputs.

The same steps and Newton's method as in `sliding` in plain Python; arrays as in `sliding_balance`.
"""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.planar_kernels.columns import (
    LARGEST,
    LENGTH,
    MOST_CREEP_STEPS,
    MOST_DRAG,
    NO_DRAG,
    REST,
    STIFFNESS,
)
from catheter_sim.kinds.continuum.theory.planar_kernels.sliding_balance import evaluate
from catheter_sim.kinds.continuum.theory.planar_kernels.sliding_step import newton_step
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.vectors import copy, fill, scale

_TOLERANCE_RAD = 2e-10
_MOST_ROUNDS = 40
_MOST_SHARES = 15
_FINEST = 256  # parts into which a step that fails is cut


@compiled
def _equilibrium(
    cell: Array,
    offset: Array,
    passing: np.ndarray,
    mu: float,
    weight: Array,
    drive: Array,
    drag: float,
    trend: Array,
    angles: Array,
    slip: Array,
) -> bool:
    """Move `angles` and `slip` to the equilibrium under `drive`; return whether one was found.

    `sliding._newton`, but that the search starts `trend` further on.
    """
    n, t = slip.shape
    loaded = drive[t] != 0.0 or drive[t + 1] != 0.0 or drive[t + 2] != 0.0
    softest = math.inf
    start_half = np.empty((n, 2))
    for k in range(n):
        start_half[k, 0], start_half[k, 1] = math.cos(0.5 * angles[k]), math.sin(0.5 * angles[k])
        softest = min(softest, cell[k, STIFFNESS] / cell[k, LENGTH])
        loaded = loaded or weight[k, 0] != 0.0 or weight[k, 1] != 0.0
    now, there, lack, outer, step = (
        np.empty(n), np.empty((n, t)), np.empty(n), np.zeros(n), np.empty(n),
    )  # fmt: skip
    trial, pulled, half = np.empty(n), np.zeros((n, t)), np.empty((n, 2))
    copy(angles, now)
    copy(trend, step)
    size, best_share = math.inf, 1.0
    for rounds in range(_MOST_ROUNDS + 1):
        # Where an eyelet starts or stops sticking the slope jumps. Then no share of the step may be
        # better than where we are, and the best one is still the way across.
        best, share = math.inf, 1.0
        for shares in range(_MOST_SHARES + 1):
            again = shares == _MOST_SHARES
            if again:
                share = best_share
                if not math.isfinite(best):
                    return False
            inside = True
            for k in range(n):
                trial[k] = now[k] + share * step[k]
                inside = inside and abs(trial[k]) < cell[k, LARGEST]
            if inside:
                found = evaluate(
                    cell, offset, passing, mu, weight, drive, loaded, drag, angles, start_half,
                    slip, trial, there, pulled, half, lack, outer,
                )  # fmt: skip
                if found < best:
                    best, best_share = found, share
                if again or found < (1.0 - 1e-4 * share) * size:
                    break
            share *= 0.5
        copy(trial, now)
        size = best
        settled = True
        for k in range(n):
            settled = settled and abs(lack[k]) < _TOLERANCE_RAD * softest
        if settled:
            copy(now, angles)
            for k in range(n):
                copy(there[k], slip[k])
            return True
        if rounds < _MOST_ROUNDS:
            newton_step(cell, offset, passing, mu, loaded, drag, now, there, pulled, half, lack, outer, step)
    return False


@compiled
def _creep(
    cell: Array,
    offset: Array,
    passing: np.ndarray,
    mu: float,
    weight: Array,
    drive: Array,
    angles: Array,
    slip: Array,
) -> bool:
    """Move to the equilibrium that is reached slowly where there is none close by: `sliding._creep`."""
    still = np.zeros(len(angles))
    stiffness = math.inf
    for k in range(len(angles)):
        stiffness = min(stiffness, cell[k, STIFFNESS] / cell[k, LENGTH])
    drag, last = stiffness, False
    for _ in range(2 * MOST_CREEP_STEPS):
        found = _equilibrium(
            cell, offset, passing, mu, weight, drive, 0.0 if last else drag, still, angles, slip
        )
        if last:
            if found:
                return True
            drag, last = stiffness, False
        elif found:
            drag *= 0.6
            last = drag < NO_DRAG * stiffness
        else:
            drag *= 4.0
            if drag > MOST_DRAG * stiffness:
                return False
    return False


@compiled
def _advance(
    cell: Array,
    offset: Array,
    passing: np.ndarray,
    mu: float,
    weight: Array,
    drive_from: Array,
    drive_to: Array,
    trend: Array,
    angles: Array,
    slip: Array,
) -> int:
    """Move `angles` and `slip` on from one drive to another, a step that fails halved: `sliding._settle`.

    `trend` is where to look first, and becomes what the angles did. Returned is in how many steps, 0: failed.
    """
    drive, start = np.empty(len(drive_to)), np.empty(len(angles))
    copy(angles, start)
    done, size, taken = 0, _FINEST, 0
    while done < _FINEST:
        for i in range(len(drive)):
            drive[i] = drive_from[i] + (done + size) / _FINEST * (drive_to[i] - drive_from[i])
        found = _equilibrium(cell, offset, passing, mu, weight, drive, 0.0, trend, angles, slip)
        fill(trend, 0.0)
        if not found and size > 1:
            size //= 2
            continue
        if not found and not _creep(cell, offset, passing, mu, weight, drive, angles, slip):
            return 0
        taken += 1 if found else 2
        done += size
        size = done & -done  # the rest of the part that this one is the first half of
    for k in range(len(trend)):
        trend[k] = angles[k] - start[k]
    return taken


@compiled
def _share_of_last_step(past: Array, before: Array, after: Array, t: int) -> float:
    """Return by which share of the last step the next one goes on: how far its search starts."""
    old, new = 0.0, 0.0
    for j in range(t):
        old += (before[j] - past[j]) ** 2
        new += (before[j] - past[j]) * (after[j] - before[j])
    if not 0.0 < new < 2.0 * old:
        return 0.0  # after a turn most eyelets stick first
    return new / old


@compiled
def march_by_sliding(
    cell: Array,
    offset: Array,
    passing: np.ndarray,
    mu: Array,
    weight: Array,
    drive: Array,
    steps: np.ndarray,
    alike: bool,
    angles: Array,
) -> None:
    """Fill the cells' angles of B robots along r rows of inputs, NaN from the row on where none balances.

    Args:
        cell: shape (B, n, 6).
        offset: x of the tendons' eyelets, the tendon that reaches furthest first, shape (B, t) [m].
        passing: how many tendons pass each cell, shape (n,).
        mu: shape (B,).
        weight: along x and z on each distal face, shape (B, n, 2) [N].
        drive: tensions, force along x and z on the tip, moment about y there, shape (B, r, t + 3).
        steps: in how many equal steps each row is reached from the one before, shape (r,).
        alike: let each search begin where the change of the first robot's angles leads to. A robot that
            jumps, as one under weight may, could so come to another of its equilibria.
        angles: to be filled, shape (B, r, n) [rad].
    """
    batch, rows, n = angles.shape
    t = offset.shape[1]
    now, trend, slip = np.empty(n), np.zeros(n), np.empty((n, t))
    past, before, after = np.empty(t + 3), np.empty(t + 3), np.empty(t + 3)
    firsts = np.zeros((steps.sum() + 1, n))  # changes of the first robot's angles, step by step
    straight = np.zeros(steps.sum() + 1, np.bool_)  # which of these were found at once
    for b in range(batch):
        balanced, place = True, 0
        for row in range(-1, rows):
            # Before the first row, inputs of zero: the robot sags without tension, so without friction,
            # and its eyelets remember nothing of it.
            if row <= 0:
                for k in range(n):
                    if row < 0:
                        now[k] = cell[b, k, REST] * cell[b, k, LENGTH]
                    trend[k] = 0.0
                    fill(slip[k], 0.0)
                fill(past, 0.0)
                fill(before, 0.0)
                fill(after, 0.0)
            count = steps[row] if row >= 0 else 1
            for step in range(count):
                if not balanced:
                    break
                for i in range(t + 3 if row >= 0 else 0):
                    last = drive[b, row - 1, i] if row > 0 else 0.0
                    after[i] = last + (step + 1) / count * (drive[b, row, i] - last)
                if alike and b > 0 and straight[place]:
                    copy(firsts[place], trend)
                else:
                    scale(trend, _share_of_last_step(past, before, after, t))
                copy(before, past)
                taken = _advance(
                    cell[b], offset[b], passing, mu[b], weight[b], before, after, trend, now, slip
                )
                balanced = taken > 0
                copy(after, before)
                if b == 0:
                    straight[place] = taken == 1
                    copy(trend, firsts[place])
                place += 1
            for k in range(n if row >= 0 else 0):
                angles[b, row, k] = now[k] if balanced else math.nan
