"""The capstan law, compiled: the tensions that dry friction allows in tendons that run through holes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from catheter_sim.arrays import Array, Index, Places
from catheter_sim.mechanics.compiled import compiled, compiled_in_place
from catheter_sim.mechanics.vectors import solve_definite

# ----------------------------------------------------------------------------------------------------
# By which factor a tension may change over a hole: the capstan's exponential.

SMALL = 0.1  # of x in exp(x): the first term that its series leaves out, x^10 / 10!, is below 3e-17


@compiled_in_place
def capstan_factors(mu: float, turn: Array, count: int, factor: Array, shrink: Array) -> None:
    """Write exp(mu turn) and one over it into `factor` and `shrink`, shape (n,), of the first `count` turns.

    Where all are small, as nearly always, by the even and odd parts of the series, several at once.
    """
    large = 0
    for k in range(count):
        large += mu * turn[k] > SMALL
    if large > 0:
        for k in range(count):
            factor[k] = math.exp(mu * turn[k])
            shrink[k] = 1.0 / factor[k]
        return
    for k in range(count):
        x = mu * turn[k]
        s = x * x
        even = 1.0 + s * (1 / 2 + s * (1 / 24 + s * (1 / 720 + s / 40320)))
        odd = x * (1.0 + s * (1 / 6 + s * (1 / 120 + s * (1 / 5040 + s / 362880))))
        factor[k], shrink[k] = even + odd, even - odd


# ----------------------------------------------------------------------------------------------------
# The tensions of one tendon's spans under the capstan law, compiled.


@compiled_in_place
def span_tensions(
    entering: float,
    drive: float,
    drawn: float,
    factor: Array,
    shrink: Array,
    rate: Array,
    response: Array,
    count: int,
    tension: Array,
    found: Array,
    slip: Index,
    scratch: Array,
) -> float:
    """Find the tensions of one tendon with which it sticks where it can and slips where it must.

    The tensions minimise sum_k response_k (T_k - old_k)^2 / 2 - rate_k (T_k - old_k), which is zero
    slope where no span changes its length, within T_k - T_(k-1) in [low_k, high_k], what friction
    allows at hole k. The multiplier of that bound is the sliding speed at hole k. Solved exactly by
    dynamic programming from the tip: the slope of the cost-to-go is a rising, piecewise linear
    function of the tension before the hole, kept as its knots. They lie on two stacks, left and right
    of the flat piece that friction leaves at each hole. Each stack shifts as a whole, so that the cost
    grows with the number of spans and not with its square.

    Args:
        entering: tension at the actuator now; below zero where a driven tendon is slack [N].
        drive: what the actuator's tension grows by per unit of the tendon's rate of lengthening in
            one step [N s/m]; 0 where the tension is given.
        drawn: the actuator's tension at the end of the step as far as it is known [N].
        factor, shrink: exp(mu turn) at each hole and one over it, shape (n,).
        rate: length rates of the spans under the old tensions [m/s], shape (n,).
        response: fall of a span's length rate per unit of its own tension, above zero [m/s/N], shape (n,).
        count: number of spans of this tendon.
        tension: old tensions, shape (n,) [N].
        found: out: new ones, shape (n,) [N].
        slip: out: 1 where the tension rises over a hole by all of `factor`, -1 where it falls by it, 0
            where the tendon sticks, shape (n,).
        scratch: workspace, shape (3, 2 n) or wider.

    Returns:
        The actuator's tension at the end of the step [N].
    """
    # Knots, and by how much the slope's own slope changes on the way outward there. The left stack's top
    # is at `left - 1`, the right one's, which grows downward, at `right`.
    knots, steps, goal = scratch[0], scratch[1], scratch[2]
    left, right = 0, knots.shape[0]
    left_shift, right_shift = 0.0, 0.0  # of the whole stacks
    for k in range(count + 1):
        span = count - 1 - k
        # the slope of the cost-to-go, slope * T + offset, on what was the flat piece
        if span >= 0:
            slope = response[span]
            offset = -(slope * tension[span] + rate[span])
        elif drive > 0.0:
            slope, offset = 1.0 / drive, -entering / drive
        else:
            break
        # where it crosses zero: the tension that this span, at last the actuator, would like
        while left > 0:
            knot = knots[left - 1] + left_shift
            if slope * knot + offset <= 0.0:
                break
            left -= 1
            right -= 1
            step = steps[left]
            slope += step
            offset -= step * knot
            knots[right], steps[right] = knot - right_shift, -step
        while right < knots.shape[0]:
            knot = knots[right] + right_shift
            if slope * knot + offset >= 0.0:
                break
            step = steps[right]
            slope += step
            offset -= step * knot
            knots[left], steps[left] = knot - left_shift, -step
            left += 1
            right += 1
        wish = -offset / slope
        if span < 0:
            entering = wish
            break
        goal[span] = wish
        # as a function of the tension before hole k: left of the wish shifted by the upper bound,
        # flat between, right of it shifted by the lower bound
        right -= 1
        knots[left], steps[left] = wish - left_shift, slope
        knots[right], steps[right] = wish - right_shift, slope
        left += 1
        before = tension[span - 1] if span > 0 else drawn
        left_shift -= before * factor[span] - before
        right_shift -= before * shrink[span] - before
    entering = max(entering, 0.0)
    before = entering
    for k in range(count):
        low, high = before * shrink[k], before * factor[k]
        slip[k] = (goal[k] >= high) - (goal[k] <= low)
        before = min(max(goal[k], low), high)
        found[k] = before
    return entering


@compiled_in_place
def slip_as_before(
    entering: float,
    drive: float,
    factor: Array,
    shrink: Array,
    arm: Array,
    speed: Array,
    response: Array,
    count: int,
    tension: Array,
    found: Array,
    slip: Index,
    scratch: Array,
) -> float:
    """Find one tendon's tensions as `span_tensions` does, if it slips where `slip` says.

    Between two holes where it sticks, one tension then fixes all, and its size is that for which nothing
    slides over the first of them. Much faster than to find out where a tendon slips, and from pass to
    pass, and step to step, that seldom changes. Here what friction allows follows the new tensions, there
    the old ones: the passes end at the same.

    Args: as of `span_tensions`, but `slip` is only read, and `arm` times `speed`, shape (n,) each, is `rate`.

    Returns:
        The actuator's tension at the end of the step [N]; below zero where it slips elsewhere or the other
        way, and then `found` is of no use.
    """
    wish, weight = scratch[0], scratch[1]
    offset, slope = 0.0, 0.0  # sliding speed at hole k: wish_k - weight_k T_k
    for k in range(count - 1, -1, -1):
        offset += arm[k] * speed[k] + response[k] * tension[k]
        slope += response[k]
        wish[k], weight[k] = offset, slope
        if slip[k] == 0:
            offset, slope = 0.0, 0.0
        else:
            slope *= factor[k] if slip[k] > 0 else shrink[k]
    before = entering
    if drive > 0.0:
        before = (entering / drive + offset) / (1.0 / drive + slope)
    if before <= 0.0:
        return -1.0
    entering = before
    for k in range(count):
        if slip[k] == 0:
            goal = wish[k] / weight[k]
            if goal > before * factor[k] or goal < before * shrink[k]:
                return -1.0
            before = goal
        else:
            before *= factor[k] if slip[k] > 0 else shrink[k]
            if (wish[k] - weight[k] * before) * slip[k] < 0.0 and factor[k] > 1.0:
                return -1.0
        found[k] = before
    return entering


# ----------------------------------------------------------------------------------------------------
# The numbers of a robot with t tendons of n spans, e nonzeros of their Jacobian and nv degrees of freedom.
#
# A call of a compiled function costs 0.1 us for each array and 0.6 us for each array in a tuple, a whole step
# of a small robot 30 us: so what belongs to a robot lies in one block, and is cut inside.

NUMBERS = 4  # at the block's head: friction coefficient, most passes, tolerance, 1 where `inverse` holds


class Room(NamedTuple):
    """A robot's block, cut.

    Attributes:
        drive: growth of the actuators' tensions per unit of the tendons' rate of lengthening in one step; 0
            where the tension is given, shape (t,) [N s/m].
        yielding: timestep over effective implicit inertia of each degree of freedom, shape (nv,).
        factor, shrink, response, moved, last: workspace, shape (t, n).
        arm, gain: workspace: d(length)/d(q), and change of velocity in a step per unit of tension, (e,).
        shared: workspace, shape (2 t + 4 + nv, t).
        scratch: workspace, shape (10, 2 max(n, nv, t)).
        inverse: timestep times the inverse of the inertia that the integrator uses, where it is more than
            each degree of freedom's own, shape (nv, nv).
    """

    drive: Array
    yielding: Array
    factor: Array
    shrink: Array
    response: Array
    moved: Array
    last: Array
    arm: Array
    gain: Array
    shared: Array
    scratch: Array
    inverse: Array


def new_block(numbers: tuple[float, float, float], t: int, n: int, e: int, nv: int) -> Array:
    """Return a robot's block; numbers: friction coefficient, most passes, share of change that ends them."""
    size = nv + t + 5 * t * n + 2 * e + (2 * t + 4 + nv) * t + 20 * max(n, nv, t) + nv * nv
    return np.array([*numbers, 0.0, *np.zeros(size)])


