"""Types of arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]
# Of what picks from other arrays in the innermost loops: with signed numbers each pick would first have to
# ask whether it counts from the end.
Places = NDArray[np.uint64]
