"""What a measured data set is, and how it is parted: into training and held-out trials, and cycles."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from catheter_sim.diagnosis.nuisance import Nuisance
from catheter_sim.errors import InputError
from catheter_sim.robots.channels import Inputs, slice_inputs
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.posture import Array
from catheter_sim.tables import Table

HELDOUT_SHARE = 0.3  # of the rows, where the data set gives no roles
# A valley of the pull ends a cycle if it lies below this share of the peaks on both its sides.
_VALLEY = 0.25
# A peak counts if it reaches this share of the trial's largest pull; below it is noise about rest.
_PEAK = 0.1
# What a tenth of the rows do not exceed is a standing pretension up to this share of the largest pull.
_MOST_PRETENSION = 0.4


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


@dataclass(frozen=True)
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
        calibration: numbers of the specimen that it wants calibrated; (): those that are known to vary.
        notes: what a reader of a diagnosis must know of the files, a sentence each.
    """

    folder: Path
    name: str
    robot: Robot
    robot_reference: str
    source: str
    licence: str
    gravity_mps2: Array
    input_channels: tuple[str, ...]
    output_channels: tuple[str, ...]
    trials: tuple[Trial, ...]
    calibration: tuple[Nuisance, ...] = ()
    notes: tuple[str, ...] = ()


def split(dataset: Dataset) -> tuple[tuple[Trial, ...], tuple[Trial, ...]]:
    """Return the training trials and the held-out trials of `dataset`, each with its role set.

    Roles that the data set gives are kept. If it holds no trial out, the last trials without a role
    are held out, about 30 % of the rows; of trials that repeat one another none is, as far as
    possible, since a repeat of a training trial tests nothing. A single trial is cut between two of
    its cycles (`cycles`), or, if it has but one, at 70 % of its rows. The held-out part of a cut
    trial keeps all inputs, so that the history is right, and has NaN where the training part was
    measured.

    Raises:
        InputError: every trial has the role "train", so that nothing is left to test on.
    """
    trials = dataset.trials
    if any(trial.role == "heldout" for trial in trials):
        chosen = {index for index, trial in enumerate(trials) if trial.role == "heldout"}
        return _with_roles(trials, chosen)
    open_ones = [index for index, trial in enumerate(trials) if not trial.role]
    if not open_ones:
        raise InputError(
            f"{dataset.folder / 'dataset.toml'}: every trial has the role train; "
            "give one the role heldout, or leave the roles out"
        )
    if len(trials) == 1:
        return _cut(trials[0])
    return _with_roles(trials, _held_out(trials, open_ones))


def cycles(trial: Trial) -> list[slice]:
    """Return the stretches of rows between returns to near rest, in order; together all rows.

    What counts is the pull: the largest tension, or positive displacement, of any tendon, or a load
    on the tip, as a share of the trial's largest. A tendon cannot push, so a displacement below zero
    is rest, unless the trial has hardly any other; a standing pretension is rest too. Rows are cut
    at the last row of a valley that lies below a quarter of the peaks before and after it.
    """
    pull = _pull(trial.inputs)
    starts = [0]
    peak, valley, low_row = 0.0, math.inf, 0
    for row, value in enumerate(pull):
        if peak >= _PEAK and value <= _VALLEY * peak and value <= valley:
            valley, low_row = value, row
        elif valley < math.inf and value >= max(valley / _VALLEY, _PEAK):
            starts.append(low_row)
            peak, valley = value, math.inf
        if valley == math.inf:
            peak = max(peak, value)
    return [slice(start, end) for start, end in zip(starts, [*starts[1:], len(pull)], strict=True)]


def is_repeat(first: Trial, second: Trial) -> bool:
    """Return whether two trials were given the same inputs (to a millionth of their range) and clock."""
    a, b = _all_inputs(first.inputs), _all_inputs(second.inputs)
    if a.shape != b.shape:
        return False
    tolerance = 1e-6 * max(float(np.abs(a).max()), 1e-12)
    span = max(float(np.ptp(first.inputs.time_s)), 1e-12)
    same_clock = np.abs(first.inputs.time_s - second.inputs.time_s).max() <= 1e-6 * span
    return bool(np.abs(a - b).max() <= tolerance and same_clock)


