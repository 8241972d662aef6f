"""The balance of a rolling-joint robot by virtual work, in plain NumPy, for whole batches.

Turning joint i alone by d theta, everything beyond it turns about its contact. So

    -sum_r F_ri dl_ri/dtheta - elastic moment + axis . sum (r_p - contact_i) x f_p = 0,

F_ri the tension of pulled rod r in the gap of joint i and l_ri its span there. No reaction does work.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catheter_sim.robots.posture import Array
from catheter_sim.statics.balance import NoEquilibrium
from catheter_sim.statics.rolling import rods
from catheter_sim.statics.rolling.chain import RollingChain
from catheter_sim.statics.rolling.kinematics import Frames, frames
from catheter_sim.statics.rolling.loads import Loads, load_points
from catheter_sim.statics.rolling.newton_euler import compressions

ANGLE_TOLERANCE_RAD = 1e-11
_MOST_ROUNDS = 60
_MOST_HALVINGS = 12
_TOWARD_LIMIT = 0.9  # of the way to a closing gap that one step may go


@dataclass(frozen=True)
class Equilibrium:
    """Solved configurations; leading dimensions are the batch.

    Attributes:
        theta: bend angles, shape (..., n) [rad].
        tension: of the pulled rods, at every joint.
        link_length: as compressed, shape (..., n) [m].
        unbalanced: moment left at each joint, shape (..., n) [N m].
    """

    theta: Array
    tension: rods.Tensions
    link_length: Array
    unbalanced: Array


def load_moments(
    chain: RollingChain, links: Frames, theta: Array, acting: Loads
) -> tuple[Array, Array]:
    """Return what the loads do about each joint, and its derivative, shapes (..., n) and (..., n, n)."""
    arm = load_points(links, acting)[..., None, :, :] - links.contact[..., :, None, :]
    beyond = acting.link[None, :] >= np.arange(chain.joints)[:, None]
    force = np.where(beyond[:, :, None], acting.force, 0.0)
    axis = links.axis
    about = np.cross(arm, force).sum(axis=-2) + acting.tip_moment
    moment = np.einsum("...ki,...ki->...k", axis, about)
    # Forces with a fixed direction have a potential: their derivative is symmetric.
    moved = np.cross(np.cross(axis[..., :, None, :], arm), force).sum(axis=-2)
    upper = np.triu(axis @ np.swapaxes(moved, -1, -2), k=1)
    radius = np.where(theta >= 0.0, chain.radius_positive, chain.radius_negative)
    rolls = radius[..., None] * np.cross(links.along, force.sum(axis=-2))
    own = np.einsum("...ki,...ki->...k", axis, moved - rolls)
    slope = upper + np.swapaxes(upper, -1, -2) + own[..., :, None] * np.eye(chain.joints)
    # A steady moment has none where the axes differ: joint j below turns the axis of joint i.
    turned = np.cross(axis[..., None, :, :], axis[..., :, None, :]) @ acting.tip_moment
    return moment, slope + np.tril(turned, k=-1)


def unbalanced(
    chain: RollingChain, theta: Array, drive: Array, kept: Array, acting: Loads, link_length: Array
) -> tuple[Array, Array, rods.Tensions, Array]:
    """Return the moment left at each joint, its derivative by the angles, the tensions and lengths.

    Args:
        chain: the robot.
        theta: shape (..., n) [rad].
        drive: tension at the actuator, shape (..., t) [N].
        kept: tension above each joint a moment ago, shape (..., t, n) [N].
        acting: loads on the links.
        link_length: of the links, compressed as under the last tensions, shape (..., n) [m].

    Returns:
        shapes (..., n) [N m], (..., n, n) [N m/rad], `Tensions`, and (..., n) [m].
    """
    t = chain.pulled
    span = rods.spans(chain, theta)
    tension = rods.tensions(chain, drive, kept, *rods.turns(chain, theta))
    elastic, elastic_slope = rods.elastic_moments(chain, theta, span)
    slope, second = (np.where(chain.passes[:t], item[..., :t, :], 0.0) for item in (span.slope, span.second))
    links = frames(chain, theta, link_length)
    pushed, pushed_slope = load_moments(chain, links, theta, acting)
    moment = -(tension.at_joint * slope).sum(axis=-2) - elastic + pushed
    diagonal = -(tension.at_joint * second).sum(axis=-2) - elastic_slope
    jacobian = (
        pushed_slope
        + diagonal[..., :, None] * np.eye(chain.joints)
        - (tension.slope * slope[..., None]).sum(axis=-3)
    )
    shorter = compressions(chain, links, tension, acting) / chain.link_stiffness
    return moment, jacobian, tension, chain.link_length - shorter


def solve(
    chain: RollingChain, drive: Array, acting: Loads, start: Array, kept: Array
) -> Equilibrium:
    """Return the equilibria nearest to `start`; each configuration of the batch has its own.

    Newton's method with the exact derivative. A step stops short of a closing gap, and is halved
    while it makes the balance worse.

    Args:
        chain: the robot.
        drive: tension at the actuator, shape (..., t) [N].
        acting: loads on the links, the same for all.
        start: bend angles to start from, shape (..., n) [rad].
        kept: tension above each joint before, shape (..., t, n) [N].

    Raises:
        NoEquilibrium: none was found for one configuration or more.
    """
    theta = np.array(start, dtype=float)
    length = np.broadcast_to(chain.link_length, theta.shape)
    value, jacobian, tension, length = unbalanced(chain, theta, drive, kept, acting, length)
    for _ in range(_MOST_ROUNDS):
        step = -np.linalg.solve(jacobian, value[..., None])[..., 0]
        room = np.where(step > 0.0, chain.high - theta, theta - chain.low)
        share = np.min(_TOWARD_LIMIT * room / np.maximum(np.abs(step), 1e-300), axis=-1, initial=1.0)
        before = np.abs(value).max(axis=-1)
        small = np.abs(step).max(axis=-1) < ANGLE_TOLERANCE_RAD
        for _ in range(_MOST_HALVINGS):
            following = theta + share[..., None] * step
            value, jacobian, tension, length = unbalanced(chain, following, drive, kept, acting, length)
            worse = (np.abs(value).max(axis=-1) > before) & ~small
            if not worse.any():
                break
            share = np.where(worse, 0.5 * share, share)
        theta = following
        if small.all():
            return Equilibrium(theta, tension, length, value)
    raise NoEquilibrium("no posture close by balances the rods and the loads")