@compiled_in_place
def cut(block: Array, t: int, n: int, e: int, nv: int) -> Room:
    """Cut a block made by `new_block`."""
    first = NUMBERS + nv + t
    holes = block[first : first + 5 * t * n].reshape(5, t, n)
    first += 5 * t * n
    pulls = block[first : first + 2 * e].reshape(2, e)
    first += 2 * e
    shared = block[first : first + (2 * t + 4 + nv) * t].reshape(2 * t + 4 + nv, t)
    first += (2 * t + 4 + nv) * t
    width = 2 * max(n, nv, t)
    scratch = block[first : first + 10 * width].reshape(10, width)
    first += 10 * width
    return Room(
        block[NUMBERS : NUMBERS + t],
        block[NUMBERS + t : NUMBERS + t + nv],
        holes[0],
        holes[1],
        holes[2],
        holes[3],
        holes[4],
        pulls[0],
        pulls[1],
        shared,
        scratch,
        block[first : first + nv * nv].reshape(nv, nv),
    )


class Tendons(NamedTuple):
    """Where tendons pull.

    Attributes:
        ends: number of spans of each, 0 of one that is left as it is (`busy_spans`), shape (t,).
        row_start: first entry of each in what follows, shape (t + 1,).
        entry, dof, span: for each nonzero of the tendons' Jacobian its place in MuJoCo's `ten_J`, its degree
            of freedom, and the span whose length it changes, shape (e,).
        lines: the first degree of freedom of a tendon of which each changes the length of one span, one after
            another as the spans are; -1 of other tendons, shape (t,).
    """

    ends: Index
    row_start: Places
    entry: Places
    dof: Places
    span: Places
    lines: Index


