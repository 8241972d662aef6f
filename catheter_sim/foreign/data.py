"""A data set whose robot is somebody's MJCF: `dataset.toml` with `control_` columns, read and checked."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from catheter_sim.catalogue import read_toml
from catheter_sim.core.posture import Array
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
_ROLES = ("train", "heldout")
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
    _check_keys(document, str(path))
    head, conditions = document["dataset"], document["conditions"]
    if conditions["motion"] != "dynamic":
        raise InputError(
            f'{path}: conditions.motion = {shown(conditions["motion"])}: "dynamic" is needed: a robot from '
            "somebody's MJCF is simulated in motion"
        )
    gravity = _numbers(conditions["gravity_mps2"], 3, f"{path}: conditions.gravity_mps2")
    settle_s = _numbers([conditions.get("settle_s", 0.0)], 1, f"{path}: conditions.settle_s")[0]
    if not 0.0 <= settle_s <= _LONGEST_SETTLE_S:
        raise InputError(
            f"{path}: conditions.settle_s = {settle_s:g}: must lie in 0 to {_LONGEST_SETTLE_S:g} s"
        )
    plain = ForeignModel(root / str(head["robot"]), (gravity[0], gravity[1], gravity[2]))
    inputs = _names(document["channels"]["inputs"], f"{path}: channels.inputs")
    outputs = _names(document["channels"]["outputs"], f"{path}: channels.outputs")
    for name in inputs:
        if name not in plain.input_columns:
            raise unknown("input channel", name, plain.input_columns, f"{path}: channels.inputs")
    model = plain.measured(outputs, f"{path}: channels.outputs")
    trials = [
        _trial(root, entry, model, inputs, f"{path}: trials[{index}]")
        for index, entry in enumerate(_entries(document["trials"], str(path)))
    ]
    trials = _with_roles(trials, str(path))
    return ForeignData(str(head["name"]), str(head["robot"]), model, tuple(trials), settle_s)


def _check_keys(document: Mapping[str, Any], where: str) -> None:
    tables = (*_KEYS, "trials")
    for table in document:
        if table not in tables:
            raise unknown("table", table, tables, f"{where}: a robot from somebody's MJCF")
    missing = [f"the table [{table}]" for table in tables if table not in document]
    for table, keys in _KEYS.items():
        known = (*keys, *_OPTIONAL.get(table, ()))
        given = document.get(table)
        if given is None:
            continue
        if not isinstance(given, Mapping):
            raise InputError(f"{where}: {table}: a table is needed, not {shown(given)}")
        for key in given:
            if key not in known:
                raise unknown("key", key, known, f"{where}: [{table}]")
        missing += [f"{table}.{key}" for key in keys if key not in given]
    if missing:
        raise InputError(f"{where}: {', '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing")


def _numbers(value: Any, count: int, where: str) -> list[float]:
    good = isinstance(value, list) and len(value) == count
    if not good or any(
        isinstance(item, bool) or not isinstance(item, int | float) or not math.isfinite(item)
        for item in value
    ):
        what = "a finite number" if count == 1 else f"a list of {count} finite numbers"
        raise InputError(f"{where}: {what} is needed, not {shown(value[0] if count == 1 else value)}")
    return [float(item) for item in value]


def _names(value: Any, where: str) -> list[str]:
    if not isinstance(value, list) or not value or not all(isinstance(name, str) for name in value):
        raise InputError(f"{where}: a list of column names is needed, not {shown(value)}")
    for name in value:
        if value.count(name) > 1:
            raise InputError(f"{where}: {shown(name)} stands twice")
    return list(value)


def _entries(value: Any, where: str) -> list[tuple[str, str]]:
    if not isinstance(value, list) or not value:
        raise InputError(f"{where}: at least one [[trials]] entry is needed")
    found: list[tuple[str, str]] = []
    for index, entry in enumerate(value):
        place = f"{where}: trials[{index}]"
        if not isinstance(entry, Mapping) or not isinstance(entry.get("file"), str):
            raise InputError(f"{place}: a table with a file's name is needed, not {shown(entry)}")
        for key in entry:
            if key not in ("file", "role"):
                raise unknown("key", key, ("file", "role"), place)
        role = entry.get("role", "")
        if "role" in entry and role not in _ROLES:
            raise unknown("role", str(role), _ROLES, place)
        if any(entry["file"] == file for file, _ in found):
            raise InputError(f"{place}.file: {shown(entry['file'])} stands twice")
        found.append((entry["file"], role))
    return found


def _trial(
    root: Path, entry: tuple[str, str], model: ForeignModel, inputs: Sequence[str], where: str
) -> Trial:
    file, role = entry
    wanted = [column.name for column in model.columns]
    if not (root / file).is_file():
        raise InputError(f"{where}.file: {root / file}: no such file")
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
    none = np.zeros(len(table.time_s))
    controls = [table.columns.get(name, none) for name in model.input_columns]
    return Trial(file, role, own_clock(table.time_s), np.stack(controls, axis=1), outputs)


def _with_roles(trials: Sequence[Trial], where: str) -> list[Trial]:
    """Return trials of which each has a role: without any held out, the last one is."""
    if len(trials) < 2:
        raise InputError(f"{where}: trials: two at least are needed, one of them to be held out")
    if not any(trial.role == "heldout" for trial in trials):
        free = [index for index, trial in enumerate(trials) if not trial.role]
        last = free[-1] if free else len(trials) - 1
        trials = [replace(t, role="heldout") if k == last else t for k, t in enumerate(trials)]
    found = [trial if trial.role else replace(trial, role="train") for trial in trials]
    if all(trial.role == "heldout" for trial in found):
        raise InputError(f"{where}: trials: every trial is held out; at least one must train")
    return found


def noise_of(trials: Sequence[Trial], least_share: float) -> Array:
    """Return the noise of each output from its third differences, shape (o,), in the columns' units.

    Of independent errors of size s these are sqrt(20) s; what moves smoothly leaves little there. It is no
    less than a share of the column's range.
    """
    columns = trials[0].outputs.shape[1]
    found = np.empty(columns)
    for k in range(columns):
        parts = [trial.outputs[np.isfinite(trial.outputs[:, k]), k] for trial in trials]
        differences = np.concatenate([np.diff(part, 3) for part in parts if len(part) > 3] or [np.zeros(1)])
        spread = 1.4826 * float(np.median(np.abs(differences))) / math.sqrt(20.0)
        values = np.concatenate(parts)
        span = float(np.ptp(values)) if len(values) else 1.0
        found[k] = max(spread, least_share * span, 1e-9)
    return found
