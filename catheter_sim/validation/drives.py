"""Histories of inputs that the checks use, and what the checks measure on the answers."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Posture

NO_GRAVITY = np.zeros(3)


def history(corners: Sequence[Sequence[float]], step: float, actuation: str = "tension") -> Inputs:
    """Return inputs that run straight through `corners`, shape (c, t), in steps of at most `step`."""
    points = np.array(corners, dtype=float)
    rows = [points[0]]
    for start, end in itertools.pairwise(points):
        count = max(1, int(np.ceil(np.abs(end - start).max() / step - 1e-9)))
        rows += [start + (end - start) * i / count for i in range(1, count + 1)]
    return given(np.array(rows), actuation)


def given(rows: Array, actuation: str = "tension", force_tip: Array | None = None) -> Inputs:
    """Return inputs of the given rows, shape (r, t), one second apart."""
    nothing = np.zeros((len(rows), 3))
    return Inputs(
        np.arange(len(rows), dtype=float),
        actuation,
        np.array(rows, dtype=float),
        nothing if force_tip is None else force_tip,
        nothing,
    )


def tips_mm(postures: Sequence[Posture]) -> Array:
    """Return the tips of `postures`, shape (r, 3) [mm]."""
    return np.array([posture.p_w[-1] * 1e3 for posture in postures])


def largest_distance(a: Array, b: Array) -> float:
    """Return the largest distance between points of two histories, NaN where one is shorter [their unit]."""
    return float(np.linalg.norm(a - b, axis=1).max()) if len(a) == len(b) else float("nan")


def loop_area(x: Array, y: Array) -> float:
    """Return the area inside the closed curve through (x, y), shoelace formula."""
    return float(0.5 * abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1))))
