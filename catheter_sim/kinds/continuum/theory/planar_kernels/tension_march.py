"""`fkm_exact_arm` for one pair of tendons, compiled: many robots along their inputs.

Cell by cell from base to tip, friction by `slip.tensions_behind`, loads in quasi-Newton rounds. `cell`: see
`columns`. `arm`, shape (2,): of the right and of the left tendon, both positive [m].
"""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.continuum.theory.planar_kernels.columns import LARGEST, LENGTH, REST
from catheter_sim.kinds.continuum.theory.planar_kernels.elastic import elastic_slope
from catheter_sim.kinds.continuum.theory.planar_kernels.loads import find_load_moments
from catheter_sim.kinds.continuum.theory.planar_kernels.tension_cell import bisected, excess
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.vectors import copy

# A secant step is a hundred times more exact than it is long, and so is a round of the loads.
_CELL_STEP_RAD = 3e-10
_LOAD_STEP_RAD = 2e-10
_ROUNDING_RAD = 1e-9  # over a shorter step a quotient of differences is rounding
_MOST_SECANTS = 20
_MOST_LOAD_ROUNDS = 100


@compiled
def _pass(
    cell: Array,
    arm: Array,
    mu: float,
    right: float,
    left: float,
    kept: Array,
    load: Array,
    guess: Array,
    slope: Array,
    angles: Array,
    behind: Array,
) -> bool:
    """Fill angles and tensions, base to tip, under given moments of the load; `exact_arm._pass`.

    `slope`, of what each cell's moment lacks by its angle, is used and renewed.
    """
    a, b, half_mu, angle_before = arm[0], arm[1], 0.5 * mu, 0.0
    for k in range(len(angles)):
        angle, rate, largest = guess[k], slope[k], cell[k, LARGEST]
        kept_right, kept_left, moment = kept[k, 0], kept[k, 1], load[k]
        balanced = False
        value, step, out_right, out_left = 0.0, 0.0, 0.0, 0.0
        for _ in range(_MOST_SECANTS):
            new, out_right, out_left = excess(
                cell, k, a, b, half_mu, right, left, kept_right, kept_left, angle_before, moment, angle
            )
            if abs(step) > _ROUNDING_RAD:
                rate = (value - new) / step
                if not rate > 0.0:
                    break
            value = new
            step = value / rate
            angle += step
            if not abs(angle) < largest:
                break
            if abs(step) < _CELL_STEP_RAD:
                balanced = True
                break
        slope[k] = rate
        if not balanced:
            slope[k] = elastic_slope(cell, k, 0.0)
            angle, out_right, out_left = bisected(
                cell, k, a, b, half_mu, right, left, kept_right, kept_left, angle_before, moment
            )
            if math.isnan(angle):
                return False
        right, left = out_right, out_left
        behind[k, 0], behind[k, 1] = right, left
        angles[k] = angle_before = angle
    return True


@compiled
def _coupled_step(own: Array, outer: Array, change: Array, step: Array) -> None:
    """Solve (diag(own) - outer[max(k, m)]) step = own * change, from the tip to the base and back.

    From the tip on, what the cells beyond k add to its moment is linear in the lean of cell k,
    `p * lean + q`; from the base on the lean is known.
    """
    n = len(own)
    rate, rest = np.empty(n), np.empty(n)
    p, q = 0.0, 0.0
    for k in range(n - 1, -1, -1):
        felt = outer[k] + p
        rate[k] = felt / (own[k] - felt)
        rest[k] = (own[k] * change[k] + q) / (own[k] - felt)
        q += felt * rest[k]
        p += felt * rate[k]
    lean = 0.0
    for k in range(n):
        step[k] = rate[k] * lean + rest[k]
        lean += step[k]


