"""`fkm_exact_arm` in compiled form for one pair of tendons: many robots along their inputs.

Cell by cell from base to tip, friction by `slip.tensions_behind`, loads in quasi-Newton rounds: the same
as `exact_arm` in plain Python, which the tests hold it to. All compiled code is in this file: the
compiled form is kept on disk and renewed when this file changes, not when another does.

Columns of `cell`, shape (n, 6): see the names below, units as in `PlanarChain`. `arm`, shape (2,): of
the right and of the left tendon, both positive [m].
"""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.compiled import compiled
from catheter_sim.robots.posture import Array

LENGTH, STIFFNESS, CUBIC, QUINTIC, REST, LARGEST = range(6)

# A secant step is a hundred times more exact than it is long, and so is a round of the loads.
_CELL_STEP_RAD = 3e-10
_LOAD_STEP_RAD = 2e-10
_ROUNDING_RAD = 1e-9  # over a shorter step a quotient of differences is rounding
_MOST_SECANTS = 20
_MOST_BISECTIONS = 60
_MOST_LOAD_ROUNDS = 100


@compiled
def _behind(
    right: float, left: float, kept_right: float, kept_left: float, a: float, b: float, capstan: float
) -> tuple[float, float]:
    """Return the tensions behind an eyelet: `slip.tensions_behind` for two tendons with arms a and b."""
    low_right, high_right = right / capstan, right * capstan
    low_left, high_left = left / capstan, left * capstan
    if low_right <= kept_right <= high_right and low_left <= kept_left <= high_left:
        return kept_right, kept_left
    moment = a * kept_right - b * kept_left
    if moment <= a * low_right - b * high_left:
        return low_right, high_left
    if moment >= a * high_right - b * low_left:
        return high_right, low_left
    # Sticking: on the line of this moment, as near to the kept tensions as both intervals allow.
    lowest = max(low_right, (moment + b * low_left) / a)
    highest = min(high_right, (moment + b * high_left) / a)
    stuck = min(max(kept_right, lowest), max(highest, lowest))
    return stuck, (a * stuck - moment) / b


@compiled
def _excess(
    cell: Array,
    k: int,
    a: float,
    b: float,
    half_mu: float,
    right: float,
    left: float,
    kept_right: float,
    kept_left: float,
    angle_before: float,
    load: float,
    angle: float,
) -> tuple[float, float, float]:
    """Return by how much what acts on cell k outweighs its elastic moment [N m], and its tensions [N]."""
    capstan = math.exp(half_mu * abs(angle_before + angle))
    right, left = _behind(right, left, kept_right, kept_left, a, b, capstan)
    half = 0.5 * angle
    bent = angle / cell[k, LENGTH] - cell[k, REST]
    square = bent * bent
    law = 1.0 + square * (cell[k, CUBIC] + square * cell[k, QUINTIC])
    acting = (a * right - b * left) * math.cos(half) + 0.5 * cell[k, LENGTH] * (right + left) * math.sin(half)
    return acting + load - cell[k, STIFFNESS] * bent * law, right, left


@compiled
def _bisected(
    cell: Array,
    k: int,
    a: float,
    b: float,
    half_mu: float,
    right: float,
    left: float,
    kept_right: float,
    kept_left: float,
    angle_before: float,
    load: float,
) -> tuple[float, float, float]:
    """Return the angle at which cell k balances, NaN where none does, and its tensions."""
    high = cell[k, LARGEST] * (1.0 - 1e-9)
    low = angle = -high
    for trial in range(_MOST_BISECTIONS):
        value, out_right, out_left = _excess(
            cell, k, a, b, half_mu, right, left, kept_right, kept_left, angle_before, load, angle
        )
        if trial < 2 and not (value > 0.0 if trial == 0 else value < 0.0):
            return math.nan, out_right, out_left
        if value > 0.0:
            low = angle
        else:
            high = angle
        angle = high if trial == 0 else 0.5 * (low + high)
    return angle, out_right, out_left