# ----------------------------------------------------------------------------------------------------
# Tensions of a robot in motion, compiled: joints that all carry the same masses, so that none yields alone.
#
# A pass of `solve_tensions` lets each degree of freedom yield by its own implicit inertia, as if the others
# stood still. That bounds how far all of them together yield: a pass is a step down the same convex problem
# whose derivative, the velocities at the end of the step, is here found with the whole inertia. Such steps
# are short where many joints move as one; what the last one changed is added again before each (Nesterov
# 1983, as in Beck and Teboulle 2009, Eqs 4.1-4.3), and forgotten where it points up (O'Donoghue and Candes
# 2015).


@compiled_in_place
def go_on(momentum: float, ends: Index, moved: Array, last: Array, tension: Array) -> float:
    """Let the tensions (t, n) go on as the last pass `moved` them; return the next momentum, 1 at first.

    `last`: in: tensions after the pass before it; out: after the last one, shape (t, n) [N].
    """
    up = 0.0
    for j in range(ends.shape[0]):
        for k in range(ends[j]):
            up -= moved[j, k] * (tension[j, k] - last[j, k])
    if up > 0.0:
        momentum = 1.0
    following = 0.5 * (1.0 + np.sqrt(1.0 + 4.0 * momentum * momentum))
    share = (momentum - 1.0) / following
    for j in range(ends.shape[0]):
        for k in range(ends[j]):
            now = tension[j, k]
            tension[j, k] = max(now + share * (now - last[j, k]), 0.0)
            last[j, k] = now
    return following


