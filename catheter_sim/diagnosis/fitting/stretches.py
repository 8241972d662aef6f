"""Stretches of rows that err together: blocks for intervals, folds for the cross-validation."""

from __future__ import annotations

import numpy as np

from catheter_sim.diagnosis.data.cycles import stretch_of
from catheter_sim.diagnosis.data.trials import measured_of
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.thresholds import FOLDS


def blocks_of(problem: Problem, fewest: int = 2 * FOLDS) -> np.ndarray:
    """Return the block of each residual: its row's stretch (`data.cycles.stretch_of`), shape (n,)."""
    labels = stretch_of(problem.trials, problem.moving, fewest)
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


def trial_of(problem: Problem) -> np.ndarray:
    """Return the index of the trial of each residual, shape (n,)."""
    return np.concatenate(
        [
            np.full(int(np.isfinite(measured_of(trial, problem.columns)[:: problem.every]).sum()), index)
            for index, trial in enumerate(problem.trials)
        ]
    )
