"""How a number went over several recordings: it stayed, stepped once, or drifted.

Three simple courses are laid through its changes since the first recording, taken to be equally far apart in
the order given: none, one step to another level, and a straight line from the first recording. Of a step and
a line each has one number, so that the better one is the one that misses by less.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.thresholds import COMMON_SHARE, COURSE_MISSED, COURSE_SURER

STEADY, STEP, DRIFT, OPEN, IRREGULAR = "steady", "step", "drift", "step or drift", "irregular"


@dataclass(frozen=True)
class Course:
    """How a number went over recordings.

    Attributes:
        kind: `STEADY`; `STEP`; `DRIFT`; `OPEN`: either; `IRREGULAR`: it changed in another way.
        after: of a step, the number from 0 of the recording after which it came; else None.
    """

    kind: str
    after: int | None = None


def course_of(change: Array, deviation: Array) -> Course:
    """Return how a number went.

    Half of each variance is taken to be the first recording's, which all changes share (`COMMON_SHARE`).

    Args:
        change: of each later recording since the first, shape (n,).
        deviation: standard deviation of each, shape (n,).
    """
    if not (np.isfinite(change).all() and np.isfinite(deviation).all()):
        return Course(OPEN)
    rounding = 1e-12 * float(np.abs(change).max())
    spread = np.maximum(deviation, max(rounding, 1e-300))
    own = (1.0 - COMMON_SHARE) * np.diag(spread**2)
    precision = np.asarray(np.linalg.inv(own + COMMON_SHARE * np.outer(spread, spread)), dtype=float)
    count = len(change)
    steps = [_missed(change, (np.arange(count) >= k).astype(float), precision) for k in range(count)]
    line = _missed(change, np.arange(1.0, count + 1.0), precision)
    still = float(change @ precision @ change)
    if still - min(*steps, line) < COURSE_SURER:
        return Course(STEADY)
    if min(*steps, line) > float(chi2.ppf(1.0 - COURSE_MISSED, max(count - 1, 1))):
        return Course(IRREGULAR)
    if abs(min(steps) - line) < COURSE_SURER:
        return Course(OPEN)
    return Course(STEP, int(np.argmin(steps))) if min(steps) < line else Course(DRIFT)


def _missed(change: Array, shape: Array, precision: Array) -> float:
    """Return the weighed square by which a course of a given shape, of the best size, misses."""
    size = float(shape @ precision @ change) / float(shape @ precision @ shape)
    left = change - size * shape
    return float(left @ precision @ left)
