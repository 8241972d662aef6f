"""Outputs that go out and come back while every input stands still."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.data_faults.beside_model import BesideModel
from catheter_sim.diagnosis.report.result import DataFault
from catheter_sim.diagnosis.thresholds import (
    STANDS_SHARE,
    UNDRIVEN_BACK_SHARE,
    UNDRIVEN_NOISE,
    UNDRIVEN_ROWS,
    UNDRIVEN_STRETCHES,
)


def moved_without_inputs(seen: BesideModel) -> tuple[DataFault, ...]:
    """Return the trials whose outputs go out and come back while the inputs stand still.

    What lags or creeps goes one way. So an input is not in the file, or its sensor ends where it stands.
    Nothing is said of robots that swing.
    """
    if seen.moving:
        return ()
    found = [
        (number, rows)
        for number, drive in enumerate(seen.drives)
        for rows in _standing(drive)
        if _out_and_back(seen, number, rows)
    ]
    if len(found) < UNDRIVEN_STRETCHES:
        return ()
    return tuple(
        DataFault(
            "The outputs go out and come back while the inputs stand still. Is an input missing from the "
            "file, or does its sensor end there?",
            seen.trials[number].file,
            (rows.start + 1, rows.stop),
        )
        for number, rows in found
    )


def _standing(drive: Array) -> Iterator[slice]:
    """Yield the stretches of rows in which no input changes."""
    still = np.asarray((np.abs(np.diff(drive, axis=0)) <= STANDS_SHARE).all(axis=1))
    start = 0
    for row in range(len(still) + 1):
        if row < len(still) and still[row]:
            continue
        if row - start + 1 >= UNDRIVEN_ROWS:
            yield slice(start, row + 1)
        start = row + 1


def _out_and_back(seen: BesideModel, number: int, rows: slice) -> bool:
    """Return whether an output goes out by far more than the noise in a stretch, and comes back."""
    for column in range(len(seen.columns)):
        values = seen.measured[number][rows, column]
        values = values[np.isfinite(values)]
        if len(values) < UNDRIVEN_ROWS:
            continue
        padded = np.pad(values, 1, mode="edge")
        calm = np.median(np.stack([padded[:-2], padded[1:-1], padded[2:]]), axis=0)
        chord = np.linspace(calm[0], calm[-1], len(calm))
        out = float(np.abs(calm - chord).max())
        if (
            out > UNDRIVEN_NOISE * seen.noise_of(column)
            and abs(calm[-1] - calm[0]) < UNDRIVEN_BACK_SHARE * out
        ):
            return True
    return False