@compiled_in_place
def look_ahead(velocity: Array, tendons: Tendons, room: Room, tension: Array, ahead: Array) -> None:
    """Write the velocities at the end of the step under `tension` into `ahead`, shape (nv,)."""
    free, torque = room.scratch[8], room.scratch[9]
    count = velocity.shape[0]
    for i in range(count):
        torque[i] = free[i]
    for j in range(tendons.ends.shape[0]):
        if tendons.ends[j] > 0:
            for place in range(tendons.row_start[j], tendons.row_start[j + 1]):
                torque[tendons.dof[place]] -= room.arm[place] * tension[j, tendons.span[place]]
    for i in range(count):
        total = 0.0
        for j in range(count):
            total += room.inverse[i, j] * torque[j]
        ahead[i] = velocity[i] + total


@compiled
def step_over_inertia(
    entries: Array,
    row_start: Index,
    row_count: Index,
    column: Index,
    own: Array,
    timestep: float,
) -> Array:
    """Return the timestep times the inverse of the whole implicit inertia, shape (nv, nv).

    `entries` are MuJoCo's, of the lower triangle row by row; `own` is what damping and springs add, (nv,).
    """
    count = own.shape[0]
    inertia = np.zeros((count, count))
    for i in range(count):
        for place in range(row_start[i], row_start[i] + row_count[i]):
            inertia[i, column[place]] = entries[place]
            inertia[column[place], i] = entries[place]
    for i in range(count):
        inertia[i, i] += own[i]
    inertia[:] = timestep * np.linalg.inv(inertia)
    return inertia


# ----------------------------------------------------------------------------------------------------
# What saves passes over tendons that share joints, compiled: where they start and how they are cut short.


@compiled_in_place
def start_from_last_change(entering: Array, ends: Index, tension: Array, past: Array) -> None:
    """Let all tensions change as in the last step, by the share by which the actuators' tensions do so again.

    The passes start there; where they end does not depend on it. Where the actuators hold, nothing changes.

    Args:
        entering: tensions at the actuators now, shape (t,) [N].
        ends: as of `Tendons`.
        tension: in and out: shape (t, n) or wider [N].
        past: in: the last step's changes of tension, and in the last two columns its `entering` and the
            change of that. Out: the last step's tensions, and these two of this step, shape (t, n + 2) [N].
    """
    n = past.shape[1] - 2
    along, square = 0.0, 0.0
    for j in range(ends.shape[0]):
        now, before = entering[j] - past[j, n], past[j, n + 1]
        along += now * before
        square += before * before
        past[j, n], past[j, n + 1] = entering[j], now
    share = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
    for j in range(ends.shape[0]):
        for k in range(n):
            old = tension[j, k]
            if k < ends[j]:
                tension[j, k] = max(old + share * past[j, k], 0.0)
            past[j, k] = old


@compiled_in_place
def extrapolate_passes(times: float, tendons: Tendons, room: Room, tension: Array, ahead: Array) -> None:
    """Change all tensions by `times` what the last pass changed, as further passes of its kind would.

    No tension falls below zero. Where friction does not allow the new tensions, the next pass mends them.
    """
    moved = room.moved
    for j in range(tendons.ends.shape[0]):
        for k in range(tendons.ends[j]):
            moved[j, k] = max(times * moved[j, k], -tension[j, k])
            tension[j, k] += moved[j, k]
        if tendons.ends[j] > 0:
            for place in range(tendons.row_start[j], tendons.row_start[j + 1]):
                ahead[tendons.dof[place]] -= room.gain[place] * moved[j, tendons.span[place]]


# ----------------------------------------------------------------------------------------------------
# Tendons on drives that give way: how their tensions rise and fall together, compiled.


@compiled_in_place
def couple_driven(tendons: Tendons, room: Room) -> int:
    """Write how fast driven tendons shorten where the tension of one of them rises alike in all its spans.

    Into rows 0 to t of `room.shared`: fall of the length rate of tendon j per unit of the tension of tendon
    l, [j, l], and on the diagonal 1 / drive besides. Returns how many tendons are driven.
    """
    row_start, dof, drive, arm, gain, shared = (
        tendons.row_start,
        tendons.dof,
        room.drive,
        room.arm,
        room.gain,
        room.shared,
    )
    count = tendons.ends.shape[0]
    driven, arms = 0, shared[2 * count + 4 :]
    for j in range(count):
        driven += drive[j] > 0.0
    if driven < 2:
        return driven
    arms[:] = 0.0
    for j in range(count):
        if drive[j] > 0.0:
            for place in range(row_start[j], row_start[j + 1]):
                arms[dof[place], j] += arm[place]
    for j in range(count):
        if drive[j] > 0.0:
            shared[j] = 0.0
            for place in range(row_start[j], row_start[j + 1]):
                for other in range(count):
                    shared[j, other] += gain[place] * arms[dof[place], other]
            shared[j, j] += 1.0 / drive[j]
    return driven


