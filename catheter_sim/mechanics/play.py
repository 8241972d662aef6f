"""The play: what follows with a dead-band, and stands still after each reversal until that is crossed.

The output follows y = clip(y_before, u - width / 2, u + width / 2), Krasnosel'skii's play operator (Nayar
2022, Eqs 29-31). Between two rows the input moves one way, so that the rows alone decide.
"""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.mechanics.compiled import compiled


@compiled
def played(before, value, half):
    """Return where a play is that was at `before`, when its input has come to `value`; `half` its width."""
    return min(max(before, value - half), value + half)


@compiled
def _series(values, half, rest, result):
    """Set `result` (r, t) to the outputs of plays along `values` (r, t) from `rest` (t,)."""
    for column in range(values.shape[1]):
        now = rest[column]
        for row in range(values.shape[0]):
            now = played(now, values[row, column], half[column])
            result[row, column] = now


def play(values: Array, width: float | Array, rest: Array | None = None) -> Array:
    """Return the output of plays along their inputs, same shape.

    Args:
        values: inputs, row by row, shape (r, t).
        width: of the whole dead-band, or one for each column, 0 or more, in the unit of `values`.
        rest: where input and output are before the first row, shape (t,); by default at zero.
    """
    count = values.shape[1]
    half = 0.5 * np.broadcast_to(np.asarray(width, dtype=float), (count,))
    start = np.zeros(count) if rest is None else np.asarray(rest, dtype=float)
    result = np.empty(values.shape)
    _series(np.ascontiguousarray(values, dtype=float), half, start, result)
    return result


def play_step(before: Array, value: Array, width: float | Array) -> Array:
    """Return the outputs of plays that were at `before` when their inputs come to `value`, shape (..., t)."""
    half = 0.5 * np.asarray(width)
    return np.minimum(np.maximum(before, value - half), value + half)


def plays(values: Array, thresholds: Array) -> Array:
    """Return the outputs of several plays of one input, from rest at zero, shape (r, k).

    Args:
        values: the input, row by row, shape (r,).
        thresholds: half of each play's width, shape (k,).
    """
    return play(np.repeat(values[:, np.newaxis], len(thresholds), axis=1), 2.0 * thresholds)
