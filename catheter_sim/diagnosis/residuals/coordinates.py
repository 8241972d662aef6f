"""Residuals of one output over trials, and what they may depend on, row by row.

A residual is measured minus computed. Each view has coordinates that a cause of error would act through.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import drives_of
from catheter_sim.core.drive import Drive, Quantity
from catheter_sim.diagnosis.data.cycles import cycles
from catheter_sim.diagnosis.data.trials import Dataset, Trial
from catheter_sim.diagnosis.report.result import TrialFit
from catheter_sim.diagnosis.residuals.turning import turning_points
from catheter_sim.diagnosis.thresholds import FEWEST_BLOCKS

STAGES = ("before", "after")


VIEWS: Mapping[str, str] = {
    "input": "the input",
    "direction": "the direction of motion",
    "time": "the time in the trial",
    "position": "the position",
    "history": "the way since the last turning point",
}


@dataclass(frozen=True)
class Residuals:
    """Residuals of one output over several trials, with what they may depend on.

    Attributes:
        column: the output, unit included.
        stage: "before" or "after".
        values: measured minus computed, shape (n,), no NaN.
        blocks: number of the cycle that each row belongs to, shape (n,).
        coordinates: per view, the coordinates by name (unit included), each of shape (n,).
    """

    column: str
    stage: str
    values: Array
    blocks: np.ndarray
    coordinates: Mapping[str, Mapping[str, Array]]


def stack(dataset: Dataset, fits: Sequence[TrialFit], column: str, stage: str) -> Residuals:
    """Return the residuals of one output over `fits`, rows without a measurement left out.

    Args:
        dataset: where the trials' inputs are.
        fits: trials to take, one below the other.
        column: an output.
        stage: "before" or "after".
    """
    values: list[Array] = []
    blocks: list[np.ndarray] = []
    parts: dict[str, dict[str, list[Array]]] = {view: {} for view in VIEWS}
    offset = 0
    for fit in fits:
        trial = next(item for item in dataset.trials if item.file == fit.file)
        computed = (fit.before if stage == "before" else fit.after).columns[column]
        residual = fit.measured.columns[column] - computed
        keep = np.isfinite(residual)
        numbers = _blocks(trial, keep)
        values.append(residual[keep])
        blocks.append(numbers[keep] + offset)
        offset += int(numbers.max(initial=0)) + 1
        for view, coordinates in _coordinates(dataset, trial, fit, column).items():
            for name, coordinate in coordinates.items():
                parts[view].setdefault(name, []).append(coordinate[keep])
    return Residuals(
        column=column,
        stage=stage,
        values=np.concatenate(values) if values else np.zeros(0),
        blocks=np.concatenate(blocks) if blocks else np.zeros(0, dtype=int),
        coordinates={
            view: {name: np.concatenate(pieces) for name, pieces in coordinates.items()}
            for view, coordinates in parts.items()
        },
    )


def fits_to_judge(dataset: Dataset, fits: Sequence[TrialFit]) -> tuple[TrialFit, ...]:
    """Return the held-out trials if they hold enough cycles to judge by, otherwise all trials."""
    heldout = tuple(fit for fit in fits if fit.role == "heldout")
    count = 0
    for fit in heldout:
        trial = next(item for item in dataset.trials if item.file == fit.file)
        measured = np.any([np.isfinite(values) for values in fit.measured.columns.values()], axis=0)
        count += sum(bool(measured[part].any()) for part in cycles(trial))
    return heldout if count >= FEWEST_BLOCKS else tuple(fits)


def _coordinates(dataset: Dataset, trial: Trial, fit: TrialFit, column: str) -> dict[str, dict[str, Array]]:
    rows = len(fit.time_s)
    # The model before tells where the robot is and goes, for both stages: it has no noise, and the
    # same rows stay in the same groups.
    computed = fit.before.columns[column]
    direction, way = turning_points(computed)
    words, _, unit = column.rpartition("_")
    inputs = input_columns(dataset, trial)
    return {
        "input": {name: values[:rows] for name, values in inputs.items()},
        "direction": {f"computed {words}, falling or rising": direction},
        "time": {"time in the trial_s": fit.time_s - fit.time_s[0] if rows else fit.time_s},
        "position": {f"computed {words}_{unit}": computed},
        "history": {f"computed {words} since it turned_{unit}": way},
    }


def input_columns(dataset: Dataset, trial: Trial) -> dict[str, Array]:
    """Return the commanded channels of the data set by name, in file units; an advance is not among them."""
    inputs = trial.inputs
    columns = {
        drive.column: inputs.tendon[:, drive.tendons[0]] * _in_file_units(drive)
        for drive in drives_of(dataset.robot, inputs.actuation)
        if drive.quantity is not Quantity.ADVANCE
    }
    for kind, values, unit in (
        ("force", inputs.force_tip, "N"),
        ("moment", inputs.moment_tip, "Nm"),
    ):
        columns |= {f"{kind}_tip_{axis}_{unit}": values[:, i] for i, axis in enumerate("xyz")}
    return {name: values for name, values in columns.items() if name in dataset.input_channels}


def _in_file_units(drive: Drive) -> float:
    """Return by what the input of a drive's first tendon, SI, is multiplied to give the drive's column."""
    per_si = 1.0 if drive.quantity is Quantity.TENSION else 1e3
    return per_si * (1.0 / drive.parts[0])


def _blocks(trial: Trial, keep: np.ndarray) -> np.ndarray:
    """Return the number of the block that each row is in: its cycle, or one of eight equal stretches."""
    rows = len(keep)
    numbers = np.zeros(rows, dtype=int)
    for number, part in enumerate(cycles(trial)):
        numbers[part.start : part.stop] = number
    if len(np.unique(numbers[keep])) < FEWEST_BLOCKS and keep.any():
        numbers = np.zeros(rows, dtype=int)
        for number, indices in enumerate(np.array_split(np.flatnonzero(keep), 2 * FEWEST_BLOCKS)):
            numbers[indices] = number
    return numbers