def unit_of(column: str) -> str:
    """Return the unit of an output column: "mm", "deg", "N", or "1" for parts of a quaternion."""
    unit = column.rsplit("_", 1)[-1]
    return unit if unit in ("mm", "deg", "N") else "1"


def _with_roles(
    trials: Sequence[Trial], heldout: Iterable[int]
) -> tuple[tuple[Trial, ...], tuple[Trial, ...]]:
    chosen = set(heldout)
    return (
        tuple(replace(trial, role="train") for i, trial in enumerate(trials) if i not in chosen),
        tuple(replace(trial, role="heldout") for i, trial in enumerate(trials) if i in chosen),
    )


def _held_out(trials: Sequence[Trial], open_ones: Sequence[int]) -> set[int]:
    """Return the last trials without a role, repeats passed over, until about 30 % of the rows are out."""
    repeated = {
        i
        for i in range(len(trials))
        if any(i != j and is_repeat(trials[i], trials[j]) for j in range(len(trials)))
    }
    rows = sum(len(trial.inputs) for trial in trials)
    chosen: set[int] = set()
    candidates = [i for i in open_ones if i not in repeated] or list(open_ones)
    for index in reversed(candidates):
        taken = sum(len(trials[i].inputs) for i in chosen)
        here = len(trials[index].inputs)
        left = len(trials) - len(chosen)
        # Nearer to the wanted share with this trial than without it; one at least, never all.
        nearer = abs(taken + here - HELDOUT_SHARE * rows) <= abs(taken - HELDOUT_SHARE * rows)
        if left > 1 and (nearer or not chosen):
            chosen.add(index)
    return chosen


def _cut(trial: Trial) -> tuple[tuple[Trial, ...], tuple[Trial, ...]]:
    rows = len(trial.inputs)
    wanted = (1.0 - HELDOUT_SHARE) * rows
    starts = [part.start for part in cycles(trial)[1:]]
    row = min(starts, key=lambda start: abs(start - wanted)) if starts else round(wanted)
    if not 0 < row < rows:
        raise InputError(f"{trial.outputs.where}: too few rows to hold any of them out")
    columns = trial.outputs.columns
    train = Trial(
        trial.file,
        "train",
        slice_inputs(trial.inputs, slice(0, row)),
        replace(
            trial.outputs,
            time_s=trial.outputs.time_s[:row],
            columns={name: values[:row] for name, values in columns.items()},
        ),
    )
    later = np.arange(rows) >= row
    hidden = {name: np.where(later, values, np.nan) for name, values in columns.items()}
    heldout = replace(trial, role="heldout", outputs=replace(trial.outputs, columns=hidden))
    return (train,), (heldout,)


def _all_inputs(inputs: Inputs) -> Array:
    return np.hstack([inputs.tendon, inputs.force_tip, inputs.moment_tip])


def _pull(inputs: Inputs) -> Array:
    """Return how far the robot is from rest, shape (r,), as a share of the trial's largest pull."""
    tendon = np.maximum(inputs.tendon, 0.0)
    if tendon.max(initial=0.0) < 0.1 * np.abs(inputs.tendon).max(initial=0.0):
        tendon = np.abs(inputs.tendon)
    total = np.zeros(len(inputs))
    for values in (tendon, np.abs(inputs.force_tip), np.abs(inputs.moment_tip)):
        largest = values.max(initial=0.0)
        if largest > 0.0:
            total = np.maximum(total, values.max(axis=1) / largest)
    rest = float(np.quantile(total, 0.1)) if len(total) else 0.0
    if rest > _MOST_PRETENSION:
        return total  # the robot never rests; what is low here is no rest
    return (total - rest) / (1.0 - rest)  # below zero where even the pretension is gone
