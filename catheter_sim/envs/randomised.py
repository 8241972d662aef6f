"""Settings of a robot that are drawn at random within bounds, at every reset of an environment."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from catheter_sim.errors import InputError

Randomised = Mapping[str, tuple[float, float]]  # dotted key of `--set` -> bounds, in the key's unit


def check_randomised(randomised: Mapping[str, Sequence[float]]) -> Randomised:
    """Return the bounds, least first.

    Raises:
        InputError: they are no two finite numbers in order.
    """
    checked = {}
    for name, bounds in randomised.items():
        try:
            low, high = (float(value) for value in bounds)
        except (TypeError, ValueError):
            low, high = math.nan, math.nan
        if not (math.isfinite(low) and math.isfinite(high) and low <= high):
            raise InputError(f"randomised {name} = {bounds!r}: two finite numbers, least first, are needed")
        checked[name] = low, high
    return checked


def drawn_settings(randomised: Randomised, rng: np.random.Generator) -> list[str]:
    """Return texts `KEY=VALUE`, each value drawn evenly within its bounds."""
    return [f"{name}={float(rng.uniform(*bounds))!r}" for name, bounds in randomised.items()]


def end_settings(randomised: Randomised, which: int) -> list[str]:
    """Return texts `KEY=VALUE` with all lower bounds (0) or all upper ones (1)."""
    return [f"{name}={bounds[which]!r}" for name, bounds in randomised.items()]
