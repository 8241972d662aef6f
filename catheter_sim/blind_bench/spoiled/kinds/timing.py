"""Rows that are late, early, in another order, thinned out or filled in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.blind_bench.spoiled.kind import Kind, Spoil
from catheter_sim.blind_bench.spoiled.recording import (
    Recording,
    Trial,
    a_trial,
    in_all,
    in_trial,
    of_rows,
)

_ROWS = (4, 8)  # of a shift


def _late(values: Array, rows: int) -> Array:
    """Return a series so many rows later, or earlier (rows < 0); its end value stands in."""
    index = np.clip(np.arange(len(values)) - rows, 0, len(values) - 1)
    return np.asarray(values[index])


def _outputs_late(sign: int, once: bool) -> Spoil:
    def spoil(recording: Recording, generator: np.random.Generator) -> Recording:
        rows = sign * int(generator.integers(*_ROWS, endpoint=True))

        def change(trial: Trial) -> Trial:
            return replace(trial, outputs=_late(trial.outputs, rows))

        if once:
            return in_trial(recording, a_trial(recording, generator), change)
        return in_all(recording, change)

    return spoil


def _an_input_late(recording: Recording, generator: np.random.Generator) -> Recording:
    """One input's log is early by some rows: what is measured comes late against it."""
    rows = int(generator.integers(*_ROWS, endpoint=True))
    column = int(generator.choice(recording.moved))

    def change(trial: Trial) -> Trial:
        inputs = np.array(trial.inputs)
        inputs[:, column] = _late(inputs[:, column], rows)
        inputs[:, column] = np.where(np.arange(len(inputs)) < rows, 0.0, inputs[:, column])
        return replace(trial, inputs=inputs)

    return in_all(recording, change)


def _rows_lost(recording: Recording, generator: np.random.Generator) -> Recording:
    """Five to ten rows of the outputs' log are lost in each of three trials; what follows moves up."""
    numbers = generator.choice(len(recording.trials), 3, replace=False).tolist()

    def change(trial: Trial) -> Trial:
        count = int(generator.integers(5, 11))
        start = int(generator.integers(3, max(4, len(trial) // 2)))
        index = np.arange(len(trial))
        index[start:] += count
        return replace(trial, outputs=trial.outputs[np.minimum(index, len(trial) - 1)])

    trials = [change(trial) if k in numbers else trial for k, trial in enumerate(recording.trials)]
    return replace(recording, trials=tuple(trials))


def _outputs_shuffled(recording: Recording, generator: np.random.Generator) -> Recording:
    return in_all(
        recording, lambda trial: replace(trial, outputs=generator.permutation(trial.outputs, axis=0))
    )


def _outputs_shuffled_once(recording: Recording, generator: np.random.Generator) -> Recording:
    return in_trial(
        recording,
        a_trial(recording, generator),
        lambda trial: replace(trial, outputs=generator.permutation(trial.outputs, axis=0)),
    )


def _rows_shuffled(recording: Recording, generator: np.random.Generator) -> Recording:
    """Whole rows in another order, under the old clock."""

    def change(trial: Trial) -> Trial:
        mixed = of_rows(trial, generator.permutation(len(trial)))
        return replace(mixed, time_s=trial.time_s)

    return in_all(recording, change)


def _outputs_backward(recording: Recording, generator: np.random.Generator) -> Recording:
    """The outputs of two trials were written last row first; the sensors' noise is as it was."""
    numbers = generator.choice(len(recording.trials), 2, replace=False).tolist()
    trials = [
        replace(trial, outputs=trial.outputs[::-1]) if k in numbers else trial
        for k, trial in enumerate(recording.trials)
    ]
    return replace(recording, trials=tuple(trials))


def _clock(change: Callable[[Array], Array]) -> Spoil:
    def spoil(recording: Recording, generator: np.random.Generator) -> Recording:
        return in_all(recording, lambda trial: replace(trial, time_s=change(trial.time_s)))

    return spoil


def _rows_dropped(recording: Recording, generator: np.random.Generator) -> Recording:
    """A third of the rows is missing, with all that stands in them; the first rows stay."""

    def change(trial: Trial) -> Trial:
        kept = generator.random(len(trial)) > 1 / 3
        kept[:2] = True
        return of_rows(trial, kept)

    return in_all(recording, change)


def _interpolated(recording: Recording, generator: np.random.Generator) -> Recording:
    """Each sixth row was measured; between them outputs were interpolated."""

    def change(trial: Trial) -> Trial:
        rows = np.arange(len(trial))
        filled = np.nan_to_num(trial.outputs, nan=0.0)
        known = np.isfinite(trial.outputs)
        columns = []
        for k in range(trial.outputs.shape[1]):
            at = rows[(rows % 6 == 0) & known[:, k]]
            columns.append(np.interp(rows, at, filled[at, k]))
        return replace(trial, outputs=np.stack(columns, axis=1))

    return in_all(recording, change)


def _held(recording: Recording, generator: np.random.Generator) -> Recording:
    """The tracker gives a new value with each fifth row only; the file repeats the last."""

    def change(trial: Trial) -> Trial:
        rows = np.arange(len(trial))
        return replace(trial, outputs=trial.outputs[rows - rows % 5])

    return in_all(recording, change)


def _smoothed(recording: Recording, generator: np.random.Generator) -> Recording:
    """Outputs are means over eleven rows."""

    def change(trial: Trial) -> Trial:
        rows = np.arange(len(trial))
        near = np.abs(rows[:, np.newaxis] - rows) <= 5
        return replace(trial, outputs=np.stack([np.nanmean(trial.outputs[mask], axis=0) for mask in near]))

    return in_all(recording, change)


def _several_inputs(recording: Recording) -> bool:
    return len(recording.moved) > 1


KINDS = (
    Kind(
        "outputs_late", "all outputs come four to eight rows late", _outputs_late(1, False), alike=("rate",)
    ),
    Kind("outputs_late_once", "the same in one trial", _outputs_late(1, True)),
    Kind(
        "outputs_early", "all outputs come four to eight rows before their inputs", _outputs_late(-1, False)
    ),
    Kind("outputs_early_once", "the same in one trial", _outputs_late(-1, True)),
    Kind(
        "an_input_late",
        "one input stands four to eight rows late in the file",
        _an_input_late,
        _several_inputs,
        alike=("rate",),
    ),
    Kind("output_rows_lost", "rows of the outputs are lost in three trials, the rest moves up", _rows_lost),
    Kind("outputs_shuffled", "the outputs' rows are in another order than the inputs'", _outputs_shuffled),
    Kind("outputs_shuffled_once", "the same in one trial", _outputs_shuffled_once),
    Kind("outputs_backward", "the outputs of two trials run backward", _outputs_backward),
    Kind("rows_shuffled", "whole rows are in another order", _rows_shuffled),
    Kind("clock_backward", "the clock runs backward", _clock(lambda time_s: time_s[::-1])),
    Kind("clock_in_ms", "the clock counts milliseconds", _clock(lambda time_s: 1e3 * time_s)),
    Kind("rows_dropped", "a third of the rows is missing", _rows_dropped),
    Kind("interpolated", "five of six rows are interpolated", _interpolated),
    Kind("held", "four of five rows repeat the last measured one", _held),
    Kind("smoothed", "outputs are means over eleven rows", _smoothed),
)
