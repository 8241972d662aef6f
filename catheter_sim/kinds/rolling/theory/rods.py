"""What the rods do at every joint: their spans, elastic moments and tensions, in plain NumPy.

Leading dimensions of `theta` are the batch; rods come before joints: shape (..., m, n).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.rolling.theory import joint as geometry
from catheter_sim.kinds.rolling.theory.chain import RollingChain


@dataclass(frozen=True)
class Tensions:
    """Tension of the pulled rods at every joint.

    Attributes:
        at_joint: in the gap of the joint, which the joint feels, shape (..., t, n) [N].
        above: behind the hole of the joint's own link, shape (..., t, n) [N].
        slope: derivative of `at_joint` by the bend angles, shape (..., t, n, n) [N/rad].
    """

    at_joint: Array
    above: Array
    slope: Array


def spans(chain: RollingChain, theta: Array) -> geometry.Span:
    """Return every rod's free span at every joint."""
    radius = geometry.active_radius(theta, chain.radius_positive, chain.radius_negative)
    return geometry.span(
        theta[..., None, :], radius[..., None, :], chain.offset, chain.mouth, chain.countersink
    )


def turns(chain: RollingChain, theta: Array) -> tuple[Array, Array]:
    """Return every rod's turn in every link, signed, and its derivative, shapes (..., m, n) [rad]."""
    radius = geometry.active_radius(theta, chain.radius_positive, chain.radius_negative)
    below = np.concatenate([chain.link_length[:1], chain.link_length[:-1]])
    return geometry.turn(
        theta[..., None, :],
        radius[..., None, :],
        chain.offset,
        chain.mouth,
        chain.side * chain.clearance,
        chain.link_length - chain.countersink,
        below,
    )


def elastic_moments(chain: RollingChain, theta: Array, span: geometry.Span) -> tuple[Array, Array]:
    """Return the moment with which rods and sleeve resist at each joint, and its slope, (..., n).

    chest_tube_2025, Eq. 8, summed over the rods that pass, with cubic and quintic terms and the rest
    angle where the robot has them.
    """
    curvature, slope = geometry.rod_curvature(theta[..., None, :], span.along, span.along_slope)
    bent = curvature - chain.rest_curvature
    stiffness = np.where(chain.passes, chain.stiffness[:, None], 0.0)
    mean = (theta - chain.rest_angle) / chain.link_length
    law = 1.0 + mean**2 * (chain.cubic + mean**2 * chain.quintic)
    steeper = mean * (2.0 * chain.cubic + 4.0 * mean**2 * chain.quintic) / chain.link_length
    moment = stiffness * bent * law[..., None, :]
    tangent = stiffness * (slope * law[..., None, :] + bent * steeper[..., None, :])
    sleeve = chain.sleeve_stiffness * (theta - chain.rest_angle)
    return moment.sum(axis=-2) + sleeve, tangent.sum(axis=-2) + chain.sleeve_stiffness


def tensions(chain: RollingChain, drive: Array, kept: Array, turn: Array, turn_slope: Array) -> Tensions:
    """Return the pulled rods' tensions, from the actuator to the tip, with dry friction.

    The tension above joint i lies in [F e^(-mu |phi_i|), F e^(+mu |phi_i|)] around the tension F below
    it and keeps its value unless the interval pushes it (Eq. 1 is its lower end). It knows one rod's
    own history only: where several rods are pulled against one another, or a force moves the robot
    while a rod is held, Coulomb's law asks for the rod's sliding instead.

    Args:
        chain: the robot.
        drive: tension at the actuator, shape (..., t) [N].
        kept: tension above each joint a moment ago, shape (..., t, n) [N].
        turn, turn_slope: from `turns`, shape (..., m, n).
    """
    t, n = chain.pulled, chain.joints
    passes = chain.passes[:t]
    factor = np.exp(chain.mu * np.abs(turn[..., :t, :]))
    grows = chain.mu * np.sign(turn[..., :t, :]) * turn_slope[..., :t, :]
    below = np.asarray(drive, dtype=float)
    slope_below = np.zeros((*below.shape, n))
    at_joint, above, slopes = [], [], []
    for k in range(n):
        below = np.where(passes[:, k], below, 0.0)
        slope_below = np.where(passes[:, k, None], slope_below, 0.0)
        at_joint.append(below)
        slopes.append(slope_below)
        e, held = factor[..., k], kept[..., k]
        low, high = below / e, below * e
        sign = np.where(held < low, -1.0, np.where(held > high, 1.0, 0.0))
        ratio = np.where(sign == 0.0, 0.0, e**sign)
        next_slope = ratio[..., None] * slope_below
        next_slope[..., k] += sign * ratio * below * grows[..., k]
        below, slope_below = np.clip(held, low, high), next_slope
        above.append(below)
    return Tensions(np.stack(at_joint, axis=-1), np.stack(above, axis=-1), np.stack(slopes, axis=-2))
