"""Tensions of tendons that share joints under the capstan law, compiled: passes over one after another."""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array, Index, Places
from catheter_sim.mechanics.capstan.accelerate import extrapolate_passes, start_from_last_change
from catheter_sim.mechanics.capstan.driven import couple_driven, raise_together
from catheter_sim.mechanics.capstan.factors import capstan_factors
from catheter_sim.mechanics.capstan.moving import go_on, look_ahead
from catheter_sim.mechanics.capstan.span import slip_as_before, span_tensions
from catheter_sim.mechanics.compiled import compiled_in_place

# Passes over the tendons come nearer to the end by much the same share each: where the last two agree on it,
# the rest of the way is taken at once. A larger share than the first is not believed; for a smaller one than
# the second a further pass costs less.
LARGEST_SHARE, LEAST_SHARE = 0.95, 0.1
# Of a span whose length no joint changes, as of a rod that crosses a joint on the joint's own line: its
# tension does nothing and keeps its value. Small against that of any span with an arm (1e-6 to 1e-3).
LEAST_RESPONSE = 1e-12  # m/s/N


@compiled_in_place
def busy_spans(entering: Array, drive: Array, ends: Index, tension: Array, busy: Index) -> None:
    """Write each tendon's number of spans into `busy`, shape (t,), 0 where it is slack before and after.

    Args: as of `solve_tensions`.
    """
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
    mu: float,
    entering: Array,
    drive: Array,
    turn: Array,
    ends: Index,
    ten_J: Array,
    row_start: Places,
    entry: Places,
    dof: Places,
    span: Places,
    lines: Index,
    velocity: Array,
    passive: Array,
    bias: Array,
    constraint: Array,
    applied: Array,
    yielding: Array,
    sweeps: int,
    tolerance: float,
    tension: Array,
    slip: Index,
    past: Array,
    holes: Array,
    pulls: Array,
    scratch: Array,
    shared: Array,
    inverse: Array,
) -> None:
    """Update all tendons' tensions, and apply what they pull beyond the actuators' tensions.

    Args:
        mu: friction coefficient.
        entering: tensions at the actuators now; below zero where a driven tendon is slack, shape (t,) [N].
        drive: growth of the actuators' tensions per unit of the tendons' rate of lengthening in one
            step; 0 where the tension is given, shape (t,) [N s/m].
        turn: shape (t, n) [rad].
        ends: number of spans of each tendon, 0 of one that is left as it is (`busy_spans`), shape (t,).
        ten_J: MuJoCo's sparse tendon Jacobian; `entry` picks from it.
        row_start: first entry of each tendon in `entry`, `dof`, `span`, shape (t + 1,).
        entry, dof, span: for each nonzero of the tendons' Jacobian its place in `ten_J`, its degree
            of freedom, and the span whose length it changes, shape (e,).
        lines: the first degree of freedom of a tendon of which each changes the length of one span, one after
            another as the spans are; -1 of other tendons, shape (t,).
        velocity: velocities now, shape (nv,).
        passive, bias, constraint: MuJoCo's generalised forces (`bias` is subtracted), shape (nv,).
        applied: in: all other generalised forces but the tendons'; out: with what the tensions pull
            beyond those that the actuators will have at the end of the step (the integrator adds
            these), shape (nv,).
        yielding: timestep over effective implicit inertia of each degree of freedom, shape (nv,).
        sweeps: most passes over the tendons, which share degrees of freedom.
        tolerance: they end when no tension changed by more than this share of the largest.
        tension: in: last step's; out: new, shape (t, n) [N].
        slip: in and out: where the tendons slipped last, as of `span_tensions`, shape (t, n).
        past: in and out: what `start_from_last_change` remembers, shape (t, n + 2) [N].
        holes: workspace, shape (5, t, n).
        pulls: workspace, shape (2, e).
        scratch: workspace, shape (10, 2 max(n, nv, t)).
        shared: workspace, shape (2 t + 4 + nv, t).
        inverse: timestep times the inverse of the inertia that the integrator uses, where it is more than
            each degree of freedom's own (`capstan.moving`), shape (nv, nv); else of shape (0, 0).
    """
    tendons = tension.shape[0]
    factor, shrink, response, moved, last = holes[0], holes[1], holes[2], holes[3], holes[4]
    whole = inverse.shape[0] > 0
    free, torque = scratch[8], scratch[9]
    arm, gain = pulls[0], pulls[1]  # gain: change of velocity in a step per unit of tension
    rate, ahead, reached, found, ones = scratch[3], scratch[4], scratch[5], scratch[6], scratch[7]
    for i in range(velocity.shape[0]):
        free[i] = passive[i] - bias[i] + applied[i] + constraint[i]
        ahead[i] = velocity[i] + yielding[i] * free[i]
    start_from_last_change(entering, ends, tension, past)
    largest = 0.0
    for j in range(tendons):
        largest = max(largest, entering[j])
        reached[j] = max(entering[j], 0.0)
        if ends[j] == 0:
            continue
        capstan_factors(mu, turn[j], ends[j], factor[j], shrink[j])
        response[j, : ends[j]] = LEAST_RESPONSE
        for place in range(row_start[j], row_start[j + 1]):
            i, k = dof[place], span[place]
            arm[place] = ten_J[entry[place]]
            gain[place] = yielding[i] * arm[place]
            response[j, k] += arm[place] * gain[place]
            ahead[i] -= gain[place] * tension[j, k]
    driven = couple_driven(ends, drive, row_start, dof, arm, gain, shared)
    moved[:] = 0.0
    passes = 0  # since the last extrapolation
    momentum = 1.0
    if whole:
        for j in range(tendons):
            for k in range(tension.shape[1]):
                last[j, k] = tension[j, k]
    for sweep in range(sweeps):
        largest_change, along, square = 0.0, 0.0, 0.0
        if whole:
            if sweep > 0:
                momentum = go_on(momentum, ends, moved, last, tension)
            look_ahead(velocity, free, inverse, ends, row_start, dof, span, arm, tension, torque, ahead)
        for j in range(tendons):
            count = ends[j]
            if count == 0:
                continue
            first, own = np.int64(row_start[j]), lines[j]
            if own >= 0:  # a span's rate is one product, left to where it is needed
                arms, speeds = arm[first : first + count], ahead[own : own + count]
            else:
                arms, speeds = ones, rate
                for k in range(count):
                    rate[k], ones[k] = 0.0, 1.0
                for place in range(row_start[j], row_start[j + 1]):
                    rate[span[place]] += arm[place] * ahead[dof[place]]
            drawn = reached[j]
            reached[j] = slip_as_before(
                entering[j],
                drive[j],
                factor[j],
                shrink[j],
                arms,
                speeds,
                response[j],
                count,
                tension[j],
                found,
                slip[j],
                scratch,
            )
            if reached[j] < 0.0:
                for k in range(count):
                    rate[k] = arms[k] * speeds[k]
                reached[j] = span_tensions(
                    entering[j],
                    drive[j],
                    drawn,
                    factor[j],
                    shrink[j],
                    rate,
                    response[j],
                    count,
                    tension[j],
                    found,
                    slip[j],
                    scratch,
                )
            for k in range(count):
                change, before = found[k] - tension[j, k], moved[j, k]
                largest_change = max(largest_change, abs(change))
                along += change * before
                square += before * before
                tension[j, k], moved[j, k] = found[k], change
                if own >= 0:
                    ahead[own + k] -= gain[first + k] * change
            if own < 0:
                for place in range(row_start[j], row_start[j + 1]):
                    ahead[dof[place]] -= gain[place] * moved[j, span[place]]
        if driven > 1:
            risen = raise_together(
                entering, drive, ends, row_start, dof, span, arm, gain, shared, reached, tension, ahead
            )
            largest_change = max(largest_change, risen)
        if largest_change <= tolerance * largest:
            break
        if whole:
            continue
        passes += 1
        if passes > 1 and sweep + 1 < sweeps and along > LEAST_SHARE * square:
            share = min(along / square, LARGEST_SHARE)
            extrapolate_passes(share / (1.0 - share), ends, row_start, dof, span, gain, moved, tension, ahead)
            passes = 0
    for j in range(tendons):
        for k in range(tension.shape[1]):
            past[j, k] = tension[j, k] - past[j, k]
        if ends[j] > 0:
            for place in range(row_start[j], row_start[j + 1]):
                applied[dof[place]] -= arm[place] * (tension[j, span[place]] - reached[j])


@compiled_in_place
def add_pull(ten_J: Array, row_start: Places, entry: Places, dof: Places, pull: Array, torque: Array) -> None:
    """Add the generalised force of tendons pulled by `pull` (one each) to `torque`, shape (nv,)."""
    for row in range(pull.shape[0]):
        for place in range(row_start[row], row_start[row + 1]):
            torque[dof[place]] -= ten_J[entry[place]] * pull[row]
