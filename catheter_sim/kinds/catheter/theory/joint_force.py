"""The tendon's tension at a bending joint's angle, loading and unloading (Nayar 2023, Algorithm 2).

Degrees and newtons, as printed. Loading is a cubic; unloading is the cubic over c_1, times an inverse
tangent of (angle / (b_ul + 0.01))^c_2, b_ul the angle at which unloading began.

Readings. Hyperbolic or circular? The text says tanh^-1, Algorithm 2 prints tan^-1. It is tanh^-1: with
the printed c_2 of 0.01 to 0.05 the power lies just below 1 everywhere, where tan^-1 is 0.78 throughout,
so that unloading would drop by four fifths at once and c_2 would do nothing; tanh^-1 leaves the loading
curve near b_ul and falls to about half of it, as the text says of the profile. The printed RMSE (0.13,
0.24 N) admits no drop of 9 N. Within some 3 % of b_ul tanh^-1 runs above the loading curve (its pole is
at b_ul + 0.01): there the smaller of the two is taken.

c_1 and c_2 are chosen by b_ul, not by the angle as printed: the text says that the curve depends on the
final angle, and one unloading is then continuous.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from catheter_sim.arrays import Array


@dataclass(frozen=True)
class JointForce:
    """Parameters of Algorithm 2."""

    loading: tuple[float, float, float, float]  # p_0 to p_3: [N], [N/deg] ...
    bounds_deg: tuple[float, float]  # p_4, p_5
    c_1: tuple[float, float, float]  # p_6, p_8, p_10
    c_2: tuple[float, float, float]  # p_7, p_9, p_11


PROXIMAL = JointForce(
    (-0.61, 0.18, -1.29e-5, -5.25e-6), (40.06, 61.03), (4.08, 5.26, 4.70), (0.02, 0.01, 0.03)
)
DISTAL = JointForce((-0.09, 0.17, -5.02e-4, -2.12e-7), (40.0, 64.50), (4.0, 5.26, 5.54), (0.05, 0.01, 0.01))

LAWS = {"measured_proximal": PROXIMAL, "measured_distal": DISTAL}  # by a segment's `resistance`


def loading_N(law: JointForce, angle_deg: ArrayLike) -> Array:
    """Return the tension that bends the joint further, same shape [N]; never below zero."""
    return np.maximum(np.polynomial.polynomial.polyval(np.asarray(angle_deg, float), law.loading), 0.0)


def unloading_N(law: JointForce, angle_deg: ArrayLike, turn_deg: ArrayLike) -> Array:
    """Return the tension at which the joint, let go at `turn_deg`, comes back, shapes broadcast [N]."""
    return np.minimum(unloading_unbounded_N(law, angle_deg, turn_deg), loading_N(law, angle_deg))


def unloading_unbounded_N(
    law: JointForce, angle_deg: ArrayLike, turn_deg: ArrayLike, hyperbolic: bool = True
) -> Array:
    """Return the unloading curve alone, with tanh^-1 or with the tan^-1 that Algorithm 2 prints."""
    angle, turn = np.asarray(angle_deg, dtype=float), np.asarray(turn_deg, dtype=float)
    piece = np.searchsorted(law.bounds_deg, turn)
    power = (np.clip(angle, 0.0, turn) / (turn + 0.01)) ** np.take(law.c_2, piece)
    inverse = np.arctanh if hyperbolic else np.arctan
    return loading_N(law, angle) / np.take(law.c_1, piece) * inverse(power)
