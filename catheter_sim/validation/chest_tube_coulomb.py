"""Does a history of a rolling-joint robot's postures obey statics and Coulomb's law? From the postures alone.

Where a rod slides through a link, its tension must change there by the full capstan factor, against
the sliding. Sliding is the change of the rod's length beyond the link: of its spans in the gaps there.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.posture import Posture
from catheter_sim.robots.rolling import complete as rods
from catheter_sim.robots.rolling.complete import loads, reactions
from catheter_sim.robots.rolling.description import RollingChain, rolling_chain
from catheter_sim.robots.rolling.spec import RollingRobot

SLIDES_M = 2e-6  # what counts as sliding between two rows; rest leaves less
CLEAR_SHARE = 0.9  # a tension change below this share of the full one is not slipping
PULLED_N = 0.05  # a rod that nobody pulls has no tension to judge


def violations(robot: RollingRobot, postures: Sequence[Posture]) -> tuple[int, int]:
    """Return how often a rod slid through a link while its tension said that it stuck, of how many slides.

    Args:
        robot: whose postures they are.
        postures: at closely spaced rows.
    """
    chain = rolling_chain(robot)
    theta, tension = _theta(postures), np.array([posture.tendon_tension for posture in postures])
    length = _length_beyond(chain, theta)
    turn = np.abs(rods.turns(chain, theta)[0][:, : chain.pulled, :-1])
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.log(tension[:, :, 1:] / tension[:, :, :-1]) / (chain.mu * turn)
    judged = (turn > 1e-3) & (np.fmin(tension[:, :, 1:], tension[:, :, :-1]) > PULLED_N)
    wrong = slides = 0
    for before, after in itertools.pairwise(range(len(postures))):
        slid = length[after] - length[before]
        sliding = judged[after] & (np.abs(slid) > SLIDES_M) & np.isfinite(ratio[after])
        slides += int(sliding.sum())
        wrong += int((sliding & (ratio[after] * np.sign(slid) < CLEAR_SHARE)).sum())
    return wrong, slides


def moment_left(robot: RollingRobot, postures: Sequence[Posture], gravity_mps2: Array) -> float:
    """Return the largest moment left at any joint by the complete balance under the postures' own tensions.

    Args:
        robot: whose postures they are; rigid links.
        postures: at rest.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].

    Returns:
        The moment [N m].
    """
    chain = rolling_chain(robot)
    acting = loads(chain, np.asarray(gravity_mps2, dtype=float))
    nothing = np.zeros((chain.pulled, chain.joints, chain.joints))
    left = 0.0
    for posture in postures:
        at_joint = np.nan_to_num(posture.tendon_tension)
        tension = rods.Tensions(at_joint=at_joint, above=at_joint, slope=nothing)
        balance = reactions(chain, posture.joint_angles, tension, acting)
        left = max(left, float(np.abs(balance.unbalanced).max()))
    return left


def _theta(postures: Sequence[Posture]) -> Array:
    return np.array([posture.joint_angles for posture in postures])


def _length_beyond(chain: RollingChain, theta: Array) -> Array:
    """Return each pulled rod's length in the gaps beyond each link but the last, shape (r, t, n - 1) [m]."""
    length = np.where(chain.passes, rods.spans(chain, theta).length, 0.0)[:, : chain.pulled]
    return np.cumsum(length[:, :, ::-1], axis=2)[:, :, ::-1][:, :, 1:]
