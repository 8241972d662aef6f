"""What drives one catheter or many copies, compiled: the torsion pairs' tangents and the pairs' plays.

The tests hold the tangents to `TorsionPairs.tension` and its slope, and the plays to `PairControls.arriving`.
Index i picks among the m copies.
"""

from __future__ import annotations

import math

from catheter_sim.arrays import Array, Index
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.mechanics.play import played


@compiled
def tangents(actuators: Index, places: Index, law: Array, qpos: Array, ctrl: Array, bias: Array) -> None:
    """Make one catheter's torsion joints' actuators the tangents of their pairs' law.

    Args:
        actuators, places: of the joints, and of their angles in `qpos`, shape (k,).
        law: of each: radius, wrap's height [m], wrap [rad], home length [m], stiffness, actuator's gain
            [N/m], shape (k, 6).
        qpos: positions, shape (nq,).
        ctrl: controls, shape (nu,) [m].
        bias: out: at [:, :2]: bias and length gain, shape (nu, 3 or more).
    """
    for k in range(actuators.shape[0]):
        radius, height, wrap, home = law[k, 0], law[k, 1], law[k, 2], law[k, 3]
        stiffness, gain = law[k, 4], law[k, 5]
        angle, control = qpos[places[k]], ctrl[actuators[k]]
        around = radius * max(wrap - abs(angle), 0.0)
        wrapped = math.hypot(around, height)
        arm = radius
        if height > 0.0:  # on a drum wrapped and around are one; at the wrap's very end both are 0
            arm *= around / (wrapped if wrapped > 0.0 else 1.0)
        short = control - math.copysign(home - wrapped, angle)
        slope = stiffness * arm**2
        bias[actuators[k], 0] = stiffness * short * arm + slope * angle - gain * control
        bias[actuators[k], 1] = -slope


@compiled
def tangents_of(
    copies: Index, actuators: Index, places: Index, law: Array, qpos: Array, ctrl: Array, bias: Array
) -> None:
    """Do it for those of m copies that `copies` picks: an axis of m before those of all that changes."""
    for i in copies:
        tangents(actuators, places, law, qpos[i], ctrl[i], bias[i])


@compiled
def advance_of(
    copies: Index,
    start: Array,
    change: Array,
    share: float,
    half_play: Array,
    pair: Index,
    sign: Array,
    arrived: Array,
    ctrl: Array,
) -> None:
    """Set the controls for displacements that have moved by a share of their change.

    Args:
        copies: which of the m, shape (k,).
        start, change: of the chosen ones' displacements, shape (k, p) [m].
        share: of the change.
        half_play: half of each pair's dead-band, shape (p,) [m].
        pair, sign: of each driven actuator, the first ones in `ctrl`, shape (a,).
        arrived: in and out: what arrives at the pairs, shape (m, p) [m].
        ctrl: out: controls, shape (m, nu).
    """
    for row in range(copies.shape[0]):
        i = copies[row]
        for p in range(start.shape[1]):
            wanted = start[row, p] + change[row, p] * share
            arrived[i, p] = played(arrived[i, p], wanted, half_play[p])
        for a in range(pair.shape[0]):
            ctrl[i, a] = sign[a] * arrived[i, pair[a]]