@compiled_in_place
def raise_together(
    entering: Array, tendons: Tendons, room: Room, reached: Array, tension: Array, ahead: Array
) -> float:
    """Raise each driven tendon's tensions alike in all spans by what is best for all of them at once.

    The differences at the holes stay as they are. Without this, tendons that pull against one another on
    stiff drives would come down together by next to nothing in a pass, since each by itself only holds the
    other's pull. No tension falls below zero (a quadratic programme with bounds, by active sets).

    Args:
        entering: tensions at the actuators now, shape (t,) [N].
        tendons, room: the robot's, with what `couple_driven` left.
        reached: in and out: tensions at the actuators at the end of the step, shape (t,) [N].
        tension: in and out: shape (t, n) or wider [N].
        ahead: in and out: velocities at the end of the step, shape (nv,).

    Returns:
        The largest change of a tension [N].
    """
    ends, row_start, dof = tendons.ends, tendons.row_start, tendons.dof
    drive, shared = room.drive, room.shared
    count = ends.shape[0]
    matrix, slope = shared[count : 2 * count], shared[2 * count]
    goal, shift, held = shared[2 * count + 1], shared[2 * count + 2], shared[2 * count + 3]
    for j in range(count):
        slope[j], shift[j], held[j] = 0.0, 0.0, 1.0
        if drive[j] > 0.0:
            held[j] = 0.0
            slope[j] = (reached[j] - entering[j]) / drive[j]
            for place in range(row_start[j], row_start[j + 1]):
                slope[j] -= room.arm[place] * ahead[dof[place]]
    for _ in range(4 * count):
        for j in range(count):
            for other in range(count):
                matrix[j, other] = shared[j, other] if held[j] == 0.0 and drive[other] > 0.0 else 0.0
            goal[j] = -slope[j]
            if held[j] > 0.0:
                matrix[j, j], goal[j] = 1.0, shift[j]
        solve_definite(matrix, goal)
        part, first = 1.0, -1  # of the way to the goal, up to where the first tension is zero
        for j in range(count):
            if held[j] == 0.0 and goal[j] < -reached[j]:
                share = (-reached[j] - shift[j]) / (goal[j] - shift[j])
                if share < part or first < 0:
                    part, first = share, j
        for j in range(count):
            shift[j] += part * (goal[j] - shift[j])
        if first >= 0:
            shift[first], held[first] = -reached[first], 1.0
            continue
        strongest = 0.0
        for j in range(count):  # which of those that are held would rather rise
            if drive[j] > 0.0 and held[j] > 0.0:
                push = slope[j]
                for other in range(count):
                    if drive[other] > 0.0:
                        push += shared[j, other] * shift[other]
                if push < strongest:
                    strongest, first = push, j
        if first < 0:
            break
        held[first] = 0.0
    change = 0.0
    for j in range(count):
        if drive[j] == 0.0:
            continue
        reached[j] = max(reached[j] + shift[j], 0.0)
        for place in range(row_start[j], row_start[j + 1]):
            risen = max(shift[j], -tension[j, tendons.span[place]])
            ahead[dof[place]] -= room.gain[place] * risen
        for k in range(ends[j]):
            risen = max(shift[j], -tension[j, k])
            tension[j, k] += risen
            change = max(change, abs(risen))
    return change


# ----------------------------------------------------------------------------------------------------
# Tensions of tendons that share joints under the capstan law, compiled: passes over one after another.

