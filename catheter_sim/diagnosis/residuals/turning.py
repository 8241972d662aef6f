"""Where a series turns round, and how far it has gone since."""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.thresholds import REVERSAL_SHARE


def turning_points(values: Array) -> tuple[Array, Array]:
    """Return the direction of motion (-1, 1) and the signed way since the last turning point.

    Moves back by less than 2 % of the range are no turning point. Both have the shape of `values`;
    the way has its unit. At the very start the direction is that of the first true move.
    """
    least = REVERSAL_SHARE * float(np.ptp(values)) if len(values) else 0.0
    direction = np.zeros(len(values))
    way = np.zeros(len(values))
    sign, turn, extreme = 0.0, 0, 0
    for row, value in enumerate(values):
        if sign == 0.0:
            if abs(value - values[0]) > least:
                sign = float(np.sign(value - values[0]))
                direction[:row] = sign
                extreme = row
        elif sign * (value - values[extreme]) >= 0.0:
            extreme = row
        elif sign * (values[extreme] - value) > least:
            turn, sign = extreme, -sign
            direction[turn + 1 : row] = sign
            way[turn + 1 : row] = values[turn + 1 : row] - values[turn]
            extreme = row
        direction[row] = sign
        way[row] = value - values[turn]
    return direction, way
