"""Numbers of an anatomy from their ranges: drawn, or in the middle."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

Ranges = Mapping[str, tuple[float, float]]  # name of a number -> its least and largest value, SI units


def drawn(ranges: Ranges, rng: np.random.Generator) -> dict[str, float]:
    """Return every number drawn evenly from its range, in the order of `ranges`."""
    return {name: float(rng.uniform(*bounds)) for name, bounds in ranges.items()}


def middles(ranges: Ranges) -> dict[str, float]:
    """Return every number in the middle of its range."""
    return {name: 0.5 * (low + high) for name, (low, high) in ranges.items()}
