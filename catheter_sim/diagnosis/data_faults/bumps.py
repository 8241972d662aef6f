"""A tracker that was bumped in the middle of a trial."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.data.trials import Trial, all_inputs, measured_of
from catheter_sim.diagnosis.report.result import DataFault
from catheter_sim.diagnosis.thresholds import (
    BUMP_ALIKE_SHARE,
    BUMP_ALONE,
    BUMP_BEYOND_SHARE,
    BUMP_NOISE,
    BUMP_ROWS,
    BUMP_SAME_INPUTS,
)


def bumped_trackers(
    trials: Sequence[Trial], columns: Sequence[str], models: Sequence[Array], noise: Mapping[str, float]
) -> tuple[DataFault, ...]:
    """Return where every position jumps from one row to the next and stays off: the tracker was moved.

    The error of a wrong model changes with the inputs and comes back with them. So a jump of the error is a
    bump where no other jump of the trial is like it (`BUMP_ALONE`), and where rows after it are off by that
    jump beside rows before it that have nearly the same inputs and move the same way. No bump is seen where
    the inputs go beyond all earlier ones: there something of the robot may have given way for good.

    Args:
        trials: all.
        columns: outputs.
        models: what the calibrated model says, shape (r, o) each.
        noise: of each unit.
    """
    places = [index for index, name in enumerate(columns) if unit_of(name) == "mm"]
    found = []
    for trial, model in zip(trials, models, strict=True) if places else ():
        error = (measured_of(trial, columns) - model)[:, places]
        known = np.flatnonzero(np.isfinite(error).all(axis=1))
        row = _bump(error[known], all_inputs(trial.inputs), known, max(noise.get("mm", 0.0), 1e-9))
        if row is not None:
            found.append(
                DataFault(
                    "All positions jump here and stay off by as much, and the inputs do not explain it. Was "
                    f"the tracker, or the robot's base, moved (before row {row + 1})?",
                    trial.file,
                    (row + 1, len(model)),
                )
            )
    return tuple(found)


def _bump(error: Array, drive: Array, known: np.ndarray, noise: float) -> int | None:
    """Return the first row after a bump, None where there is none.

    Args:
        error: of the rows without missing values, shape (k, o) [mm].
        drive: inputs, shape (r, i).
        known: those rows' indices, shape (k,).
        noise: [mm].
    """
    if len(known) < 4 * BUMP_ROWS:
        return None
    steps = np.diff(error, axis=0)
    sizes = np.sqrt((steps**2).mean(axis=1))
    order = np.argsort(sizes)[::-1]
    at = int(order[0])  # the bump lies between the known rows `at` and `at + 1`
    if not BUMP_ROWS <= at < len(known) - BUMP_ROWS:
        return None
    if sizes[at] < BUMP_NOISE * noise or sizes[at] < BUMP_ALONE * sizes[order[1]]:
        return None
    scaled = drive / np.maximum(np.ptp(drive, axis=0), 1e-300)
    row = known[at + 1]
    if (scaled[row] > scaled[:row].max(axis=0) + BUMP_BEYOND_SHARE).any():
        return None
    moving = np.gradient(scaled, axis=0)[known]
    places = scaled[known]
    differences = []
    for after in range(at + 1, len(known)):
        same_way = (moving[: at + 1] * moving[after]).sum(axis=1) >= 0.0
        distance = np.where(same_way, np.abs(places[: at + 1] - places[after]).max(axis=1), np.inf)
        near = int(np.argmin(distance))
        if distance[near] < BUMP_SAME_INPUTS:
            differences.append(error[after] - error[near])
    if len(differences) < BUMP_ROWS:
        return None
    middle = np.median(differences, axis=0)
    apart = np.median(np.sqrt(((np.array(differences) - middle) ** 2).mean(axis=1)))
    size = float(np.sqrt((middle**2).mean()))
    off = float(np.sqrt(((steps[at] - middle) ** 2).mean()))
    return int(row) if off < BUMP_ALIKE_SHARE * size and apart < BUMP_ALIKE_SHARE * size else None
