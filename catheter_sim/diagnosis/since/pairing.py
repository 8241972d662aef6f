"""Which rows of two recordings pair: the same command, come to on the same way.

Differences of paired rows cancel whatever both recordings share, named or not. Where a trial begins as one of
the other recording did, the whole way was the same. Elsewhere rows pair by their inputs and by the directions
in which these were going: the way since the last turn stands for the history. A row that the other recording
has not, but passed between two of its rows, pairs with the stretch between them: errors are taken to be
linear there. A robot that was measured while it moved has a state that no command tells: there a row pairs
with the same row of a trial that went the same way so far, within what motors do that follow one programme
twice; errors are those of the model under each one's own inputs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.data.trials import Dataset, all_inputs
from catheter_sim.diagnosis.residuals.turning import turning_points
from catheter_sim.diagnosis.thresholds import PAIR_SHARE, SAME_WAY_SHARE, STRETCH_SHARE


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


@dataclass(frozen=True)
class _Partners:
    """What one row pairs with.

    Attributes:
        error: of each partner, shape (p, o); NaN where missing.
        share: of one row's variance that each one's has, shape (p,): less between two rows.
    """

    error: Array
    share: Array


@dataclass(frozen=True)
class _Other:
    """The other recording, inputs over their ranges.

    Attributes:
        rows: inputs, shape (r, c).
        heading: direction of motion of each, shape (r, c).
        error: shape (r, o).
        ends: the rows at which a stretch from the row before ends, short enough to interpolate, shape (s,).
    """

    rows: Array
    heading: Array
    error: Array
    ends: np.ndarray

    def at(self, row: Array, heading: Array) -> _Partners:
        """Return the rows with the same inputs, come to in the same directions; else the stretches."""
        near = (np.abs(self.rows - row) <= PAIR_SHARE).all(axis=1)
        same = np.flatnonzero(near & (self.heading * heading >= 0.0).all(axis=1))
        if len(same):
            return _Partners(self.error[same], np.ones(len(same)))
        start, end = self.rows[self.ends - 1], self.rows[self.ends]
        way = end - start
        length = np.maximum((way**2).sum(axis=1), 1e-300)
        part = np.clip(((row - start) * way).sum(axis=1) / length, 0.0, 1.0)
        near = (np.abs(start + part[:, np.newaxis] * way - row) <= PAIR_SHARE).all(axis=1)
        onward = (self.heading[self.ends] * heading >= 0.0).all(axis=1)
        found = np.flatnonzero(near & onward & (part > 0.0) & (part < 1.0))
        part, ends = part[found], self.ends[found]
        error = self.error[ends - 1] * (1.0 - part)[:, np.newaxis] + self.error[ends] * part[:, np.newaxis]
        return _Partners(error, (1.0 - part) ** 2 + part**2)


def paired(inputs: Inputs, others: Sequence[Inputs], errors: Sequence[Array], moving: bool = False) -> Pairs:
    """Return what the rows of one trial pair with in another recording.

    Args:
        inputs: of the trial.
        others: of the other recording's trials.
        errors: theirs, shape (r, o) each; NaN where missing.
        moving: the robot moved while it was measured.
    """
    rows, outputs = len(inputs), errors[0].shape[1]
    unknown = np.full((rows, outputs), np.nan)
    found = Pairs(unknown, unknown.copy(), np.zeros(rows, dtype=int))
    everything = np.concatenate([all_inputs(item) for item in (inputs, *others)])
    scale = np.maximum(np.ptp(everything, axis=0), 1e-300)
    mine = all_inputs(inputs) / scale
    theirs = [all_inputs(item) / scale for item in others]
    common = [_same_beginning(mine, item, SAME_WAY_SHARE if moving else PAIR_SHARE) for item in theirs]
    heading = _headings(mine)
    other = _joined(theirs, errors)
    for row in range(rows):
        whole = [item[row] for item, length in zip(errors, common, strict=True) if row < length]
        if whole:
            _note(found, row, _Partners(np.array(whole), np.ones(len(whole))))
        elif not moving:
            _note(found, row, other.at(mine[row], heading[row]))
    return found


def _note(found: Pairs, row: int, partners: _Partners) -> None:
    """Write down what a row pairs with."""
    values = partners.error
    known = np.isfinite(values)
    if not known.any():
        return
    number = known.sum(axis=0)
    mean = np.where(known, values, 0.0).sum(axis=0) / np.maximum(number, 1)
    found.error[row] = np.where(number > 0, mean, np.nan)
    about = np.where(known, values - mean, 0.0)
    square = (about**2 / partners.share[:, np.newaxis]).sum(axis=0) / np.maximum(number - 1, 1)
    found.spread[row] = np.where(number > 1, square, np.nan)
    found.count[row] = len(values)


def _joined(rows: Sequence[Array], errors: Sequence[Array]) -> _Other:
    """Return the trials of the other recording, one after the other."""
    ends, start = [], 0
    for item in rows:
        steps = np.abs(np.diff(item, axis=0)).max(axis=1, initial=0.0)
        ends.append(start + 1 + np.flatnonzero((steps > 0.0) & (steps <= STRETCH_SHARE)))
        start += len(item)
    heading = np.concatenate([_headings(item) for item in rows])
    return _Other(np.concatenate(rows), heading, np.concatenate(list(errors)), np.concatenate(ends))


def share_paired(later: Dataset, earlier: Dataset) -> float:
    """Return the share of the later recording's rows that pair with rows of the earlier one."""
    rows = [len(trial.inputs) for trial in later.trials]
    return float(np.average(shares_paired(later, earlier), weights=rows))


def shares_paired(later: Dataset, earlier: Dataset) -> list[float]:
    """Return the same of each of the later recording's trials."""
    others = [trial.inputs for trial in earlier.trials]
    errors = [np.zeros((len(item), 1)) for item in others]
    moving = later.motion.moving
    counts = [paired(trial.inputs, others, errors, moving).count for trial in later.trials]
    return [float(np.mean(item > 0)) for item in counts]


def _same_beginning(first: Array, second: Array, within: float) -> int:
    """Return how many rows from the start have the same inputs, `within` a share of their ranges."""
    length = min(len(first), len(second))
    apart = (np.abs(first[:length] - second[:length]) > within).any(axis=1)
    return int(np.argmax(apart)) if apart.any() else length


def _headings(rows: Array) -> Array:
    """Return the direction of motion of each input at each row, shape (r, c); 0 where it never moves."""
    return np.stack([turning_points(values)[0] for values in rows.T], axis=1)
