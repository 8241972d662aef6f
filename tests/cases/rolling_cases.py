"""Inputs and reference values that the tests of rolling joints share."""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs

NO_GRAVITY = np.zeros(3)
HANGING = np.array([0.0, 0.0, 9.81])

# The tables below are those of a quasi-static model of the section that was written independently of
# this package, rows in order with their history.
# theta [rad] -> dl/dtheta [mm], theta (1/s_l + 1/s_r) [1/mm], phi [rad] of an odd and an even joint.
JOINT_TABLE = {
    -0.1: ((-3.2160, -0.8016, -0.0056), (-1.6646, -0.5016, -0.0090)),
    0.0: ((-3.0000, 0.0000, 0.0852), (-1.0000, 0.0000, 0.0879)),
    0.1: ((-2.3107, 0.5016, 0.1789), (-0.7660, 0.8016, 0.1856)),
    0.2: ((-1.5481, 1.2095, 0.2746), (-0.5069, 2.8469, 0.2836)),
    0.3: ((-0.6429, 3.6390, 0.3713), (-0.1990, 10.9975, 0.3817)),
}
# tension [N] -> body_15 x, z, body_6 x, z without weight and body_15 x, z with weight (0, 0, +9.81) [mm].
SHAPE_TABLE = (
    (0, (0.000, 225.000, 0.000, 90.000), (-0.039, 225.003)),
    (5, (91.537, 200.332, 19.199, 87.455), (81.290, 205.499)),
    (20, (169.541, 105.156, 42.236, 77.184), (164.813, 115.795)),
    (50, (173.151, 25.435, 54.564, 66.762), (173.678, 31.767)),
    (40, (172.823, 27.666, 53.711, 67.450), (173.233, 34.202)),
    (20, (169.814, 54.768, 45.742, 74.178), (168.533, 64.268)),
    (35, (172.598, 41.856, 50.394, 70.781), (172.364, 49.948)),
    (5, (118.878, 174.580, 21.412, 86.736), (107.045, 184.388)),
    (0, (0.000, 225.000, 0.000, 90.000), (-0.039, 225.003)),
)


def pulls(tension: object, force_tip: object = None, moment_tip: object = None) -> Inputs:
    """Return rows of tensions, shape (r,) or (r, t) [N], with a tip load that is the same in all."""
    table = np.asarray(tension, dtype=float)
    table = table[:, None] if table.ndim == 1 else table
    rows = len(table)

    def every(vector: object) -> Array:
        return np.tile(np.zeros(3) if vector is None else np.asarray(vector, dtype=float), (rows, 1))

    return Inputs(np.arange(float(rows)), "tension", table, every(force_tip), every(moment_tip))
