"""Stretches in which a sensor repeats itself are taken out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Array
from catheter_sim.diagnosis.data.trials import Dataset, all_inputs
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.thresholds import FROZEN_DRIVEN_SHARE, FROZEN_ROWS, FROZEN_SHARE


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
                    "robot is driven: a frozen sensor? Taken as missing there."
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