# Passes over the tendons come nearer to the end by much the same share each: where the last two agree on it,
# the rest of the way is taken at once. A larger share than the first is not believed; for a smaller one than
# the second a further pass costs less.
LARGEST_SHARE, LEAST_SHARE = 0.95, 0.1
# Of a span whose length no joint changes, as of a rod that crosses a joint on the joint's own line: its
# tension does nothing and keeps its value. Small against that of any span with an arm (1e-6 to 1e-3).
LEAST_RESPONSE = 1e-12  # m/s/N


@compiled_in_place
def busy_spans(block: Array, history: Array, counts: Index, entering: Array) -> None:
    """Write each tendon's number of spans into counts[1], 0 where it is slack before and after.

    Args: as of `solve_tensions`.
    """
    drive, tension, ends, busy = block[NUMBERS:], history[0], counts[0], counts[1]
    for j in range(ends.shape[0]):
        busy[j] = ends[j]
        if entering[j] > 0.0 or drive[j] > 0.0:
            continue
        busy[j] = 0
        for k in range(ends[j]):
            if tension[j, k] > 0.0:
                busy[j] = ends[j]
                break


@compiled_in_place
def solve_tensions(
    block: Array,
    history: Array,
    counts: Index,
    places: Places,
    ten_J: Array,
    entering: Array,
    turn: Array,
    velocity: Array,
    passive: Array,
    bias: Array,
    constraint: Array,
    applied: Array,
) -> None:
    """Update all tendons' tensions, and apply what they pull beyond the actuators' tensions.

    Args:
        block: the robot's, of `new_block`.
        history: in and out: tensions [N]; where the tendons slipped last, as of `span_tensions`; what
            `start_from_last_change` remembers [N]; shape (3, t, n + 2).
        counts: of each tendon `ends`, what `busy_spans` leaves of it, and `lines`, shape (3, t).
        places: `row_start`, `entry`, `dof` and `span` one after another, shape (t + 1 + 3 e,).
        ten_J: MuJoCo's sparse tendon Jacobian.
        entering: tensions at the actuators now; below zero where a driven tendon is slack, shape (t,) [N].
        turn: shape (t, n) [rad].
        velocity: velocities now, shape (nv,).
        passive, bias, constraint: MuJoCo's generalised forces (`bias` is subtracted), shape (nv,).
        applied: in: all other generalised forces but the tendons'; out: with what the tensions pull
            beyond those that the actuators will have at the end of the step (the integrator adds
            these), shape (nv,).
    """
    count, n = turn.shape
    e = (places.shape[0] - count - 1) // 3
    first = count + 1
    tendons = Tendons(
        counts[1],
        places[:first],
        places[first : first + e],
        places[first + e : first + 2 * e],
        places[first + 2 * e :],
        counts[2],
    )
    ends, row_start, dof, span = tendons.ends, tendons.row_start, tendons.dof, tendons.span
    room = cut(block, count, n, e, velocity.shape[0])
    mu, sweeps, tolerance, whole = block[0], int(block[1]), block[2], block[3] > 0.0
    tension, slip, past = history[0], history[1], history[2]
    drive, response, moved, arm, gain = room.drive, room.response, room.moved, room.arm, room.gain
    scratch = room.scratch
    rate, ahead, reached, found, ones, free = (
        scratch[3],
        scratch[4],
        scratch[5],
        scratch[6],
        scratch[7],
        scratch[8],
    )
    for i in range(velocity.shape[0]):
        free[i] = passive[i] - bias[i] + applied[i] + constraint[i]
        ahead[i] = velocity[i] + room.yielding[i] * free[i]
    start_from_last_change(entering, ends, tension, past)
    largest = 0.0
    for j in range(count):
        largest = max(largest, entering[j])
        reached[j] = max(entering[j], 0.0)
        if ends[j] == 0:
            continue
        capstan_factors(mu, turn[j], ends[j], room.factor[j], room.shrink[j])
        response[j, : ends[j]] = LEAST_RESPONSE
        for place in range(row_start[j], row_start[j + 1]):
            i, k = dof[place], span[place]
            arm[place] = ten_J[tendons.entry[place]]
            gain[place] = room.yielding[i] * arm[place]
            response[j, k] += arm[place] * gain[place]
            ahead[i] -= gain[place] * tension[j, k]
    driven = couple_driven(tendons, room)
    moved[:] = 0.0
    passes = 0  # since the last extrapolation
    momentum = 1.0
    if whole:
        for j in range(count):
            for k in range(n):
                room.last[j, k] = tension[j, k]
    for sweep in range(sweeps):
        largest_change, along, square = 0.0, 0.0, 0.0
        if whole:
            if sweep > 0:
                momentum = go_on(momentum, ends, moved, room.last, tension)
            look_ahead(velocity, tendons, room, tension, ahead)
        for j in range(count):
            spans = ends[j]
            if spans == 0:
                continue
            begin, own = np.int64(row_start[j]), tendons.lines[j]
            if own >= 0:  # a span's rate is one product, left to where it is needed
                arms, speeds = arm[begin : begin + spans], ahead[own : own + spans]
            else:
                arms, speeds = ones, rate
                for k in range(spans):
                    rate[k], ones[k] = 0.0, 1.0
                for place in range(row_start[j], row_start[j + 1]):
                    rate[span[place]] += arm[place] * ahead[dof[place]]
            drawn = reached[j]
            reached[j] = slip_as_before(
                entering[j],
                drive[j],
                room.factor[j],
                room.shrink[j],
                arms,
                speeds,
                response[j],
                spans,
                tension[j],
                found,
                slip[j],
                scratch,
            )
            if reached[j] < 0.0:
                for k in range(spans):
                    rate[k] = arms[k] * speeds[k]
                reached[j] = span_tensions(
                    entering[j],
                    drive[j],
                    drawn,
                    room.factor[j],
                    room.shrink[j],
                    rate,
                    response[j],
                    spans,
                    tension[j],
                    found,
                    slip[j],
                    scratch,
                )
            for k in range(spans):
                change, before = found[k] - tension[j, k], moved[j, k]
                largest_change = max(largest_change, abs(change))
                along += change * before
                square += before * before
                tension[j, k], moved[j, k] = found[k], change
                if own >= 0:
                    ahead[own + k] -= gain[begin + k] * change
            if own < 0:
                for place in range(row_start[j], row_start[j + 1]):
                    ahead[dof[place]] -= gain[place] * moved[j, span[place]]
        if driven > 1:
            risen = raise_together(entering, tendons, room, reached, tension, ahead)
            largest_change = max(largest_change, risen)
        if largest_change <= tolerance * largest:
            break
        if whole:
            continue
        passes += 1
        if passes > 1 and sweep + 1 < sweeps and along > LEAST_SHARE * square:
            share = min(along / square, LARGEST_SHARE)
            extrapolate_passes(share / (1.0 - share), tendons, room, tension, ahead)
            passes = 0
    for j in range(count):
        for k in range(n):
            past[j, k] = tension[j, k] - past[j, k]
        if ends[j] > 0:
            for place in range(row_start[j], row_start[j + 1]):
                applied[dof[place]] -= arm[place] * (tension[j, span[place]] - reached[j])


