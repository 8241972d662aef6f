"""Actuators of driven tendons pull only: which of them a step clamps, for one robot and for copies.

MuJoCo clamps an actuator's force at the start of a step and then leaves its stiffness out of the implicit
solution: a stiff tendon that is paid out would jump between taut and slack at every step. Left unclamped for
the step in which it slackens, it ends near zero by itself. So only those are clamped that were slack before
the command changed. Index i picks among m copies.
"""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array, Index
from catheter_sim.mechanics.compiled import compiled


def clamp_of_slack(force_before: Array) -> Array:
    """Return the largest forces of actuators: none push, but those are left alone that pulled before."""
    return np.where(force_before < 0.0, 1e9, 0.0)


@compiled
def clamp_slack(
    pulls: Index,
    tendons: Index,
    gain: Array,
    bias: Array,
    length_gain: Array,
    length: Array,
    ctrl: Array,
    before: Array,
    force_range: Array,
) -> None:
    """Set the largest forces of the actuators that pull one robot's tendons, and keep their controls.

    Args:
        pulls, tendons: actuators and what they pull, shape (k,).
        gain, bias, length_gain: of these: force = gain control + bias + length_gain length, shape (k,).
        length: of the tendons, shape (nt,) [m].
        ctrl: controls, shape (nu,).
        before: in: controls of the last step; out: of this one, shape (k,).
        force_range: out: at [:, 1]: none of a tendon that was slack before, shape (nu, 2) [N].
    """
    for k in range(pulls.shape[0]):
        force = gain[k] * before[k] + bias[k] + length_gain[k] * length[tendons[k]]
        force_range[pulls[k], 1] = 1e9 if force < 0.0 else 0.0
        before[k] = ctrl[pulls[k]]


@compiled
def clamp_slack_of(
    copies: Index,
    pulls: Index,
    tendons: Index,
    gain: Array,
    bias: Array,
    length_gain: Array,
    length: Array,
    ctrl: Array,
    before: Array,
    force_range: Array,
) -> None:
    """Do it for those of m copies that `copies` picks: an axis of m before those of all that changes."""
    for i in copies:
        clamp_slack(pulls, tendons, gain, bias, length_gain, length[i], ctrl[i], before[i], force_range[i])