@compiled
def _elastic_slope(cell: Array, k: int, angle: float) -> float:
    bent = angle / cell[k, LENGTH] - cell[k, REST]
    square = bent * bent
    law = 1.0 + square * (3.0 * cell[k, CUBIC] + 5.0 * square * cell[k, QUINTIC])
    return cell[k, STIFFNESS] / cell[k, LENGTH] * law


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
            new, out_right, out_left = _excess(
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
            slope[k] = _elastic_slope(cell, k, 0.0)
            angle, out_right, out_left = _bisected(
                cell, k, a, b, half_mu, right, left, kept_right, kept_left, angle_before, moment
            )
            if math.isnan(angle):
                return False
        right, left = out_right, out_left
        behind[k, 0], behind[k, 1] = right, left
        angles[k] = angle_before = angle
    return True


@compiled
def _loads(cell: Array, weight: Array, wrench: Array, angles: Array, load: Array, outer: Array) -> None:
    """Fill the loads' moments about the hinges, and by how much turning one changes those of others.

    `outer[max(k, m)]` is the derivative of the moment at hinge k by the angle of cell m, as in
    `planar.hinge_moment_slopes`. `wrench`: force along x and z on the tip, moment about y.
    """
    n = len(angles)
    hinge = np.empty((n, 2))
    face = np.empty((n, 2))
    x, z, lean = 0.0, 0.0, 0.0
    for k in range(n):
        half = 0.5 * cell[k, LENGTH]
        x += half * math.sin(lean)
        z += half * math.cos(lean)
        hinge[k, 0], hinge[k, 1] = x, z
        lean += angles[k]
        x += half * math.sin(lean)
        z += half * math.cos(lean)
        face[k, 0], face[k, 1] = x, z
    fx, fz = wrench[0], wrench[1]
    about = z * fx - x * fz
    along = x * fx + z * fz
    for k in range(n - 1, -1, -1):
        fx += weight[k, 0]
        fz += weight[k, 1]
        about += face[k, 1] * weight[k, 0] - face[k, 0] * weight[k, 1]
        along += face[k, 0] * weight[k, 0] + face[k, 1] * weight[k, 1]
        load[k] = about - hinge[k, 1] * fx + hinge[k, 0] * fz + wrench[2]
        outer[k] = hinge[k, 0] * fx + hinge[k, 1] * fz - along


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
            _loads(cell, weight, wrench, guess, load, outer)
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
def _going_on(tension: Array, row: int, steps: np.ndarray) -> float:
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
def march(
    cell: Array,
    arm: Array,
    mu: Array,
    weight: Array,
    tension: Array,
    wrench: Array,
    steps: np.ndarray,
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
        angles: to be filled, shape (B, r, n) [rad].
    """
    batch, rows, n = angles.shape
    work, slope, trend, now = np.empty((5, n)), np.empty(n), np.empty(n), np.empty(n)
    kept, behind = np.empty((n, 2)), np.empty((n, 2))
    pull, push = np.empty(2), np.empty(3)
    for b in range(batch):
        heavy = False
        for k in range(n):
            now[k] = cell[b, k, REST] * cell[b, k, LENGTH]
            slope[k] = _elastic_slope(cell[b], k, now[k])
            heavy = heavy or weight[b, k, 0] != 0.0 or weight[b, k, 1] != 0.0
            trend[k] = kept[k, 0] = kept[k, 1] = 0.0
        balanced = True
        for row in range(-1 if heavy else 0, rows):  # before the first one, at rest under its weight
            share = _going_on(tension[b], row, steps)
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
                balanced = balanced and _settle(
                    cell[b], arm[b], mu[b], weight[b], pull, push, loaded,
                    kept, slope, trend, now, work, behind,
                )  # fmt: skip
            for k in range(n if row >= 0 else 0):
                angles[b, row, k] = now[k] if balanced else math.nan
