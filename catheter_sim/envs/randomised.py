"""Settings of a robot that are drawn at random within bounds, at every reset of an environment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from catheter_sim.envs.arguments import checked_pair
from catheter_sim.errors import InputError, shown

Randomised = Mapping[str, tuple[float, float]]  # dotted key of a setting -> bounds, in the key's unit
RANDOMISED = "randomised"  # what errors call such a setting


def check_randomised(randomised: Any) -> Randomised:
    """Return the bounds, least first; none where None is given.

    Raises:
        InputError: they are no mapping of keys to two finite numbers in order.
    """
    if randomised is None:
        return {}
    if not isinstance(randomised, Mapping):
        raise InputError(
            f"{RANDOMISED} = {shown(randomised)}: a mapping of keys to bounds is needed, as in "
            "{'friction.mu': (0.1, 0.5)}"
        )
    needed = "two finite numbers, least first, are needed; values are drawn evenly between them"
    for name in randomised:
        if not isinstance(name, str) or "=" in name or not name.isprintable():
            raise InputError(f"{RANDOMISED}: {shown(name)}: a dotted key is needed, as in friction.mu")
    return {name: checked_pair(f"{RANDOMISED} {name}", item, needed) for name, item in randomised.items()}


def drawn_settings(randomised: Randomised, rng: np.random.Generator) -> dict[str, float]:
    """Return the settings, each value drawn evenly within its bounds."""
    return {name: float(rng.uniform(*bounds)) for name, bounds in randomised.items()}


def end_settings(randomised: Randomised, which: int) -> dict[str, float]:
    """Return the settings with all lower bounds (0) or all upper ones (1)."""
    return {name: bounds[which] for name, bounds in randomised.items()}
