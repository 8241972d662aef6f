"""A chain in the arrays of the loops in `rolling_kernel`."""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.rolling.forces.rolling_kernel import CLEARANCE, LENGTH, MOUTH, OFFSET, SINK
from catheter_sim.kinds.rolling.theory.chain import RollingChain


def pack(chain: RollingChain) -> tuple[Array, Array]:
    """Return `chain` in the loops' arrays: `joint`, shape (n, 10), and `rod`, shape (n, m, 6)."""
    joint = np.stack(
        [
            chain.radius_positive,
            chain.radius_negative,
            chain.line,
            chain.link_length,
            chain.rest_angle,
            chain.sleeve_stiffness,
            chain.cubic,
            chain.quintic,
            chain.low,
            chain.high,
        ],
        axis=1,
    )
    rod = np.stack(
        [
            np.where(chain.passes, chain.stiffness[:, None], 0.0),
            chain.rest_curvature,
            chain.offset,
            chain.mouth,
            chain.countersink,
            chain.side * chain.clearance,
        ],
        axis=2,
    )
    return joint, np.ascontiguousarray(rod.transpose(1, 0, 2))


def pack_holes(chain: RollingChain) -> Array:
    """Return what the turns need of the pulled rods' holes, shape (t, 4, n) [m].

    That is the lines along which a rod lies in the bent and in the straight hole, `offset` plus and minus
    `clearance`, the mouth below the gap, and the countersink's depth below the next link's top.
    """
    joint, rod = pack(chain)
    pulled = rod[:, : chain.pulled]
    near = pulled[:, :, OFFSET] + pulled[:, :, CLEARANCE]
    far = pulled[:, :, OFFSET] - pulled[:, :, CLEARANCE]
    top = joint[:, LENGTH, np.newaxis] - pulled[:, :, SINK]
    return np.ascontiguousarray(np.stack([near, far, pulled[:, :, MOUTH], top]).transpose(2, 0, 1))
