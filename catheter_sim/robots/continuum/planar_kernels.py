"""Static models of planar robots in compiled form: many robots along their inputs."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.mechanics.compiled import compiled, compiled_in_place
from catheter_sim.mechanics.vectors import copy, fill, scale

# ----------------------------------------------------------------------------------------------------
# How planar robots are handed to the compiled loops, and the numbers that `sliding` shares with them.

# Columns of `cell`, shape (n, 6), units as in `PlanarChain`.
LENGTH, STIFFNESS, CUBIC, QUINTIC, REST, LARGEST = range(6)

# From no slip to full slip the robot beyond an eyelet bends by this much. Against a third of it the
# tip moves by 4 um in tendon-driven loops, by 0.02 mm where a tip force turns the motion back.
PRE_SLIDING_RAD = 1e-4
MOST_CREEP_STEPS = 200
NO_DRAG, MOST_DRAG = 1e-4, 1e4  # of a cell's stiffness


class AntagonisticArm(NamedTuple):
    """A chain of n cells between a right and a left tendon that end at its tip.

    Attributes:
        cell: shape (n, 6), columns above.
        arm: of the right and the left tendon, shape (2,) [m].
        mu: capstan coefficient.
        weight: along x and z on each distal face, shape (n, 2) [N].
    """

    cell: Array
    arm: Array
    mu: float
    weight: Array


class EyeletArm(NamedTuple):
    """A chain of n cells with t tendons in its plane, the one that reaches furthest first.

    Attributes:
        cell: shape (n, 6), columns above.
        offset: x of the tendons' eyelets, shape (t,) [m].
        passing: how many tendons pass each cell, shape (n,).
        mu: capstan coefficient.
        weight: along x and z on each distal face, shape (n, 2) [N].
    """

    cell: Array
    offset: Array
    passing: np.ndarray
    mu: float
    weight: Array


class Slid(NamedTuple):
    """A posture of an `EyeletArm`, with how its tendons rub.

    Attributes:
        angles: of the cells, shape (n,) [rad].
        half: cosine and sine of half of them, shape (n, 2).
        slip: share of the friction in each eyelet, as in `sliding`, shape (n, t).
        pulled: tensions behind the eyelets, shape (n, t) [N].
    """

    angles: Array
    half: Array
    slip: Array
    pulled: Array


# ----------------------------------------------------------------------------------------------------
# The elastic law of a planar cell, compiled.


@compiled_in_place
def hardening(cell: Array, k: int, bent: float) -> float:
    """Return by which factor cell k is stiffer, bent by the curvature `bent` [1/m], than at rest."""
    square = bent * bent
    return 1.0 + square * (cell[k, CUBIC] + square * cell[k, QUINTIC])


@compiled_in_place
def elastic_slope(cell: Array, k: int, angle: float) -> float:
    """Return the slope of the elastic moment of cell k at an angle [N m/rad]."""
    bent = angle / cell[k, LENGTH] - cell[k, REST]
    square = bent * bent
    law = 1.0 + square * (3.0 * cell[k, CUBIC] + 5.0 * square * cell[k, QUINTIC])
    return cell[k, STIFFNESS] / cell[k, LENGTH] * law


# ----------------------------------------------------------------------------------------------------
# What loads do at the hinges of a planar chain, compiled.


@compiled
def find_load_moments(
    cell: Array, weight: Array, wrench: Array, angles: Array, load: Array, outer: Array
) -> None:
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


# ----------------------------------------------------------------------------------------------------
# The balance of one cell under the tensions that an eyelet lets through to it, compiled.

_MOST_BISECTIONS = 60


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
def excess(
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
    acting = (a * right - b * left) * math.cos(half) + 0.5 * cell[k, LENGTH] * (right + left) * math.sin(half)
    return acting + load - cell[k, STIFFNESS] * bent * hardening(cell, k, bent), right, left


@compiled
def bisected(
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
        value, out_right, out_left = excess(
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


# ----------------------------------------------------------------------------------------------------
# `fkm_exact_arm` for one pair of tendons, compiled: many robots along their inputs.
#
# Cell by cell from base to tip, friction by `slip.tensions_behind`, loads in quasi-Newton rounds. `cell`:
# see the columns above. `arm`, shape (2,): of the right and of the left tendon, both positive [m].

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
    robot: AntagonisticArm,
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
    cell, arm, mu, weight = robot
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
        robot = AntagonisticArm(cell[b], arm[b], mu[b], weight[b])
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
                    robot, pull, push, loaded, kept, slope, trend, now, work, behind
                )
                if b == 0:
                    copy(trend, firsts[place])
                place += 1
            for k in range(n if row >= 0 else 0):
                angles[b, row, k] = now[k] if balanced else math.nan


# ----------------------------------------------------------------------------------------------------
# What the balance of each cell lacks where tendons slide through all eyelets, compiled.
#
# Arrays. `cell`: the columns above. `offset`, shape (t,), of tendons in the order of their ends, the one that
# ends at the tip first; `passing`, shape (n,): how many of them pass each cell. `slip`, `pulled`, shape (n,
# t): as in `sliding`, and tensions [N]. `drive`, shape (t + 3,): tensions at the actuators, force along x
# and z on the tip, moment about y there.


@compiled
def evaluate(
    robot: EyeletArm,
    drive: Array,
    loaded: bool,
    drag: float,
    start: Slid,
    now: Slid,
    lack: Array,
    outer: Array,
) -> float:
    """Fill slip, tensions and `half` of `now`, at its angles, and what each cell's balance lacks.

    `start` is where the step began. Returns the norm of `lack` [N m].
    """
    cell, offset, passing, mu, weight = robot
    angles, half, slip, pulled = now
    n, t = slip.shape
    drawn_in, tension = np.zeros(t), np.empty(t)
    arm = 1e-9
    for j in range(t):
        arm = max(arm, abs(offset[j]))
        tension[j] = drive[j]
    pre_sliding = PRE_SLIDING_RAD * arm
    for k in range(n - 1, -1, -1):
        cosine, sine = math.cos(0.5 * angles[k]), math.sin(0.5 * angles[k])
        half[k, 0], half[k, 1] = cosine, sine
        shorter = cell[k, LENGTH] * (start.half[k, 0] - cosine)
        turned = 2.0 * (sine - start.half[k, 1])
        for j in range(passing[k]):
            drawn_in[j] += shorter + offset[j] * turned
            slip[k, j] = min(max(start.slip[k, j] + drawn_in[j] / pre_sliding, -1.0), 1.0)
    if loaded:
        find_load_moments(cell, weight, drive[t:], angles, lack, outer)
    angle_before, squares = 0.0, 0.0
    for k in range(n):
        angle = angles[k]
        lost = 0.5 * mu * abs(angle_before + angle)
        angle_before = angle
        drop = math.exp(-lost)
        rise = 1.0 / drop
        across, along = 0.0, 0.0
        for j in range(passing[k]):
            state = slip[k, j]
            if state == 1.0:
                tension[j] *= drop
            elif state == -1.0:
                tension[j] *= rise
            else:
                tension[j] *= math.exp(-state * lost)
            pulled[k, j] = tension[j]
            across += tension[j] * offset[j]
            along += tension[j]
        bent = angle / cell[k, LENGTH] - cell[k, REST]
        value = across * half[k, 0] + 0.5 * cell[k, LENGTH] * along * half[k, 1]
        value -= cell[k, STIFFNESS] * bent * hardening(cell, k, bent) + drag * (angle - start.angles[k])
        lack[k] = lack[k] + value if loaded else value
        squares += lack[k] * lack[k]
    return math.sqrt(squares)


# ----------------------------------------------------------------------------------------------------
# Newton's step of `fkm_sliding`, compiled: solved from the tip to the base and back.
#
# Arrays as above.


@compiled
def _stuck_losses(
    stiff: float,
    m: int,
    is_stuck: np.ndarray,
    stuck: np.ndarray,
    arm: Array,
    beyond: Array,
    alpha: Array,
    row: Array,
    matrix: Array,
) -> None:
    """Find the losses, alpha u + row, of the tendons that stick, from how far these are drawn in.

    A stuck tendon's loss grows by `stiff` for each unit drawn in, arm u + E, and E depends on the losses.
    """
    width = row.shape[1]
    lean, one = width - 2, width - 1
    count = 0
    for j in range(m):
        if is_stuck[j]:
            stuck[count] = j
            count += 1
    for p in range(count):
        s = stuck[p]
        for c in range(width):
            row[s, c] = 0.0
        row[s, 0] = alpha[s]
        row[s, 1 + s] = 1.0
        alpha[s] += stiff * (arm[s] + beyond[s, 0] + beyond[s, lean])
        row[s, lean] += stiff * beyond[s, lean]
        row[s, one] += stiff * beyond[s, one]
        for i in range(m):
            if not is_stuck[i]:
                alpha[s] += stiff * beyond[s, 1 + i] * alpha[i]
                row[s, 0] += stiff * beyond[s, 1 + i] * alpha[i]
                row[s, 1 + i] += stiff * beyond[s, 1 + i]
        for q in range(count):
            matrix[p, q] = (1.0 if p == q else 0.0) - stiff * beyond[s, 1 + stuck[q]]
    for p in range(count):
        for q in range(p + 1, count):
            share = matrix[q, p] / matrix[p, p]
            for c in range(p + 1, count):
                matrix[q, c] -= share * matrix[p, c]
            alpha[stuck[q]] -= share * alpha[stuck[p]]
            for c in range(width):
                row[stuck[q], c] -= share * row[stuck[p], c]
    for p in range(count - 1, -1, -1):
        s = stuck[p]
        for q in range(p + 1, count):
            alpha[s] -= matrix[p, q] * alpha[stuck[q]]
            for c in range(width):
                row[s, c] -= matrix[p, q] * row[stuck[q], c]
        alpha[s] /= matrix[p, p]
        for c in range(width):
            row[s, c] /= matrix[p, p]


@compiled
def newton_step(
    robot: EyeletArm, loaded: bool, drag: float, now: Slid, lack: Array, outer: Array, step: Array
) -> None:
    """Fill the change of the angles that brings `lack` to zero, to first order; NaN where none does.

    Unknown in cell k are the change u of its angle and, of each tendon, the change of what friction has
    taken so far (the exponent). They feel the cells before through those of cell k - 1 and through the
    lean, the sum of u so far. They feel the cells beyond through two kinds of sums: by how much each tendon
    is drawn in over the eyelet (E, where it sticks), and what loads add (G). From the tip on these sums
    are linear in what is unknown in the cell before, `beyond`. So the unknowns of a cell are linear in
    those of the cell before, `bend_by` and `lost_by`, and from the base on all are known. A tendon that
    slips loses `alpha` times the change of both adjoining angles, which needs no row of its own.

    Columns of `beyond`, `bend_by`, `lost_by`: u, each tendon's loss, lean, 1. Rows of `beyond`: E, then G.
    """
    cell, offset, passing, mu, _ = robot
    angles, half, slip, pulled = now
    n, t = slip.shape
    width, lean, one = t + 3, t + 1, t + 2
    beyond, renewed = np.zeros((t + 1, width)), np.zeros((t + 1, width))
    bend_by, lost_by = np.zeros((n, width)), np.empty((n, t, width))
    alpha, row, arm, weigh = np.empty((n, t)), np.empty((t, width)), np.empty(t), np.empty(t)
    is_stuck, stuck, matrix = np.zeros((n, t), np.bool_), np.empty(t, np.intp), np.empty((t, t))
    first = np.empty(t, np.intp)  # cell where each tendon sticks first
    widest = 1e-9
    for j in range(t):
        first[j] = n
        widest = max(widest, abs(offset[j]))
        for k in range(n - 1, -1, -1):
            if j < passing[k] and abs(slip[k, j]) < 1.0:
                is_stuck[k, j] = True
                first[j] = k
    pre_sliding = PRE_SLIDING_RAD * widest
    for k in range(n - 1, -1, -1):
        m, length = passing[k], cell[k, LENGTH]
        turn = 0.5 * (angles[k] + (angles[k - 1] if k > 0 else 0.0))
        side = 0.5 if turn > 0.0 else (-0.5 if turn < 0.0 else 0.0)
        own = elastic_slope(cell, k, angles[k]) + drag
        sticks = False
        for j in range(m):
            arm[j] = offset[j] * half[k, 0] + 0.5 * length * half[k, 1]
            weigh[j] = mu * arm[j] * pulled[k, j]
            own -= pulled[k, j] * (0.25 * length * half[k, 0] - 0.5 * offset[j] * half[k, 1])
            alpha[k, j] = slip[k, j] * side
            sticks = sticks or is_stuck[k, j]
        if sticks:
            _stuck_losses(abs(turn) / pre_sliding, m, is_stuck[k], stuck, arm, beyond, alpha[k], row, matrix)
        bend = bend_by[k]
        bend[one] = lack[k]
        if loaded:
            own -= outer[k] + beyond[t, 0] + beyond[t, lean]
            bend[lean] += outer[k] + beyond[t, lean]
            bend[one] += beyond[t, one]
        for j in range(m):
            felt = weigh[j] - beyond[t, 1 + j]
            own += felt * alpha[k, j]
            if is_stuck[k, j]:
                for c in range(width):
                    bend[c] -= felt * row[j, c]
            else:
                bend[0] -= felt * alpha[k, j]
                bend[1 + j] -= felt
        for c in range(width):
            bend[c] /= own
        for j in range(m):
            if is_stuck[k, j]:
                for c in range(width):
                    row[j, c] += alpha[k, j] * bend[c]
                    lost_by[k, j, c] = row[j, c]
        for i in range(t + 1):
            if (i < t and (i >= m or first[i] >= k)) or (i == t and not loaded):
                continue  # nobody before this cell asks for it
            share = beyond[i, 0] + beyond[i, lean] + (arm[i] if i < t else outer[k])
            for c in range(width):
                renewed[i, c] = 0.0
            for j in range(m):
                if is_stuck[k, j]:
                    for c in range(width):
                        renewed[i, c] += beyond[i, 1 + j] * row[j, c]
                else:
                    renewed[i, 0] += beyond[i, 1 + j] * alpha[k, j]
                    renewed[i, 1 + j] += beyond[i, 1 + j]
                    share += beyond[i, 1 + j] * alpha[k, j]
            for c in range(width):
                renewed[i, c] += share * bend[c]
            renewed[i, lean] += beyond[i, lean]
            renewed[i, one] += beyond[i, one]
        beyond, renewed = renewed, beyond
    known, following = np.zeros(width), np.zeros(width)
    known[one] = following[one] = 1.0
    for k in range(n):
        u = 0.0
        for c in range(width):
            u += bend_by[k, c] * known[c]
        for j in range(passing[k]):
            if is_stuck[k, j]:
                value = 0.0
                for c in range(width):
                    value += lost_by[k, j, c] * known[c]
            else:
                value = known[1 + j] + alpha[k, j] * (known[0] + u)
            following[1 + j] = value
        following[0] = step[k] = u
        following[lean] = known[lean] + u
        known, following = following, known


# ----------------------------------------------------------------------------------------------------
# `fkm_sliding`, compiled: many robots along their inputs.
#
# The same steps and Newton's method as in `sliding` in plain Python; arrays as above.

_TOLERANCE_RAD = 2e-10
_MOST_ROUNDS = 40
_MOST_SHARES = 15
_FINEST = 256  # parts into which a step that fails is cut


@compiled
def _equilibrium(
    robot: EyeletArm, drive: Array, drag: float, trend: Array, angles: Array, slip: Array
) -> bool:
    """Move `angles` and `slip` to the equilibrium under `drive`; return whether one was found.

    `sliding._newton`, but that the search starts `trend` further on.
    """
    cell, weight = robot.cell, robot.weight
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
    start = Slid(angles, start_half, slip, pulled)
    tried, reached = Slid(trial, half, there, pulled), Slid(now, half, there, pulled)
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
                found = evaluate(robot, drive, loaded, drag, start, tried, lack, outer)
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
            newton_step(robot, loaded, drag, reached, lack, outer, step)
    return False


@compiled
def _creep(robot: EyeletArm, drive: Array, angles: Array, slip: Array) -> bool:
    """Move to the equilibrium that is reached slowly where there is none close by: `sliding._creep`."""
    cell, still = robot.cell, np.zeros(len(angles))
    stiffness = math.inf
    for k in range(len(angles)):
        stiffness = min(stiffness, cell[k, STIFFNESS] / cell[k, LENGTH])
    drag, last = stiffness, False
    for _ in range(2 * MOST_CREEP_STEPS):
        found = _equilibrium(robot, drive, 0.0 if last else drag, still, angles, slip)
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
    robot: EyeletArm, drive_from: Array, drive_to: Array, trend: Array, angles: Array, slip: Array
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
        found = _equilibrium(robot, drive, 0.0, trend, angles, slip)
        fill(trend, 0.0)
        if not found and size > 1:
            size //= 2
            continue
        if not found and not _creep(robot, drive, angles, slip):
            return 0
        taken += 1 if found else 2
        done += size
        size = done & -done  # the rest of the part that this one is the first half of
    for k in range(len(trend)):
        trend[k] = angles[k] - start[k]
    return taken


@compiled
def _share_of_last_slide(past: Array, before: Array, after: Array, t: int) -> float:
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
        robot = EyeletArm(cell[b], offset[b], passing, mu[b], weight[b])
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
                    scale(trend, _share_of_last_slide(past, before, after, t))
                copy(before, past)
                taken = _advance(robot, before, after, trend, now, slip)
                balanced = taken > 0
                copy(after, before)
                if b == 0:
                    straight[place] = taken == 1
                    copy(trend, firsts[place])
                place += 1
            for k in range(n if row >= 0 else 0):
                angles[b, row, k] = now[k] if balanced else math.nan