class MotionOfCopies(NamedTuple):
    """`velocity`, `passive`, `bias` and `constraint` as of `solve_tensions`, of m robots, shape (m, nv)."""

    velocity: Array
    passive: Array
    bias: Array
    constraint: Array


@compiled_in_place
def solve_tensions_of_copies(
    copies: Index,
    block: Array,
    history: Array,
    counts: Index,
    places: Places,
    ten_J: Array,
    entering: Array,
    turn: Array,
    motion: MotionOfCopies,
    applied: Array,
) -> None:
    """`solve_tensions` of those of m alike robots that `copies` picks; `block`, `counts`, `places` of all.

    All else has an axis of m before that there.
    """
    for i in copies:
        busy_spans(block, history[i], counts, entering[i])
        solve_tensions(
            block,
            history[i],
            counts,
            places,
            ten_J[i],
            entering[i],
            turn[i],
            motion.velocity[i],
            motion.passive[i],
            motion.bias[i],
            motion.constraint[i],
            applied[i],
        )


@compiled_in_place
def add_pull(ten_J: Array, row_start: Places, entry: Places, dof: Places, pull: Array, torque: Array) -> None:
    """Add the generalised force of tendons pulled by `pull` (one each) to `torque`, shape (nv,)."""
    for row in range(pull.shape[0]):
        for place in range(row_start[row], row_start[row + 1]):
            torque[dof[place]] -= ten_J[entry[place]] * pull[row]
