"""What a rod does to a link in the balance of chest_tube_2025: as printed, and by its spans.

Forces are in the link's plane, in its own frame: x toward positive bending, z along the link, places
from the joint's line. Configurations are a batch of b.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import exprel

from catheter_sim.arrays import Array
from catheter_sim.kinds.rolling.theory import rods
from catheter_sim.kinds.rolling.theory.chain import RollingChain
from catheter_sim.kinds.rolling.theory.joint import active_radius, span
from catheter_sim.kinds.rolling.theory.varied import Varied, constant, single


@dataclass(frozen=True)
class RodTensions:
    """Tensions of the rods, shapes (b, t, n): Eqs 1, 5, and N of Eq. 7 with its sign in the plane."""

    below: Varied
    above: Varied
    normal: Varied


def rod_tensions(chain: RollingChain, theta: Array, drive: Array) -> RodTensions:
    """Return the rods' tensions and normal forces under loading, at the bend angles `theta` (b, n) [rad]."""
    b, n, t = len(theta), chain.joints, chain.pulled
    turn, turn_slope = (item[:, :t] for item in rods.turns(chain, theta))
    # Toward the rod's own side; in the neutral plane toward the side to which the rod turns.
    side = np.where(chain.side[:t] == 0.0, np.where(turn < 0.0, -1.0, 1.0), chain.side[:t])
    phi, phi_slope = side * turn, side * turn_slope
    mu = chain.mu
    below, above, normal = (Varied(np.zeros((b, t, n)), np.zeros((b, t, n, n))) for _ in range(3))
    now, slope = np.asarray(drive, dtype=float), np.zeros((b, t, n))
    for k in range(n):
        now = np.where(chain.passes[:t, k], now, 0.0)
        slope = np.where(chain.passes[:t, k, None], slope, 0.0)
        below.value[:, :, k], below.slope[:, :, k] = now, slope
        factor = np.exp(-mu * phi[:, :, k])
        per_tension = side[:, :, k] * phi[:, :, k] * exprel(-mu * phi[:, :, k])  # Eq. 7; phi at mu = 0
        normal.value[:, :, k], normal.slope[:, :, k] = now * per_tension, slope * per_tension[..., None]
        normal.slope[:, :, k, k] += side[:, :, k] * now * factor * phi_slope[:, :, k]
        now, slope = now * factor, slope * factor[..., None]
        slope[..., k] -= mu * phi_slope[:, :, k] * now
        above.value[:, :, k], above.slope[:, :, k] = now, slope
    return RodTensions(below, above, normal)


# Where a force acts in a link's plane, x and z from its line, and the force across and along the link.
LinkForceInPlane = tuple[Varied, Varied, Varied, Varied]


def hole_on_link(chain: RollingChain, tension: RodTensions, r: int, k: int) -> Iterator[LinkForceInPlane]:
    """Yield N and f at the hole's middle (Eqs 6, 7, 18, 22) and F^t at the top where the rod ends (21)."""
    below, above = _pick(tension.below, r, k), _pick(tension.above, r, k)
    b, n = below.slope.shape
    x = constant(chain.offset[r, k], b, n)
    top = chain.link_length[k] - chain.countersink[r, k]
    yield x, constant(0.5 * (chain.mouth[r, k] + top), b, n), _pick(tension.normal, r, k), above - below
    if chain.last[r] == k + 1:
        nothing = constant(0.0, b, n)
        yield x, constant(top, b, n), nothing, nothing - above


def spans_on_link(
    chain: RollingChain, theta: Array, tension: RodTensions, r: int, k: int
) -> Iterator[LinkForceInPlane]:
    """Yield the rod's tension along the span below, at link k's own mouth, and along the span above."""
    b, n = theta.shape
    nothing = constant(0.0, b, n)
    across, along = _direction(chain, theta, r, k)
    sine, cosine = np.sin(theta[:, k]), np.cos(theta[:, k])
    turn_sine, turn_cosine = single(sine, cosine, k, n), single(cosine, -sine, k, n)
    pull = nothing - _pick(tension.below, r, k)
    to_x = pull * (across * turn_cosine - along * turn_sine)
    to_z = pull * (across * turn_sine + along * turn_cosine)
    yield constant(chain.offset[r, k], b, n), constant(chain.mouth[r, k], b, n), to_x, to_z
    if chain.last[r] > k + 1:
        across, along = _direction(chain, theta, r, k + 1)
        pull = _pick(tension.below, r, k + 1)
        same_plane = chain.axis[k] == chain.axis[k + 1]
        x = constant(chain.position[r, k + 1, chain.axis[k]] - chain.line[k], b, n)
        z = constant(chain.link_length[k] - chain.countersink[r, k + 1], b, n)
        yield x, z, pull * across if same_plane else nothing, pull * along


def _direction(chain: RollingChain, theta: Array, r: int, k: int) -> tuple[Varied, Varied]:
    """Return the direction of a rod's span at joint k, in the frame of the link below."""
    angle = theta[:, k]
    radius = active_radius(angle, chain.radius_positive[k], chain.radius_negative[k])
    line = span(angle, radius, chain.offset[r, k], chain.mouth[r, k], chain.countersink[r, k])
    x, z = line.across / line.length, line.along / line.length
    x_slope = (line.along - chain.countersink[r, k] - x * line.slope) / line.length
    z_slope = (line.along_slope - z * line.slope) / line.length
    n = chain.joints
    return single(x, x_slope, k, n), single(z, z_slope, k, n)


def _pick(item: Varied, r: int, k: int) -> Varied:
    return Varied(item.value[:, r, k], item.slope[:, r, k])
