"""A tracker, or a robot's base, that was moved between trials."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.data_faults.beside_model import BesideModel
from catheter_sim.diagnosis.report.result import DataFault
from catheter_sim.diagnosis.thresholds import (
    BUMP_ROWS,
    BUMP_SAME_INPUTS,
    MOVED_FIRST_NOISE,
    MOVED_FIRST_ROWS,
    MOVED_LEFT_SHARE,
    MOVED_NOISE,
    MOVED_ROWS,
)


@dataclass(frozen=True)
class _Moved:
    """Trials whose points lie elsewhere at the same inputs, by one rigid motion.

    Attributes:
        trials: their indices.
        before, left: distance from the same rows of other trials, without and with the motion, root mean
            square [mm].
    """

    trials: tuple[int, ...]
    before: float
    left: float


def moved_between_trials(seen: BesideModel) -> tuple[DataFault, ...]:
    """Return from which trial on, or in which one, all points lie elsewhere by one rigid motion.

    Rows of these trials are compared with rows of the others that have nearly the same inputs and move the
    same way; what a wrong model says of both cancels. The motion must take nearly all of the difference, and
    that of the first rows: no cause of an error of the model is at work before a robot was driven.
    """
    count = len(seen.trials)
    if count < 3 or not seen.points:
        return ()
    groups = [tuple(range(first, count)) for first in range(1, count)]
    groups += [(number,) for number in range(count - 1)]
    tried = [item for item in (_moved(seen, group) for group in groups) if item is not None]
    best = min(tried, key=lambda item: item.left / item.before, default=None)
    if best is None:
        return ()
    first = seen.trials[best.trials[0]].file
    where = "in this trial" if len(best.trials) == 1 else f"from this trial on ({len(best.trials)} trials)"
    return (
        DataFault(
            f"All points lie elsewhere {where}, from the first rows on: {best.before:.2g} mm from the "
            f"other trials at the same inputs. Moved back as one body, {best.left:.2g} mm are left. Was the "
            "tracker, or the robot's base, moved? Measure again, or leave these trials out.",
            first,
        ),
    )


def _moved(seen: BesideModel, group: tuple[int, ...]) -> _Moved | None:
    """Return what moving a group of trials back as one body would do; None: they were not moved."""
    others = [number for number in range(len(seen.trials)) if number not in group]
    here, there = _pairs(seen, group, others)
    if len(here) < BUMP_ROWS:
        return None
    turn, shift = _rigid_motion(here.reshape(-1, here.shape[-1]), there.reshape(-1, here.shape[-1]))
    before, left = _rms(here - there), _rms(here @ turn.T + shift - there)
    if before < MOVED_NOISE * seen.noise_mm or left > MOVED_LEFT_SHARE * before + seen.noise_mm:
        return None
    first_here, first_there = _first(seen, group), _first(seen, others)
    off = first_here - first_there
    rest = first_here @ turn.T + shift - first_there
    if _rms(off) < MOVED_FIRST_NOISE * seen.noise_mm or _rms(rest) > MOVED_LEFT_SHARE * _rms(off):
        return None
    return _Moved(group, before, left)


def _pairs(seen: BesideModel, group: tuple[int, ...], others: list[int]) -> tuple[Array, Array]:
    """Return points (k, points, axes) of a group's rows, and of other trials' rows at the same inputs.

    What the inputs still differ by is taken off with the model's help.
    """
    mine = [_rows(seen, number) for number in group]
    theirs = [_rows(seen, number) for number in others]
    drive, way, points, model = (np.concatenate(parts) for parts in zip(*mine, strict=True))
    other_drive, other_way, other_points, other_model = (
        np.concatenate(parts) for parts in zip(*theirs, strict=True)
    )
    here, there = [], []
    for row in range(len(drive)):
        distance = np.abs(other_drive - drive[row]).max(axis=1)
        distance = np.where(other_way @ way[row] >= 0.0, distance, np.inf)
        near = int(np.argmin(distance)) if len(distance) else 0
        if len(distance) and distance[near] < BUMP_SAME_INPUTS:
            here.append(points[row])
            there.append(other_points[near] + model[row] - other_model[near])
    shape = (0, *points.shape[1:])
    return (np.array(here), np.array(there)) if here else (np.zeros(shape), np.zeros(shape))


def _rows(seen: BesideModel, number: int) -> tuple[Array, Array, Array, Array]:
    """Return of a trial's rows without missing values, at most so many: inputs, their way, points, model."""
    columns = np.array(seen.points)
    points, model = seen.measured[number][:, columns], seen.models[number][:, columns]
    drive = seen.drives[number]
    known = np.flatnonzero(np.isfinite(points).all(axis=(1, 2)))
    known = known[:: max(1, len(known) // MOVED_ROWS)]
    way = np.gradient(drive, axis=0) if len(drive) > 1 else np.zeros_like(drive)
    return drive[known], way[known], points[known], model[known]


def _first(seen: BesideModel, group: tuple[int, ...] | list[int]) -> Array:
    """Return where points lie in the first rows of some trials, the model's motion since taken off."""
    columns = np.array(seen.points)
    found = []
    for number in group:
        error = seen.errors[number][:, columns]
        known = np.flatnonzero(np.isfinite(error).all(axis=(1, 2)))[:MOVED_FIRST_ROWS]
        found.append(error[known].mean(axis=0) + seen.models[number][0, columns])
    return np.asarray(np.nanmedian(np.array(found), axis=0))


def _rigid_motion(points: Array, targets: Array) -> tuple[Array, Array]:
    """Return the turn (a, a) and the shift (a,) that lay points (n, a) over targets best (Kabsch 1976)."""
    middle, goal = points.mean(axis=0), targets.mean(axis=0)
    u, _, v = np.linalg.svd((points - middle).T @ (targets - goal))
    mirror = np.ones(points.shape[1])
    mirror[-1] = np.sign(np.linalg.det(v.T @ u.T)) or 1.0
    turn = v.T @ np.diag(mirror) @ u.T
    return turn, goal - turn @ middle


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
