"""A data set whose robot is somebody's MJCF: `dataset.toml` with `control_` columns, read and checked."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.catalogue import read_toml
from catheter_sim.diagnosis.dataset import channel_list, check_keys, gravity_of, texts_of, trial_entries
from catheter_sim.diagnosis.mapping import FileMap, file_map, read_mapped
from catheter_sim.diagnosis.readings import step_of
from catheter_sim.diagnosis.thresholds import HELDOUT_SHARE
from catheter_sim.diagnosis.trials import last_trials
from catheter_sim.errors import InputError, cut, shown, unknown
from catheter_sim.foreign.model import CONTROL, ForeignModel
from catheter_sim.foreign.thresholds import LEAST_ROWS
from catheter_sim.foreign.twin import Trial
from catheter_sim.tables import own_clock, read_table

_KEYS: Mapping[str, tuple[str, ...]] = {
    "dataset": ("name", "robot", "source", "licence"),
    "conditions": ("gravity_mps2", "motion"),
    "channels": ("inputs", "outputs"),
}
_OPTIONAL: Mapping[str, tuple[str, ...]] = {"conditions": ("settle_s",)}
_LONGEST_SETTLE_S = 60.0


@dataclass(frozen=True)
class ForeignData:
    """Recordings of a robot that somebody's MJCF describes.

    Attributes:
        name, robot: as `dataset.toml` has them.
        model: with the outputs that were measured.
        trials: in their order; one at least of each role.
        settle_s: for which the first row is held before a trial begins [s].
    """

    name: str
    robot: str
    model: ForeignModel
    trials: tuple[Trial, ...]
    settle_s: float

    def of(self, role: str) -> tuple[Trial, ...]:
        """Return the trials of a role."""
        return tuple(trial for trial in self.trials if trial.role == role)


def is_foreign(folder: str | os.PathLike[str]) -> bool:
    """Return whether a data set's robot is an MJCF that is driven by its actuators' controls.

    Whatever is wrong with the folder is left to who reads it.
    """
    try:
        document = read_toml(Path(folder) / "dataset.toml")
        robot, inputs = document["dataset"]["robot"], document["channels"]["inputs"]
    except (InputError, KeyError, TypeError):
        return False
    named = isinstance(robot, str) and robot.endswith(".xml") and isinstance(inputs, list)
    return named and any(isinstance(name, str) and name.startswith(CONTROL) for name in inputs)


def read_foreign(folder: str | os.PathLike[str]) -> ForeignData:
    """Return the data set in a folder, checked.

    Raises:
        InputError: anything is missing, unknown, of the wrong kind or impossible; one line names the file
            and the key, line or column.
    """
    root, path = Path(folder), Path(folder) / "dataset.toml"
    document = read_toml(path)
    check_keys(document, str(path), _KEYS, _OPTIONAL, ("map",))
    name, robot, _, _ = texts_of(document["dataset"], str(path))
    conditions = document["conditions"]
    if conditions["motion"] != "dynamic":
        raise InputError(
            f'{path}: conditions.motion = {shown(conditions["motion"])}: "dynamic" is needed: a robot from '
            "somebody's MJCF is simulated in motion"
        )
    x, y, z = gravity_of(conditions["gravity_mps2"], f"{path}: conditions.gravity_mps2").tolist()
    settle_s = conditions.get("settle_s", 0.0)
    if isinstance(settle_s, bool) or not isinstance(settle_s, int | float):
        raise InputError(f"{path}: conditions.settle_s: a number is needed, not {shown(settle_s)}")
    if not 0.0 <= settle_s <= _LONGEST_SETTLE_S:
        raise InputError(
            f"{path}: conditions.settle_s = {settle_s:g}: must lie in 0 to {_LONGEST_SETTLE_S:g} s"
        )
    plain = ForeignModel(root / robot, (x, y, z))
    inputs = channel_list(document["channels"]["inputs"], f"{path}: channels.inputs")
    outputs = channel_list(document["channels"]["outputs"], f"{path}: channels.outputs")
    for name in inputs:
        if name not in plain.input_columns:
            raise unknown("input channel", name, plain.input_columns, f"{path}: channels.inputs")
    model = plain.measured(outputs, f"{path}: channels.outputs")
    mapping = file_map(document.get("map"), inputs, outputs, str(path), model.unit_of)
    entries = trial_entries(document["trials"], root, str(path), mapping is not None)
    trials = [_trial(root, entry, model, inputs, mapping) for entry in entries]
    trials = _with_roles(trials, str(path))
    return ForeignData(name, robot, model, tuple(trials), float(settle_s))


def _trial(
    root: Path,
    entry: tuple[str, str, str],
    model: ForeignModel,
    inputs: Sequence[str],
    mapping: FileMap | None,
) -> Trial:
    file, role, log = entry
    wanted = [column.name for column in model.columns]
    if mapping is not None:
        table = read_mapped(root / file, mapping, inputs, wanted, root / log if log else None)
    else:
        table = read_table(root / file, only=(*inputs, *wanted))
    for name in (*inputs, *wanted):
        if name not in table.columns:
            columns = cut(", ".join(("time_s", *table.columns, *table.ignored)), 250)
            raise InputError(f"{table.where}: no column {name}, which dataset.toml lists; columns: {columns}")
    table.require_increasing_time()
    commanded = replace(table, columns={name: table.columns[name] for name in inputs})
    commanded.require_complete()
    if len(table.time_s) < LEAST_ROWS:
        raise InputError(f"{table.where}: {len(table.time_s)} rows: a trial needs {LEAST_ROWS} at least")
    outputs = np.stack([table.columns[name] for name in wanted], axis=1)
    if np.isnan(outputs).all():
        raise InputError(f"{table.where}: every value of the outputs is missing")
    standing = np.tile(model.resting_controls, (len(table.time_s), 1)).T
    controls = [table.columns.get(name, own) for name, own in zip(model.input_columns, standing, strict=True)]
    return Trial(file, role, own_clock(table.time_s), np.stack(controls, axis=1), outputs)


def _with_roles(trials: Sequence[Trial], where: str) -> list[Trial]:
    """Return trials of which each has a role: without any held out, the last ones without a role are.

    As for other robots (`parting.split`); a single trial is cut where the share to be held out begins.
    """
    heldout = {index for index, trial in enumerate(trials) if trial.role == "heldout"}
    free = [index for index, trial in enumerate(trials) if not trial.role]
    if not heldout and not free:
        raise InputError(
            f"{where}: every trial has the role train; give one the role heldout, or leave the roles out"
        )
    if len(trials) == 1:
        return _cut(trials[0], where)
    heldout = heldout or last_trials([len(trial.time_s) for trial in trials], free)
    return [replace(t, role="heldout" if k in heldout else "train") for k, t in enumerate(trials)]


def _cut(trial: Trial, where: str) -> list[Trial]:
    """Return the beginning of a trial, which trains, and all of it with nothing measured there, held out."""
    first = round((1.0 - HELDOUT_SHARE) * len(trial.time_s))
    later = trial.outputs.copy()
    later[:first] = np.nan
    for part, said in ((trial.outputs[:first], "first"), (later, "last")):
        if np.isnan(part).all():
            raise InputError(
                f"{where}: trials: {trial.file} is the only trial and is cut at row {first + 1}; "
                f"no output is measured in its {said} part"
            )
    train = replace(
        trial,
        role="train",
        time_s=trial.time_s[:first],
        controls=trial.controls[:first],
        outputs=trial.outputs[:first],
    )
    return [train, replace(trial, role="heldout", outputs=later)]


def noise_of(trials: Sequence[Trial], least_share: float) -> Array:
    """Return the noise of each output from its third differences, shape (o,), in the columns' units.

    Of independent errors of size s these are sqrt(20) s; what moves smoothly leaves little there. A reading
    that is repeated counts once, unless rounding repeats it. The noise is no less than what rounding leaves,
    nor than a share of the column's range.
    """
    controls = np.concatenate([trial.controls for trial in trials])
    columns = trials[0].outputs.shape[1]
    found = np.empty(columns)
    for k in range(columns):
        parts = [trial.outputs[np.isfinite(trial.outputs[:, k]), k] for trial in trials]
        rounding = step_of(np.concatenate([t.outputs[:, k] for t in trials]), controls) / math.sqrt(12.0)
        if not rounding:
            parts = [part[np.diff(part, prepend=np.nan) != 0.0] for part in parts]
        differences = np.concatenate([np.diff(part, 3) for part in parts if len(part) > 3] or [np.zeros(1)])
        spread = 1.4826 * float(np.median(np.abs(differences))) / math.sqrt(20.0)
        values = np.concatenate(parts)
        span = float(np.ptp(values)) if len(values) else 1.0
        found[k] = max(spread, rounding, least_share * span, 1e-9)
    return found
