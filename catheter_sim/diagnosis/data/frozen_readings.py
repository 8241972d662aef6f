"""Readings that a sensor repeats are taken out: where it is frozen, and where a file repeats the last one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.diagnosis.data.resolution import resolution_of
from catheter_sim.diagnosis.data.trials import Dataset, Trial, all_inputs
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.thresholds import (
    FROZEN_DRIVEN_SHARE,
    FROZEN_ROWS,
    FROZEN_SHARE,
    STALE_SHARE,
    STALE_VALUES_SHARE,
    STEP_BY_STEP,
)


def without_old_readings(dataset: Dataset) -> tuple[Dataset, tuple[Note, ...]]:
    """Return the data set without rows that repeat the readings of the row before, and what was left out.

    A log that is faster than its sensor gives the last reading again. Where many rows of a trial repeat all
    outputs while the inputs move, all such rows become missing values. A sensor that counts coarsely repeats
    values, too, but these come again elsewhere, or change by single steps.
    """
    notes: list[Note] = []
    trials = []
    steps = resolution_of(dataset)
    for trial in dataset.trials:
        old = _old_rows(trial, steps)
        if old.any():
            columns = {name: np.where(old, np.nan, values) for name, values in trial.outputs.columns.items()}
            trial = replace(trial, outputs=replace(trial.outputs, columns=columns))
            said = (
                f"{trial.file}: {int(old.sum())} of {len(old)} rows repeat all readings of the row before "
                "while the robot is driven, as a slower sensor does. These old readings are taken as missing."
            )
            notes.append(Note("old_readings", said))
        trials.append(trial)
    return (replace(dataset, trials=tuple(trials)) if notes else dataset), tuple(notes)


def _old_rows(trial: Trial, steps: Mapping[str, float]) -> np.ndarray:
    """Return which rows hold the readings of the row before, shape (r,); none where a few do.

    `steps`: of the readings, by column.
    """
    values = np.stack(list(trial.outputs.columns.values()), axis=1)
    drive = all_inputs(trial.inputs)
    same = np.zeros(len(values), dtype=bool)
    same[1:] = (values[1:] == values[:-1]).all(axis=1)
    driven = np.zeros(len(values), dtype=bool)
    driven[1:] = (drive[1:] != drive[:-1]).any(axis=1)
    none = np.zeros(len(values), dtype=bool)
    if not driven.any() or (same & driven).sum() < STALE_SHARE * driven.sum():
        return none
    changes = [np.abs(np.diff(column[np.isfinite(column)])) for column in values.T]
    least = [steps.get(name, 0.0) for name in trial.outputs.columns]
    if all((change <= STEP_BY_STEP * step).all() for change, step in zip(changes, least, strict=True)):
        return none
    # Of the column with the finest readings.
    distinct = max(len(np.unique(column[np.isfinite(column)])) for column in values.T)
    return same if distinct >= STALE_VALUES_SHARE * (~same).sum() else none


def without_frozen_readings(dataset: Dataset) -> tuple[Dataset, tuple[Note, ...]]:
    """Return the data set without the stretches in which a sensor repeats itself, and what was left out.

    A stretch counts where one column holds exactly one value over many rows while the inputs move; the
    repeats become missing values.
    """
    notes: list[Note] = []
    trials = []
    for trial in dataset.trials:
        columns = {}
        for name, values in trial.outputs.columns.items():
            kept = np.array(values)
            for start, end in _frozen_stretches(values, trial.inputs):
                kept[start + 1 : end] = np.nan
                said = (
                    f"{trial.file}: {name} repeats {values[start]:g} from row {start + 1} to {end} while the "
                    "robot is driven. Is it a frozen sensor? These rows are taken as missing."
                )
                notes.append(Note("frozen_sensor", said))
            columns[name] = kept
        trials.append(replace(trial, outputs=replace(trial.outputs, columns=columns)))
    return (replace(dataset, trials=tuple(trials)) if notes else dataset), tuple(notes)


def _frozen_stretches(values: Array, inputs: Inputs) -> Iterator[tuple[int, int]]:
    """Yield stretches of one value, (first row, one past the last), in which the inputs move."""
    drive = all_inputs(inputs)
    span = np.maximum(np.ptp(drive, axis=0), 1e-300)
    longest = max(FROZEN_ROWS, round(FROZEN_SHARE * len(values)))
    start = 0
    for row in range(1, len(values) + 1):
        if row < len(values) and values[row] == values[start]:
            continue
        if row - start >= longest and (np.ptp(drive[start:row], axis=0) / span).max() > FROZEN_DRIVEN_SHARE:
            yield start, row
        start = row
