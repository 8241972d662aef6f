"""The balance of a rolling-joint robot by virtual work, in plain NumPy, for whole batches.

Turning joint i alone by d theta, everything beyond it turns about its contact. So

    -sum_r F_ri dl_ri/dtheta - elastic moment + axis . sum (r_p - contact_i) x f_p = 0,

F_ri the tension of pulled rod r in the gap of joint i and l_ri its span there. No reaction does work.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.rolling.theory import rods
from catheter_sim.kinds.rolling.theory.chain import RollingChain
from catheter_sim.kinds.rolling.theory.joint import active_radius
from catheter_sim.kinds.rolling.theory.kinematics import Frames, frames
from catheter_sim.kinds.rolling.theory.loads import Loads, load_points
from catheter_sim.kinds.rolling.theory.newton import balanced
from catheter_sim.kinds.rolling.theory.newton_euler import compressions


@dataclass(frozen=True)
class Balance:
    """What acts about each joint in given postures; leading dimensions are the batch.

    Attributes:
        theta: bend angles, shape (..., n) [rad].
        tension: of the pulled rods, at every joint.
        unbalanced: moment left at each joint, zero in equilibrium, shape (..., n) [N m].
        jacobian: its derivative by the bend angles, shape (..., n, n) [N m/rad].
        link_length: as these tensions and loads compress the links, shape (..., n) [m].
    """

    theta: Array
    tension: rods.Tensions
    unbalanced: Array
    jacobian: Array
    link_length: Array


def load_moments(chain: RollingChain, links: Frames, theta: Array, acting: Loads) -> tuple[Array, Array]:
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
    radius = active_radius(theta, chain.radius_positive, chain.radius_negative)
    rolls = radius[..., None] * np.cross(links.along, force.sum(axis=-2))
    own = np.einsum("...ki,...ki->...k", axis, moved - rolls)
    slope = upper + np.swapaxes(upper, -1, -2) + own[..., :, None] * np.eye(chain.joints)
    # A moment has no potential in space: a joint below turns the axis about which it acts.
    turned = np.cross(axis[..., None, :, :], axis[..., :, None, :]) @ acting.tip_moment
    return moment, slope + np.tril(turned, k=-1)


def balance(
    chain: RollingChain, theta: Array, drive: Array, kept: Array, acting: Loads, link_length: Array
) -> Balance:
    """Return what acts about each joint at the bend angles `theta`.

    Args:
        chain: the robot.
        theta: shape (..., n) [rad].
        drive: tension at the actuator, shape (..., t) [N].
        kept: tension above each joint a moment ago, shape (..., t, n) [N].
        acting: loads on the links, the same for all.
        link_length: of the links, shape (..., n) [m].
    """
    t = chain.pulled
    span = rods.spans(chain, theta)
    tension = rods.tensions(chain, drive, kept, *rods.turns(chain, theta))
    elastic, elastic_slope = rods.elastic_moments(chain, theta, span)
    slope, second = (np.where(chain.passes[:t], item[..., :t, :], 0.0) for item in (span.slope, span.second))
    links = frames(chain, theta, link_length)
    pushed, pushed_slope = load_moments(chain, links, theta, acting)
    diagonal = -(tension.at_joint * second).sum(axis=-2) - elastic_slope
    return Balance(
        theta=theta,
        tension=tension,
        unbalanced=pushed - elastic - (tension.at_joint * slope).sum(axis=-2),
        jacobian=pushed_slope
        + diagonal[..., :, None] * np.eye(chain.joints)
        - (tension.slope * slope[..., None]).sum(axis=-3),
        link_length=chain.link_length - compressions(chain, links, tension, acting) / chain.link_stiffness,
    )


def equilibrium(
    chain: RollingChain,
    drive: Array,
    acting: Loads,
    start: Array,
    kept: Array,
    link_length: Array | None = None,
) -> Balance:
    """Return the equilibria nearest to `start`; each configuration of the batch has its own.

    Args:
        chain: the robot.
        drive: tension at the actuator, shape (..., t) [N].
        acting: loads on the links, the same for all.
        start: bend angles to start from, shape (..., n) [rad].
        kept: tension above each joint before, shape (..., t, n) [N].
        link_length: of the links as compressed at the start, shape (..., n) [m]; default: their own.

    Raises:
        NoEquilibrium: none was found for one configuration or more.
    """
    length = np.broadcast_to(chain.link_length if link_length is None else link_length, np.shape(start))
    found: Balance | None = None

    def moments(theta: Array) -> tuple[Array, Array]:
        # The links' compression hardly turns a joint: it follows one round behind.
        nonlocal found
        found = balance(chain, theta, drive, kept, acting, length if found is None else found.link_length)
        return found.unbalanced, found.jacobian

    balanced(moments, start, chain.low, chain.high)
    assert found is not None
    return found
