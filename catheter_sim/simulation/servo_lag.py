"""A servo that follows its command by a first-order lag, step by step."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array


class ServoLag:
    """What a servo does with commands that are set once a step."""

    def __init__(self, lag_s: float, step_s: float, start: Array | None = None) -> None:
        """Prepare; `start`: where the servo is, shape (t,); without a lag commands arrive at once."""
        self._left = math.exp(-step_s / lag_s) if lag_s > 0.0 else 0.0
        self._now = None if start is None else np.array(start, dtype=float)

    def arriving(self, command: Array) -> Array:
        """Return what arrives in the coming step of a command, shape (t,)."""
        if self._left == 0.0 or self._now is None:
            return command
        self._now = command + (self._now - command) * self._left
        return self._now
