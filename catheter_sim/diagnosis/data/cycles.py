"""Where a trial returns to rest: its cycles."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Array
from catheter_sim.diagnosis.data.trials import Trial
from catheter_sim.diagnosis.thresholds import MOST_PRETENSION_SHARE, PEAK_SHARE, VALLEY_SHARE


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
