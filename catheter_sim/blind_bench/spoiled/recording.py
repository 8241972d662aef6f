"""Measurements as they lie in a folder's files, so that they can be spoiled: trials of numbers by column."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.blind_bench.robots import BenchRobot


@dataclass(frozen=True)
class Trial:
    """One file.

    Attributes:
        role: "train", "heldout" or "".
        time_s: shape (r,).
        inputs: in file units, shape (r, c).
        outputs: in file units, shape (r, o); NaN: missing.
    """

    role: str
    time_s: Array
    inputs: Array
    outputs: Array

    def __len__(self) -> int:
        return len(self.time_s)


@dataclass(frozen=True)
class Recording:
    """A data set.

    Attributes:
        bench: the robot as specified.
        inputs, outputs: names of the columns.
        gravity_mps2: as stated, shape (3,).
        noise: standard deviation of each output, shape (o,), in file units.
        trials: in the order in which they were measured.
    """

    bench: BenchRobot
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    gravity_mps2: Array
    noise: Array
    trials: tuple[Trial, ...]

    @property
    def places(self) -> np.ndarray:
        """Indices of the outputs that are positions."""
        return np.array([k for k, name in enumerate(self.outputs) if name.endswith("_mm")])

    @property
    def points(self) -> dict[str, list[int]]:
        """Indices of the outputs of each measured point, the tip first, in the order of its axes."""
        found: dict[str, list[int]] = {}
        for index in self.places.tolist():
            found.setdefault(self.outputs[index].rsplit("_", 2)[0], []).append(index)
        return found

    @property
    def axes(self) -> str:
        """In which axes positions are measured."""
        return "".join(self.outputs[index].rsplit("_", 2)[1] for index in self.points["tip"])

    @property
    def moved(self) -> list[int]:
        """Indices of the inputs that change."""
        values = np.concatenate([trial.inputs for trial in self.trials])
        return [int(index) for index in np.flatnonzero(np.ptp(values, axis=0) > 0.0)]

    @property
    def moving(self) -> list[int]:
        """Indices of the outputs that move by a fifth of the largest motion of their unit, widest first."""
        values = np.concatenate([trial.outputs for trial in self.trials])
        spread = np.nanstd(values, axis=0)
        units = [name.rsplit("_", 1)[1] for name in self.outputs]
        most = {unit: max(s for s, u in zip(spread, units, strict=True) if u == unit) for unit in units}
        found = [k for k, unit in enumerate(units) if spread[k] > 0.2 * most[unit]]
        return sorted(found, key=lambda k: -spread[k])


OnTrial = Callable[[Trial], Trial]


def in_trial(recording: Recording, number: int, change: OnTrial) -> Recording:
    """Return a recording with one trial changed."""
    return in_trials(recording, [number], change)


def in_trials(recording: Recording, numbers: Sequence[int], change: OnTrial) -> Recording:
    """Return a recording with some trials changed."""
    trials = tuple(
        change(trial) if index in numbers else trial for index, trial in enumerate(recording.trials)
    )
    return replace(recording, trials=trials)


def in_all(recording: Recording, change: OnTrial) -> Recording:
    """Return a recording with every trial changed."""
    return in_trials(recording, range(len(recording.trials)), change)


def with_outputs(
    trial: Trial, columns: Sequence[int], values: Array, rows: np.ndarray | None = None
) -> Trial:
    """Return a trial with some outputs replaced, at some rows (a mask) or at all."""
    outputs = np.array(trial.outputs)
    chosen = np.ones(len(trial), dtype=bool) if rows is None else rows
    outputs[np.ix_(chosen, np.asarray(columns, dtype=int))] = (
        values if rows is None else np.broadcast_to(values, (len(trial), len(columns)))[chosen]
    )
    return replace(trial, outputs=outputs)


def of_rows(trial: Trial, rows: np.ndarray) -> Trial:
    """Return some rows of a trial, by index or mask."""
    return Trial(trial.role, trial.time_s[rows], trial.inputs[rows], trial.outputs[rows])


def a_trial(recording: Recording, generator: np.random.Generator) -> int:
    """Return one of the trials."""
    return int(generator.integers(len(recording.trials)))


def a_stretch(trial: Trial, share: float, generator: np.random.Generator) -> np.ndarray:
    """Return a stretch of a trial's rows as a mask, not at its first or last rows."""
    rows = len(trial)
    length = max(3, round(share * rows))
    start = int(generator.integers(2, max(3, rows - length - 1)))
    index = np.arange(rows)
    return np.asarray((index >= start) & (index < start + length))
