"""A value per configuration with its derivative by every bend angle, for balances written term by term."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array


@dataclass(frozen=True)
class Varied:
    """A value per configuration and its derivative by the bend angles, shapes (b, ...) and (b, ..., n)."""

    value: Array
    slope: Array

    def __add__(self, other: Varied) -> Varied:
        return Varied(self.value + other.value, self.slope + other.slope)

    def __sub__(self, other: Varied) -> Varied:
        return Varied(self.value - other.value, self.slope - other.slope)

    def __mul__(self, other: Varied) -> Varied:
        return Varied(
            self.value * other.value,
            self.value[..., None] * other.slope + other.value[..., None] * self.slope,
        )


def constant(value: float, b: int, n: int) -> Varied:
    """Return a value that depends on no joint."""
    return Varied(np.full(b, value), np.zeros((b, n)))


def single(value: Array, slope: Array, k: int, n: int) -> Varied:
    """Return a value that depends on joint k alone."""
    slopes = np.zeros((len(value), n))
    slopes[:, k] = slope
    return Varied(np.array(value), slopes)
