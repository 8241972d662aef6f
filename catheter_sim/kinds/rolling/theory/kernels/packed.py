"""A chain in the arrays of the compiled loops."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.rolling.theory.chain import RollingChain


@dataclass(frozen=True)
class Packed:
    """A chain as the compiled code takes it."""

    joint: Array
    rod: Array
    stiffness: Array
    pulled: int
    mu: float


def pack(chain: RollingChain) -> Packed:
    """Return `chain` in the compiled code's arrays."""
    joint = np.stack(
        [
            chain.axis.astype(float),
            chain.radius_positive,
            chain.radius_negative,
            chain.line,
            chain.link_length,
            1.0 / chain.link_stiffness,
            chain.rest_angle,
            chain.sleeve_stiffness,
            chain.cubic,
            chain.quintic,
            chain.low,
            chain.high,
        ],
        axis=1,
    )
    offset = np.where(chain.passes, chain.offset, np.nan)
    rod = np.stack(
        [
            offset,
            chain.mouth,
            chain.countersink,
            chain.side * chain.clearance,
            chain.rest_curvature,
            chain.position[:, :, 0],
            chain.position[:, :, 1],
        ],
        axis=2,
    )
    return Packed(joint, rod, chain.stiffness.copy(), chain.pulled, chain.mu)
