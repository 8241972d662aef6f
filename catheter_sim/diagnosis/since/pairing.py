"""Which rows of two recordings pair: the same command, come to on the same way.

Differences of paired rows cancel whatever both recordings share, named or not. Where a trial begins as one of
the other recording did, the whole way was the same. Elsewhere rows pair by their inputs and by the directions
in which these were going: the way since the last turn stands for the history.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Array
from catheter_sim.diagnosis.data.trials import Dataset, all_inputs
from catheter_sim.diagnosis.residuals.turning import turning_points
from catheter_sim.diagnosis.thresholds import PAIR_SHARE


@dataclass(frozen=True)
class Pairs:
    """What the rows of a trial pair with.

    Attributes:
        error: mean error of the other recording's paired rows, shape (r, o); NaN where there are none.
        spread: mean square of these rows' errors about their mean, of single rows, shape (r, o); NaN with
            fewer than two.
        count: how many rows each pairs with, shape (r,).
    """

    error: Array
    spread: Array
    count: np.ndarray


def paired(inputs: Inputs, others: Sequence[Inputs], errors: Sequence[Array]) -> Pairs:
    """Return what the rows of one trial pair with in another recording.

    Args:
        inputs: of the trial.
        others: of the other recording's trials.
        errors: theirs, shape (r, o) each; NaN where missing.
    """
    rows, outputs = len(inputs), errors[0].shape[1]
    unknown = np.full((rows, outputs), np.nan)
    found = Pairs(unknown, unknown.copy(), np.zeros(rows, dtype=int))
    everything = np.concatenate([all_inputs(item) for item in (inputs, *others)])
    scale = np.maximum(np.ptp(everything, axis=0), 1e-300)
    mine = all_inputs(inputs) / scale
    theirs = [all_inputs(item) / scale for item in others]
    common = [_same_beginning(mine, item) for item in theirs]
    heading = _headings(mine)
    other_heading = np.concatenate([_headings(item) for item in theirs])
    stacked, stacked_errors = np.concatenate(theirs), np.concatenate(list(errors))
    start = np.cumsum([0, *(len(item) for item in theirs)])
    for row in range(rows):
        whole = [int(start[k]) + row for k, length in enumerate(common) if row < length]
        if whole:
            partners = np.array(whole)
        else:
            near = (np.abs(stacked - mine[row]) <= PAIR_SHARE).all(axis=1)
            partners = np.flatnonzero(near & (other_heading * heading[row] >= 0.0).all(axis=1))
        values = stacked_errors[partners]
        known = np.isfinite(values)
        if known.any():
            number = known.sum(axis=0)
            mean = np.where(known, values, 0.0).sum(axis=0) / np.maximum(number, 1)
            found.error[row] = np.where(number > 0, mean, np.nan)
            about = np.where(known, values - mean, 0.0)
            square = (about**2).sum(axis=0) / np.maximum(number - 1, 1)
            found.spread[row] = np.where(number > 1, square, np.nan)
            found.count[row] = len(partners)
    return found


def share_paired(later: Dataset, earlier: Dataset) -> float:
    """Return the share of the later recording's rows that pair with rows of the earlier one."""
    others = [trial.inputs for trial in earlier.trials]
    errors = [np.zeros((len(item), 1)) for item in others]
    counts = [paired(trial.inputs, others, errors).count for trial in later.trials]
    return float(np.mean(np.concatenate(counts) > 0))


def _same_beginning(first: Array, second: Array) -> int:
    """Return how many rows from the start have the same inputs."""
    length = min(len(first), len(second))
    apart = (np.abs(first[:length] - second[:length]) > PAIR_SHARE).any(axis=1)
    return int(np.argmax(apart)) if apart.any() else length


def _headings(rows: Array) -> Array:
    """Return the direction of motion of each input at each row, shape (r, c); 0 where it never moves."""
    return np.stack([turning_points(values)[0] for values in rows.T], axis=1)