@compiled
def _settle(
    cell: Array,
    arm: Array,
    mu: float,
    weight: Array,
    tension: Array,
    wrench: Array,
    loaded: bool,
    kept: Array,
    slope: Array,
    trend: Array,
    angles: Array,
    work: Array,
    behind: Array,
) -> bool:
    """Move `angles` and `kept` to the equilibrium nearest to them: `exact_arm._settle`."""
    n = len(angles)
    guess, found, load, outer, change = work[0], work[1], work[2], work[3], work[4]
    for k in range(n):
        guess[k] = angles[k] + trend[k]
        load[k] = 0.0
    settled = False
    for _ in range(_MOST_LOAD_ROUNDS):
        if loaded:
            find_load_moments(cell, weight, wrench, guess, load, outer)
        if not _pass(cell, arm, mu, tension[0], tension[1], kept, load, guess, slope, found, behind):
            return False
        settled = True
        if loaded:
            for k in range(n):
                change[k] = found[k] - guess[k]
                settled = settled and abs(change[k]) < _LOAD_STEP_RAD
        if settled:
            break
        _coupled_step(slope, outer, change, found)
        for k in range(n):
            guess[k] += found[k]
            if not abs(guess[k]) < cell[k, LARGEST]:
                return False
    if not settled:
        return False
    for k in range(n):
        trend[k] = found[k] - angles[k]
        angles[k] = found[k]
        kept[k, 0], kept[k, 1] = behind[k, 0], behind[k, 1]
    return True


@compiled
def _share_of_last_step(tension: Array, row: int, steps: np.ndarray) -> float:
    """Return by which share of the last step the first one of `row` goes on: where to look for it."""
    if row <= 0:
        return 0.0
    old, new = 0.0, 0.0
    for j in range(2):
        change = tension[row - 1, j] - (tension[row - 2, j] if row > 1 else 0.0)
        old += change * change
        new += change * (tension[row, j] - tension[row - 1, j])
    if old == 0.0:
        return 0.0
    share = new / old * steps[row - 1] / steps[row]
    return share if 0.0 < share < 2.0 else 0.0  # after a turn most cells stick first


@compiled
def _between(values: Array, row: int, column: int, part: float) -> float:
    """Return a value on the way to `row` from the row before; before the first all are zero."""
    if row < 0:
        return 0.0
    last = values[row - 1, column] if row > 0 else 0.0
    return last + part * (values[row, column] - last)


@compiled
def march_by_tension(
    cell: Array,
    arm: Array,
    mu: Array,
    weight: Array,
    tension: Array,
    wrench: Array,
    steps: np.ndarray,
    alike: bool,
    angles: Array,
) -> None:
    """Fill the cells' angles of B robots along r rows of inputs, NaN from the row on where none balances.

    Args:
        cell: shape (B, n, 6).
        arm: of the right and the left tendon, shape (B, 2) [m].
        mu: shape (B,).
        weight: along x and z on each distal face, shape (B, n, 2) [N].
        tension: right and left, shape (B, r, 2) [N].
        wrench: force along x and z on the tip and moment about y there, shape (B, r, 3) [N], [N m].
        steps: in how many equal steps each row is reached from the one before, shape (r,).
        alike: let each search begin where the change of the first robot's angles leads to, as in
            `sliding_march`.
        angles: to be filled, shape (B, r, n) [rad].
    """
    batch, rows, n = angles.shape
    work, slope, trend, now = np.empty((5, n)), np.empty(n), np.empty(n), np.empty(n)
    kept, behind = np.empty((n, 2)), np.empty((n, 2))
    pull, push = np.empty(2), np.empty(3)
    firsts = np.zeros((steps.sum() + 1, n))  # changes of the first robot's angles, step by step
    for b in range(batch):
        heavy = False
        for k in range(n):
            now[k] = cell[b, k, REST] * cell[b, k, LENGTH]
            slope[k] = elastic_slope(cell[b], k, now[k])
            heavy = heavy or weight[b, k, 0] != 0.0 or weight[b, k, 1] != 0.0
            trend[k] = kept[k, 0] = kept[k, 1] = 0.0
        balanced, place = True, 0
        for row in range(-1 if heavy else 0, rows):  # before the first one, at rest under its weight
            share = _share_of_last_step(tension[b], row, steps)
            for k in range(n):
                trend[k] *= share
            count = steps[row] if row >= 0 else 1
            for step in range(count):
                part = (step + 1) / count
                for j in range(2):
                    pull[j] = _between(tension[b], row, j, part)
                loaded = heavy
                for i in range(3):
                    push[i] = _between(wrench[b], row, i, part)
                    loaded = loaded or push[i] != 0.0
                if alike and b > 0:
                    copy(firsts[place], trend)
                balanced = balanced and _settle(
                    cell[b], arm[b], mu[b], weight[b], pull, push, loaded,
                    kept, slope, trend, now, work, behind,
                )  # fmt: skip
                if b == 0:
                    copy(trend, firsts[place])
                place += 1
            for k in range(n if row >= 0 else 0):
                angles[b, row, k] = now[k] if balanced else math.nan
