"""Where a trial returns to rest: its cycles; and the stretches of its rows that err together."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.data.trials import Trial, measured_from
from catheter_sim.diagnosis.thresholds import (
    CLOCK_ROUNDING,
    FOLDS,
    LEAST_BLOCK_S,
    MOST_PRETENSION_SHARE,
    PEAK_SHARE,
    VALLEY_SHARE,
)


def cycles(trial: Trial) -> list[slice]:
    """Return the stretches of rows between returns to near rest, in order; together all rows.

    What counts is the pull: the largest tension, or positive displacement, of any tendon, or a load
    on the tip, as a share of the trial's largest. A tendon cannot push, so a displacement below zero
    is rest, unless the trial has hardly any other; a standing pretension is rest too. Rows are cut
    at the last row of a valley that lies below a quarter of the peaks before and after it.
    """
    pull = _pull(trial.inputs)
    starts = [0]
    peak, valley, low_row = 0.0, math.inf, 0
    for row, value in enumerate(pull):
        if peak >= PEAK_SHARE and value <= VALLEY_SHARE * peak and value <= valley:
            valley, low_row = value, row
        elif valley < math.inf and value >= max(valley / VALLEY_SHARE, PEAK_SHARE):
            starts.append(low_row)
            peak, valley = value, math.inf
        if valley == math.inf:
            peak = max(peak, value)
    return [slice(start, end) for start, end in zip(starts, [*starts[1:], len(pull)], strict=True)]


def stretch_of(trials: Sequence[Trial], moving: bool, fewest: int = 2 * FOLDS) -> list[np.ndarray]:
    """Return the stretch of each row of each trial, counted over all trials, shape (r,) each.

    Of held rows a stretch is a whole cycle. Where there are fewer cycles than `fewest`, they are cut into
    parts of equal length. Of a robot in motion stretches are equally long (`equal_stretches`).
    """
    stretches = [
        (index, part)
        for index, trial in enumerate(trials)
        for part in (equal_stretches(trial) if moving else cycles(trial))
    ]
    if moving:
        fewest = len(stretches)
    pieces = -(-fewest // max(len(stretches), 1))
    labels = [np.zeros(len(trial.inputs), dtype=int) for trial in trials]
    count = 0
    for index, part in stretches:
        rows = np.arange(part.start, part.stop)
        shortest = 4 if len(rows) >= fewest else 1
        for piece in np.array_split(rows, min(pieces, max(1, len(rows) // shortest))):
            labels[index][piece] = count
            count += 1
    return labels


def equal_stretches(trial: Trial) -> list[slice]:
    """Return stretches of a trial in motion, measured alike long, none shorter than `LEAST_BLOCK_S`.

    Rows before the first measured one belong to the first stretch.
    """
    time_s = trial.inputs.time_s
    begun_s = time_s[measured_from(trial)]
    count = max(1, int((time_s[-1] - begun_s) / LEAST_BLOCK_S + CLOCK_ROUNDING))
    ends = np.searchsorted(time_s, np.linspace(begun_s, time_s[-1], count + 1)[1:-1])
    return [slice(int(a), int(b)) for a, b in pairwise((0, *ends, len(time_s))) if b > a]


def _pull(inputs: Inputs) -> Array:
    """Return how far the robot is from rest, shape (r,), as a share of the trial's largest pull."""
    tendon = np.maximum(inputs.tendon, 0.0)
    if tendon.max(initial=0.0) < 0.1 * np.abs(inputs.tendon).max(initial=0.0):
        tendon = np.abs(inputs.tendon)
    total = np.zeros(len(inputs))
    for values in (tendon, np.abs(inputs.force_tip), np.abs(inputs.moment_tip)):
        largest = values.max(initial=0.0)
        if largest > 0.0:
            total = np.maximum(total, values.max(axis=1) / largest)
    rest = float(np.quantile(total, 0.1)) if len(total) else 0.0
    if rest > MOST_PRETENSION_SHARE:
        return total  # the robot never rests; what is low here is no rest
    return (total - rest) / (1.0 - rest)  # below zero where even the pretension is gone
