"""Groups of rows along a coordinate."""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.thresholds import ROWS_IN_BIN


def groups_of(coordinate: Array, bins: int) -> np.ndarray:
    """Return the number of each row's group: equal values together, groups about equally full."""
    distinct = np.unique(coordinate)
    if len(distinct) <= 3:
        return np.searchsorted(distinct, coordinate)
    count = max(1, min(bins, len(coordinate) // ROWS_IN_BIN))
    edges = np.unique(np.quantile(coordinate, np.linspace(0.0, 1.0, count + 1)[1:-1]))
    return np.unique(np.searchsorted(edges, coordinate, side="right"), return_inverse=True)[1]
