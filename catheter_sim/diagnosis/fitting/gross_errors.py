"""Huber's loss: beyond a size an error counts by its size, no longer by its square."""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.thresholds import GROSS_ERROR


def tempered(error: Array) -> Array:
    """Return errors in weights so that their squares are Huber's loss, linear beyond `GROSS_ERROR`."""
    size = np.abs(error)
    root = np.sqrt(np.maximum(2.0 * size - GROSS_ERROR, 0.0) * GROSS_ERROR)
    return np.where(size > GROSS_ERROR, np.copysign(root, error), error)


def untempered(residual: Array) -> Array:
    """Return the errors that `tempered` made the residuals of, same shape."""
    size = np.abs(residual)
    return np.where(
        size > GROSS_ERROR, np.copysign((residual**2 / GROSS_ERROR + GROSS_ERROR) / 2.0, residual), residual
    )
