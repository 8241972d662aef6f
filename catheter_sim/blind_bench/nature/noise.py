"""Noise as trackers make it: white, coloured, with outliers, quantised."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from catheter_sim.arrays import Array

# How many of a hundred data sets have it.
KINDS: Mapping[str, int] = {"white": 60, "coloured": 15, "outliers": 13, "quantised": 12}
MOST_MISSING = 0.01  # share of the cells
_OUTLIERS = 0.01  # share of the rows
_OUTLIER_SIZE = (5.0, 12.0)  # times the noise
_CORRELATION = (0.3, 0.7)  # from row to row
_STEP = (0.8, 1.6)  # of a quantised reading, times the noise


def drawn_kind(generator: np.random.Generator) -> str:
    """Return a kind of noise."""
    share = np.array(list(KINDS.values()), dtype=float)
    return str(generator.choice(list(KINDS), p=share / share.sum()))


def measured(clean: Array, size: Array, kind: str, generator: np.random.Generator) -> Array:
    """Return outputs (r, o) with noise of a kind; some cells are missing (NaN).

    Args:
        clean: without noise.
        size: standard deviation of each column, shape (o,).
        kind: one of `KINDS`.
        generator: draws it.
    """
    noisy = clean + size * standard(clean.shape, kind, generator)
    if kind == "quantised":
        step = generator.uniform(*_STEP) * size
        noisy = np.round(noisy / step) * step
    missing = generator.random(clean.shape) < generator.uniform(0.0, MOST_MISSING)
    return np.where(missing, np.nan, noisy)


def standard(shape: tuple[int, ...], kind: str, generator: np.random.Generator) -> Array:
    """Return noise of standard deviation one (outliers come on top), before it is quantised.

    Coloured: e_k = rho e_(k-1) + sqrt(1 - rho^2) w_k, stationary from the first row.
    """
    white = generator.normal(size=shape)
    if kind == "coloured":
        return coloured(white, generator.uniform(*_CORRELATION))
    if kind == "outliers":
        rows = generator.random(shape[0]) < _OUTLIERS
        white[rows] *= generator.uniform(*_OUTLIER_SIZE, (int(rows.sum()), *(1,) * (len(shape) - 1)))
    return white


def coloured(white: Array, rho: float) -> Array:
    """Return white noise (r, ...) coloured to a correlation `rho` from row to row, of the same size."""
    found = np.array(white)
    for row in range(1, len(found)):
        found[row] = rho * found[row - 1] + np.sqrt(1.0 - rho**2) * white[row]
    return found
