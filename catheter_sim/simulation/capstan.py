"""The capstan law's inner loops, compiled: turns at the holes, and the tensions that friction allows.

Index j counts tendons, k spans from 0 at the base; hole k lies just before span k. A tendon ends
behind span `ends[j] - 1`. `catheter_sim.simulation.friction` says what is solved and why.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# Of a span whose length no joint changes, as of a rod that crosses a joint on the joint's own line: its
# tension does nothing and keeps its value. Small against that of any span with an arm (1e-6 to 1e-3).
LEAST_RESPONSE = 1e-12  # m/s/N


@njit(cache=True)
def planar_turns(qpos: Array, joint_index: Index, turn: Array) -> None:
    """Write the turns of all tendons of a planar robot into `turn`, shape (t, n) [rad].

    The chord of a cell bent by theta lies at theta / 2, so a turn is half the sum of the two
    adjoining cells' angles; at the base's hole half of the first cell's.
    """
    before = 0.0
    for k in range(turn.shape[1]):
        angle = qpos[joint_index[k]]
        value = abs(0.5 * (before + angle))
        before = angle
        for j in range(turn.shape[0]):
            turn[j, k] = value


@njit(cache=True)
def spatial_turns(points: Array, site_index: Index, ends: Index, turn: Array) -> None:
    """Write the turns of tendons given by their holes' positions into `turn`, shape (t, n) [rad].

    Before the base's hole a tendon comes along the base's axis.
    """
    for j in range(turn.shape[0]):
        ax, ay, az = 0.0, 0.0, 1.0
        for k in range(ends[j]):
            here, there = site_index[j, k], site_index[j, k + 1]
            bx = points[there, 0] - points[here, 0]
            by = points[there, 1] - points[here, 1]
            bz = points[there, 2] - points[here, 2]
            cx, cy, cz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            turn[j, k] = math.atan2(math.sqrt(cx * cx + cy * cy + cz * cz), ax * bx + ay * by + az * bz)
            ax, ay, az = bx, by, bz


@njit(cache=True)
def span_tensions(
    entering: float,
    drive: float,
    factor: Array,
    rate: Array,
    response: Array,
    count: int,
    tension: Array,
    scratch: Array,
) -> float:
    """Update one tendon's tensions to those with which it sticks where it can and slips where it must.

    The tensions minimise sum_k response_k (T_k - old_k)^2 / 2 - rate_k (T_k - old_k), which is zero
    slope where no span changes its length, within T_k - T_(k-1) in [low_k, high_k], what friction
    allows at hole k. The multiplier of that bound is the sliding speed at hole k. Solved exactly by
    dynamic programming from the tip: the slope of the cost-to-go is a rising, piecewise linear
    function of the tension before the hole, kept as its knots, those left and those right of where it
    is zero on two piles, each shifted as a whole. From span to span the zero passes few of them, so that
    the cost grows about as the number of spans.

    Args:
        entering: tension at the actuator now; below zero where a driven tendon is slack [N].
        drive: what the actuator's tension grows by per unit of the tendon's rate of lengthening in
            one step [N s/m]; 0 where the tension is given.
        factor: exp(mu turn) at each hole, shape (n,).
        rate: length rates of the spans under the old tensions [m/s], shape (n,).
        response: fall of a span's length rate per unit of its own tension, above zero [m/s/N], shape (n,).
        count: number of spans of this tendon.
        tension: in: old tensions; out: new ones, shape (n,) [N].
        scratch: workspace, shape (3, 2 n + 2).

    Returns:
        The actuator's tension at the end of the step [N].
    """
    knots, steps, goal = scratch[0], scratch[1], scratch[2]
    left, right = 0, knots.shape[0]  # the piles: below `left`, and from `right` on; the zero lies between
    to_left, to_right = 0.0, 0.0  # by which all knots of a pile are shifted
    for k in range(count, -1, -1):
        # Between the piles the slope is zero as yet: there this span, or the actuator, adds a line a T + b.
        if k > 0:
            a, b = response[k - 1], -(response[k - 1] * tension[k - 1] + rate[k - 1])
        elif drive > 0.0:
            a, b = 1.0 / drive, -entering / drive
        else:
            break
        # where it crosses zero: the tension that span k would like
        while left > 0:
            knot, step = knots[left - 1] + to_left, steps[left - 1]
            if not a * knot + b > 0.0:
                break
            left, right = left - 1, right - 1
            knots[right], steps[right] = knot - to_right, step
            a -= step
            b += step * knot
        while right < knots.shape[0]:
            knot, step = knots[right] + to_right, steps[right]
            if not a * knot + b < 0.0:
                break
            knots[left], steps[left] = knot - to_left, step
            left, right = left + 1, right + 1
            a += step
            b -= step * knot
        wish = -b / a
        if k == 0:
            entering = wish
            break
        goal[k - 1] = wish
        # as a function of the tension before hole k: left of the wish shifted by the upper bound,
        # flat between, right of it shifted by the lower bound
        before = tension[k - 2] if k > 1 else max(entering, 0.0)
        low, high = before / factor[k - 1] - before, before * factor[k - 1] - before
        to_left -= high
        to_right -= low
        right -= 1
        knots[left], steps[left] = wish - high - to_left, -a
        knots[right], steps[right] = wish - low - to_right, a
        left += 1
    entering = max(entering, 0.0)
    before = entering
    for k in range(count):
        before = min(max(goal[k], before / factor[k]), before * factor[k])
        tension[k] = before
    return entering


@njit(cache=True)
def confine(
    mu: float,
    entering: Array,
    drive: Array,
    turn: Array,
    ends: Index,
    ten_J: Array,
    row_start: Index,
    entry: Index,
    dof: Index,
    span: Index,
    velocity: Array,
    force: Array,
    mass: Array,
    timestep: float,
    sweeps: int,
    tolerance: float,
    tension: Array,
    torque: Array,
    scratch: Array,
) -> None:
    """Update all tendons' tensions, and write what they pull beyond the actuators' tensions.

    Args:
        mu: friction coefficient.
        entering: tensions at the actuators now; below zero where a driven tendon is slack, shape (t,) [N].
        drive: growth of the actuators' tensions per unit of the tendons' rate of lengthening in one
            step; 0 where the tension is given, shape (t,) [N s/m].
        turn: shape (t, n) [rad].
        ends: number of spans of each tendon, shape (t,).
        ten_J: MuJoCo's sparse tendon Jacobian; `entry` picks from it.
        row_start: first entry of each tendon in `entry`, `dof`, `span`, shape (t + 1,).
        entry, dof, span: for each nonzero of the tendons' Jacobian its place in `ten_J`, its degree
            of freedom, and the span whose length it changes.
        velocity: velocities now, shape (nv,).
        force: all generalised forces but the tendons', shape (nv,); damping included.
        mass: effective implicit inertia of each degree of freedom, shape (nv,).
        timestep: [s].
        sweeps: most passes over the tendons, which share degrees of freedom.
        tolerance: they end when no tension changed by more than this share of the largest.
        tension: in: last step's; out: new, shape (t, n) [N].
        torque: out: generalised force of the tensions less those that the actuators will have at the
            end of the step (the integrator adds these), shape (nv,).
        scratch: workspace, shape (9, 2 max(n, nv, t) + 2).
    """
    tendons = tension.shape[0]
    rate, ahead, reached, old = scratch[3], scratch[4], scratch[5], scratch[6]
    factor, response = np.empty(tension.shape), np.empty(tension.shape)
    arm, push = np.empty(entry.shape[0]), np.empty(entry.shape[0])  # push: of a unit of tension, in a step
    for i in range(velocity.shape[0]):
        ahead[i] = velocity[i] + timestep * force[i] / mass[i]
        torque[i] = 0.0
    largest = 0.0
    for j in range(tendons):
        largest = max(largest, entering[j])
        for k in range(ends[j]):
            factor[j, k] = math.exp(mu * turn[j, k])
            response[j, k] = LEAST_RESPONSE
        for place in range(row_start[j], row_start[j + 1]):
            i, k = dof[place], span[place]
            arm[place] = ten_J[entry[place]]
            push[place] = timestep * arm[place] / mass[i]
            response[j, k] += push[place] * arm[place]
            ahead[i] -= push[place] * tension[j, k]
    for sweep in range(sweeps):
        change = 0.0
        for index in range(tendons):
            j = index if sweep % 2 == 0 else tendons - 1 - index
            for k in range(ends[j]):
                rate[k] = 0.0
                old[k] = tension[j, k]
            for place in range(row_start[j], row_start[j + 1]):
                rate[span[place]] += arm[place] * ahead[dof[place]]
            reached[j] = span_tensions(
                entering[j], drive[j], factor[j], rate, response[j], ends[j], tension[j], scratch
            )
            for k in range(ends[j]):
                old[k] = tension[j, k] - old[k]
                change = max(change, abs(old[k]))
            for place in range(row_start[j], row_start[j + 1]):
                ahead[dof[place]] -= push[place] * old[span[place]]
        if change <= tolerance * largest:
            break
    for j in range(tendons):
        for place in range(row_start[j], row_start[j + 1]):
            torque[dof[place]] -= arm[place] * (tension[j, span[place]] - reached[j])


@njit(cache=True)
def add_pull(ten_J: Array, row_start: Index, entry: Index, dof: Index, pull: Array, torque: Array) -> None:
    """Add the generalised force of tendons pulled by `pull` (one each) to `torque`, shape (nv,)."""
    for row in range(pull.shape[0]):
        for place in range(row_start[row], row_start[row + 1]):
            torque[dof[place]] -= ten_J[entry[place]] * pull[row]


@njit(cache=True, nogil=True)
def planar_turns_of(copies: Index, qpos: Array, joint_index: Index, turn: Array) -> None:
    """`planar_turns` of many robots: `qpos` (m, nq) and `turn` (m, t, n); `copies` picks some of them."""
    for i in copies:
        planar_turns(qpos[i], joint_index, turn[i])


@njit(cache=True, nogil=True)
def spatial_turns_of(copies: Index, points: Array, site_index: Index, ends: Index, turn: Array) -> None:
    """`spatial_turns` of many robots: `points` (m, s, 3) and `turn` (m, t, n); `copies` picks some."""
    for i in copies:
        spatial_turns(points[i], site_index, ends, turn[i])


@njit(cache=True, nogil=True)
def confine_copies(
    copies: Index,
    mu: float,
    entering: Array,
    drive: Array,
    turn: Array,
    ends: Index,
    ten_J: Array,
    row_start: Index,
    entry: Index,
    dof: Index,
    span: Index,
    velocity: Array,
    passive: Array,
    bias: Array,
    constraint: Array,
    mass: Array,
    timestep: float,
    sweeps: int,
    tolerance: float,
    tension: Array,
    applied: Array,
    torque: Array,
    scratch: Array,
) -> None:
    """`confine` many robots, and add what their tendons pull beyond the actuators to what is applied.

    Args:
        copies: which of the m robots.
        mu, drive, ends, row_start, entry, dof, span, mass, timestep, sweeps, tolerance, scratch: as there,
            the same of all.
        entering, turn, ten_J, velocity, tension: as there, of each: one axis of m more before theirs.
        passive, bias, constraint: MuJoCo's generalised forces, shape (m, nv).
        applied: in and out: MuJoCo's applied forces, shape (m, nv).
        torque: workspace, shape (nv,).
    """
    force = np.empty(mass.shape[0])
    for i in copies:
        for k in range(force.shape[0]):
            force[k] = passive[i, k] - bias[i, k] + applied[i, k] + constraint[i, k]
        confine(
            mu,
            entering[i],
            drive,
            turn[i],
            ends,
            ten_J[i],
            row_start,
            entry,
            dof,
            span,
            velocity[i],
            force,
            mass,
            timestep,
            sweeps,
            tolerance,
            tension[i],
            torque,
            scratch,
        )
        for k in range(force.shape[0]):
            applied[i, k] += torque[k]
