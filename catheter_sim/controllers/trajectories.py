"""Desired joint values over time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catheter_sim.arrays import Array


def ticks_s(duration_s: float, rate_hz: float) -> Array:
    """Return the ticks from 0 to the duration, shape (r,) [s]."""
    return np.arange(round(duration_s * rate_hz) + 1) / rate_hz


def through(corners: Sequence[float], legs_s: Sequence[float], at_s: Array) -> Array:
    """Return values that move from corner to corner in half waves of a cosine, at rest at each, shape (r,).

    Args:
        corners: in their unit, shape (c,).
        legs_s: time from each corner to the next, shape (c - 1,) [s].
        at_s: times, shape (r,) [s]; after the last corner the value stays there.
    """
    ends = np.cumsum(legs_s)
    leg = np.minimum(np.searchsorted(ends, at_s, side="right"), len(legs_s) - 1)
    length = np.asarray(legs_s, dtype=float)[leg]
    share = np.clip((at_s - (ends[leg] - length)) / length, 0.0, 1.0)
    corner = np.asarray(corners, dtype=float)
    return corner[leg] + (corner[leg + 1] - corner[leg]) * 0.5 * (1.0 - np.cos(np.pi * share))
