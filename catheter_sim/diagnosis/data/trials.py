"""What a measured data set is: trials of one robot."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs, slice_inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.data.motion import HELD, Motion
from catheter_sim.diagnosis.data.nuisance import Nuisance
from catheter_sim.diagnosis.notes import Note
from catheter_sim.errors import cut
from catheter_sim.tables import Table

_MOST_LISTED = 3  # names in a line of what a data set shows of itself


@dataclass(frozen=True)
class Trial:
    """One measured time series.

    Attributes:
        file: its name as `dataset.toml` gives it.
        role: "train", "heldout", or "" where the data set leaves it open.
        inputs: what the robot was commanded, SI units.
        outputs: what was measured, the data set's output columns in their units; NaN is missing.
    """

    file: str
    role: str
    inputs: Inputs
    outputs: Table


@dataclass(frozen=True, repr=False)
class Dataset:
    """A folder of measurements of one robot.

    Attributes:
        folder: where it lies.
        name, source, licence: as `dataset.toml` says.
        robot: the robot as specified, before anything is calibrated.
        robot_reference: how the data set names it (an id or a path).
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        input_channels, output_channels: the columns that the data set declares.
        trials: in the order of `dataset.toml`.
        motion: whether rows were held.
        calibration: numbers of the specimen that it wants calibrated; None: those that are known to vary.
        model_share: share of an error that a right cause may leave, beside the noise, of a model that is
            known to be wrong.
        repeatability: by how much a second recording of the same would differ, by unit, where that is known.
        resolution: step of the readings, by column that shows one (`resolution.steps_of`); None: not looked
            for yet.
        notes: what a reader of a diagnosis must know of the files.
    """

    folder: Path
    name: str
    robot: RobotSpec
    robot_reference: str
    source: str
    licence: str
    gravity_mps2: Array
    input_channels: tuple[str, ...]
    output_channels: tuple[str, ...]
    trials: tuple[Trial, ...]
    motion: Motion = HELD
    calibration: tuple[Nuisance, ...] | None = None
    notes: tuple[Note, ...] = ()
    repeatability: Mapping[str, float] = field(default_factory=dict)
    resolution: Mapping[str, float] | None = None
    model_share: float = 0.0

    def __repr__(self) -> str:
        rows = [len(trial.inputs) for trial in self.trials]
        said = [
            f"{trial.file} ({count} rows{', ' if trial.role else ''}{trial.role})"
            for trial, count in zip(self.trials, rows, strict=True)
        ]
        x, y, z = self.gravity_mps2
        parts = {
            "inputs": _listed(self.input_channels),
            "outputs": _listed(self.output_channels),
            "trials": _listed(said),
            "conditions": f"{self.motion.name}, gravity {x:g}, {y:g}, {z:g} m/s^2",
            "calibration": _listed([item.parameter.name for item in self.calibration or ()]),
            "notes": str(len(self.notes) or ""),
        }
        head = f"<Dataset {cut(self.name, 60)!r} of {self.robot.name}: {len(rows)} trials, {sum(rows)} rows"
        return "\n  ".join([head, *(f"{name}: {text}" for name, text in parts.items() if text)]) + ">"

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(repr(self)[1:-1])}</pre>"


def _listed(names: Sequence[str]) -> str:
    """Return names in one line, of many the first and how many more there are."""
    shown = [cut(name, 40) for name in names[:_MOST_LISTED]]
    more = len(names) - len(shown)
    return ", ".join(shown) + (f" and {more} more" if more else "")


def measured_of(trial: Trial, columns: Sequence[str]) -> Array:
    """Return a trial's outputs, shape (r, o), NaN where missing."""
    return np.stack([trial.outputs.columns[name] for name in columns], axis=1)


def all_inputs(inputs: Inputs) -> Array:
    return np.hstack([inputs.tendon, inputs.force_tip, inputs.moment_tip])


def measured_from(trial: Trial) -> int:
    """Return the first row of a trial that has a measured value; 0 where none has."""
    if not trial.outputs.columns:
        return 0
    return int(np.argmax(np.isfinite(measured_of(trial, tuple(trial.outputs.columns))).any(axis=1)))


def beginnings(trials: Sequence[Trial], seconds: float) -> tuple[Trial, ...]:
    """Return the trials' beginnings, measured alike long: together `seconds`, or less."""
    each_s = seconds / max(len(trials), 1)
    return tuple(_until(trial, trial.inputs.time_s[measured_from(trial)] + each_s) for trial in trials)


def _until(trial: Trial, time_s: float) -> Trial:
    rows = slice(0, max(2, int(np.searchsorted(trial.inputs.time_s, time_s, side="right"))))
    columns = {name: values[rows] for name, values in trial.outputs.columns.items()}
    outputs = replace(trial.outputs, time_s=trial.outputs.time_s[rows], columns=columns)
    return replace(trial, inputs=slice_inputs(trial.inputs, rows), outputs=outputs)
