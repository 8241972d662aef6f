"""The complete Newton-Euler balance, link by link, in plain NumPy: the reference of the compiled one.

Link k with the rods in it is cut free in the gaps below and above. On it act: at its own gap each
pulled rod's tension along the rod's span, and the rods' elastic moment; at the gap above the same
with the opposite signs; its loads; the next joint's reaction; and the reaction of its own joint, a
force at the contact and a moment about any axis but the joint's own. Friction of a rod in its hole
is inside the cut. chest_tube_2025 (doi 10.1109/LRA.2025.3597860), Eqs 9 to 11, leaves out the
elastic moment of the next joint and the balance across the link, and with it the weight of what
lies beyond.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.rolling.theory import rods
from catheter_sim.kinds.rolling.theory.chain import RollingChain
from catheter_sim.kinds.rolling.theory.joint import Span
from catheter_sim.kinds.rolling.theory.kinematics import Frames, frames
from catheter_sim.kinds.rolling.theory.loads import Loads, load_points


@dataclass(frozen=True)
class Reactions:
    """What the joints carry in one posture.

    Attributes:
        force: of joint k on link k at the contact, base frame, shape (n, 3) [N]; the first is the
            base's.
        moment: of joint k on link k, base frame, shape (n, 3) [N m].
        unbalanced: its part about the joint's own axis, which a rolling joint cannot carry: zero in
            equilibrium, shape (n,) [N m].
        compression: force that each link carries along its axis, pressed positive, shape (n,) [N].
    """

    force: Array
    moment: Array
    unbalanced: Array
    compression: Array


def reactions(
    chain: RollingChain,
    theta: Array,
    tension: rods.Tensions,
    acting: Loads,
    link_length: Array | None = None,
) -> Reactions:
    """Return what the joints carry at the bend angles `theta`.

    Args:
        chain: the robot.
        theta: shape (n,) [rad].
        tension: of the pulled rods, from `rods.tensions`.
        acting: the loads on the links.
        link_length: of the links as compressed, shape (n,) [m]; default: their own.
    """
    n = chain.joints
    links = frames(chain, theta, link_length)
    span = rods.spans(chain, theta)
    elastic, _ = rods.elastic_moments(chain, theta, span)
    points = load_points(links, acting)
    force, moment = np.zeros((n, 3)), np.zeros((n, 3))
    for k in reversed(range(n)):
        contact = links.contact[k]
        pushes: list[tuple[Array, Array]] = [
            (point, push)
            for point, push, link in zip(points, acting.force, acting.link, strict=True)
            if link == k
        ]
        twists = -elastic[k] * links.axis[k]
        for lower, chord, pull in _pulls(chain, links, span, tension, k):
            pushes.append((lower + chord, -pull * chord / np.linalg.norm(chord)))
        if k == n - 1:
            twists = twists + acting.tip_moment
        else:
            for lower, chord, pull in _pulls(chain, links, span, tension, k + 1):
                pushes.append((lower, pull * chord / np.linalg.norm(chord)))
            pushes.append((links.contact[k + 1], -force[k + 1]))
            twists = twists + elastic[k + 1] * links.axis[k + 1] - moment[k + 1]
        force[k] = -sum(push for _, push in pushes)
        moment[k] = -twists - sum(np.cross(point - contact, push) for point, push in pushes)
    return Reactions(
        force=force,
        moment=moment,
        unbalanced=-np.einsum("ki,ki->k", moment, links.axis),
        compression=compressions(chain, links, tension, acting),
    )


def _pulls(
    chain: RollingChain, links: Frames, span: Span, tension: rods.Tensions, k: int
) -> Iterator[tuple[Array, Array, float]]:
    """Yield each pulled rod's lower mouth, span and tension in the gap of joint k."""
    for r in range(chain.pulled):
        if chain.passes[r, k]:
            local = np.array([*chain.position[r, k], -chain.countersink[r, k]])
            lower = links.below_face[k] + links.below_R_w[k] @ local
            chord = span.across[r, k] * links.along[k] + span.along[r, k] * links.below_R_w[k, :, 2]
            yield lower, chord, float(tension.at_joint[r, k])


def compressions(chain: RollingChain, links: Frames, tension: rods.Tensions, acting: Loads) -> Array:
    """Return the force that presses each link together along its axis, shape (..., n) [N].

    Its rods, whose tension falls along the hole by friction (the mean is taken), and the loads that
    act beyond its middle.
    """
    t = chain.pulled
    inside = 0.5 * (tension.at_joint + tension.above) * chain.passes[:t]
    beyond = (acting.link[None, :] >= np.arange(chain.joints)[:, None]) @ acting.force
    return inside.sum(axis=-2) - np.einsum("...kj,kj->...k", links.R_w[..., :, :, 2], beyond)
