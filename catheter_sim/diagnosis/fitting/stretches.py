"""Stretches of rows that err together: blocks for intervals, folds for the cross-validation."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from catheter_sim.diagnosis.data.cycles import cycles
from catheter_sim.diagnosis.data.trials import Trial, measured_from, measured_of
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.thresholds import FOLDS, LEAST_BLOCK_S


def blocks_of(problem: Problem, fewest: int = 2 * FOLDS) -> np.ndarray:
    """Return the block of each residual: a whole cycle of a trial, in order, shape (n,).

    Where there are fewer cycles than `fewest`, cycles are cut into stretches of equal length.
    """
    stretches: list[tuple[int, slice]] = [
        (index, part)
        for index, trial in enumerate(problem.trials)
        for part in (equal_stretches(trial) if problem.moving else cycles(trial))
    ]
    if problem.moving:
        fewest = len(stretches)
    pieces = -(-fewest // max(len(stretches), 1))
    labels = [np.zeros(len(trial.inputs), dtype=int) for trial in problem.trials]
    count = 0
    for index, part in stretches:
        rows = np.arange(part.start, part.stop)
        shortest = 4 if len(rows) >= fewest else 1
        for piece in np.array_split(rows, min(pieces, max(1, len(rows) // shortest))):
            labels[index][piece] = count
            count += 1
    parts = []
    for trial, label in zip(problem.trials, labels, strict=True):
        finite = np.isfinite(measured_of(trial, problem.columns)[:: problem.every])
        parts.append(np.broadcast_to(label[:: problem.every, None], finite.shape)[finite])
    return np.concatenate(parts)


def fold_of(block: np.ndarray, folds: int = FOLDS) -> np.ndarray:
    """Return the fold of each residual: stretches of neighbouring blocks, alike in rows, shape (n,)."""
    order = np.unique(block, return_inverse=True)[1]
    sizes = np.bincount(order)
    middle = np.cumsum(sizes) - 0.5 * sizes
    return np.minimum((middle * folds / sizes.sum()).astype(int), folds - 1)[order]


def equal_stretches(trial: Trial) -> list[slice]:
    """Return stretches of a trial in motion, measured alike long, none shorter than `LEAST_BLOCK_S`.

    Rows before the first measured one belong to the first stretch.
    """
    time_s = trial.inputs.time_s
    begun_s = time_s[measured_from(trial)]
    count = max(1, int((time_s[-1] - begun_s) / LEAST_BLOCK_S))
    ends = np.searchsorted(time_s, np.linspace(begun_s, time_s[-1], count + 1)[1:-1])
    return [slice(int(a), int(b)) for a, b in pairwise((0, *ends, len(time_s))) if b > a]


def trial_of(problem: Problem) -> np.ndarray:
    """Return the index of the trial of each residual, shape (n,)."""
    return np.concatenate(
        [
            np.full(int(np.isfinite(measured_of(trial, problem.columns)[:: problem.every]).sum()), index)
            for index, trial in enumerate(problem.trials)
        ]
    )
