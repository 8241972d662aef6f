"""Measured data from a folder: `dataset.toml` and its CSV files, read and checked.

Everything that can be wrong with the folder ends in one `InputError` that names the file and the
key, line or column. What comes out is complete: inputs in SI units, outputs in the units of their
columns with NaN for a missing value.
"""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.catalogue import FILES, load_robot, read_toml
from catheter_sim.channels import (
    check_output_channels,
    read_inputs,
)
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.data.checks import check_outputs
from catheter_sim.diagnosis.data.copies import refuse_copies
from catheter_sim.diagnosis.data.mapping.file_map import FileMap, file_map
from catheter_sim.diagnosis.data.mapping.mapped import read_mapped
from catheter_sim.diagnosis.data.motion import HELD, motion_named
from catheter_sim.diagnosis.data.nuisance import calibration_numbers
from catheter_sim.diagnosis.data.passed_over import known_inputs, notes_on_ignored
from catheter_sim.diagnosis.data.trials import Dataset, Trial
from catheter_sim.diagnosis.data.warm_up import judged_late
from catheter_sim.errors import InputError, cut, shown, unknown
from catheter_sim.tables import Table, read_table

ROLES = ("train", "heldout")

_KEYS: Mapping[str, tuple[str, ...]] = {
    "dataset": ("name", "robot", "source", "licence"),
    "conditions": ("gravity_mps2",),
    "channels": ("inputs", "outputs"),
}
_OPTIONAL: Mapping[str, tuple[str, ...]] = {"conditions": ("motion", "warm_up_s")}
_OPTIONAL_TABLES = ("calibration", "map")


def load_dataset(folder: str | os.PathLike[str]) -> Dataset:
    """Return the data set in `folder`, checked.

    Raises:
        InputError: anything in `dataset.toml`, the robot or a CSV file is missing, unknown, of the
            wrong kind or impossible; one line names the file and the key, line or column.
    """
    root = Path(folder)
    path = root / "dataset.toml"
    if not root.is_dir():
        raise InputError(f"{root}: no such folder; a data set is a folder with a dataset.toml")
    document = read_toml(path)
    check_keys(document, str(path))
    head = document["dataset"]
    name, reference, source, licence = texts_of(head, str(path))
    robot = load_robot(_robot_path(root, reference))
    gravity = gravity_of(document["conditions"]["gravity_mps2"], f"{path}: conditions.gravity_mps2")
    conditions = document["conditions"]
    motion = motion_named(conditions.get("motion", HELD.name), f"{path}: conditions.motion")
    inputs = channel_list(document["channels"]["inputs"], f"{path}: channels.inputs")
    outputs = channel_list(document["channels"]["outputs"], f"{path}: channels.outputs")
    check_channels(robot, inputs, outputs, str(path))
    mapping = file_map(document.get("map"), inputs, outputs, str(path))
    entries = trial_entries(document["trials"], root, str(path), mapping is not None)
    read = [_read_trial(robot, root, entry, inputs, outputs, mapping) for entry in entries]
    where = f"{path}: conditions.warm_up_s"
    trials = judged_late([trial for trial, _ in read], conditions.get("warm_up_s", 0.0), where)
    check_outputs(robot, trials, outputs, str(path))
    dataset = Dataset(
        folder=root,
        name=name,
        robot=robot,
        robot_reference=reference,
        source=source,
        licence=licence,
        gravity_mps2=gravity,
        input_channels=inputs,
        output_channels=outputs,
        trials=trials,
        motion=motion,
        calibration=calibration_numbers(document.get("calibration", {}), robot, str(path)) or None,
        notes=notes_on_ignored(robot, {trial.file: ignored for trial, ignored in read if ignored}),
    )
    files = {trial.file: hashlib.sha256((root / trial.file).read_bytes()).digest() for trial in trials}
    refuse_copies(dataset, files, str(path))
    return dataset


def check_keys(
    document: Mapping[str, Any],
    where: str,
    needed: Mapping[str, tuple[str, ...]] = _KEYS,
    optional: Mapping[str, tuple[str, ...]] = _OPTIONAL,
    optional_tables: tuple[str, ...] = _OPTIONAL_TABLES,
) -> None:
    """Raise `InputError` where a `dataset.toml` lacks a table or a key, or has an unknown one.

    Args:
        document: what was read.
        where: its name in errors.
        needed: keys of each table that must be there; `trials` must be, too.
        optional: further keys of these tables.
        optional_tables: further tables.
    """
    tables = (*needed, "trials")
    for table in document:
        if table not in (*tables, *optional_tables):
            raise unknown("table", table, (*tables, *optional_tables), where)
    missing = [f"the table [{table}]" for table in tables if table not in document]
    for table, keys in needed.items():
        if table not in document:
            continue
        if not isinstance(document[table], Mapping):
            raise InputError(f"{where}: {table}: a table is needed, not {shown(document[table])}")
        for key in document[table]:
            known = (*keys, *optional.get(table, ()))
            if key not in known:
                raise unknown("key", key, known, f"{where}: [{table}]")
        missing += [f"{table}.{key}" for key in keys if key not in document[table]]
    if missing:
        raise InputError(f"{where}: {', '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing")


def _text(value: Any, where: str) -> str:
    if not isinstance(value, str) or not value.strip():
        raise InputError(f"{where}: a text is needed, not {shown(value)}")
    return value


def texts_of(head: Mapping[str, Any], where: str) -> tuple[str, ...]:
    """Return the texts of the table `dataset` in its keys' order; raise `InputError` where one is none."""
    return tuple(_text(head[key], f"{where}: dataset.{key}") for key in _KEYS["dataset"])


def gravity_of(value: Any, where: str) -> Array:
    """Return gravity from a file, shape (3,) [m/s^2]; raise `InputError` where it is none."""
    if not isinstance(value, list) or len(value) != 3:
        raise InputError(f"{where}: a list of three numbers is needed, not {shown(value)}")
    for item in value:
        if isinstance(item, bool) or not isinstance(item, int | float) or not math.isfinite(item):
            raise InputError(f"{where}: a list of three finite numbers is needed, not {shown(value)}")
    return np.array(value, dtype=float)


def _robot_path(root: Path, reference: str) -> str:
    return str(root / reference) if reference.endswith(FILES) else reference


def channel_list(value: Any, where: str) -> tuple[str, ...]:
    """Return a list of column names from a file; raise `InputError` where it is none."""
    if not isinstance(value, list) or not value or not all(isinstance(name, str) for name in value):
        raise InputError(f"{where}: a list of channel names is needed, not {shown(value)}")
    for name in value:
        if value.count(name) > 1:
            raise InputError(f"{where}: {shown(name)} stands twice")
    return tuple(value)


def check_channels(robot: RobotSpec, inputs: Sequence[str], outputs: Sequence[str], where: str) -> None:
    """Raise `InputError` where a column is none of `robot`, or both an input and an output."""
    for name in inputs:
        if name in outputs:
            raise InputError(f"{where}: channels: {name!r} is both an input and an output")
    choices = known_inputs(robot)
    for name in inputs:
        if name not in choices:
            raise unknown("input channel", name, choices, f"{where}: channels.inputs")
    check_output_channels(robot, outputs, f"{where}: channels.outputs")


def trial_entries(value: Any, root: Path, where: str, mapped: bool) -> list[tuple[str, str, str]]:
    """Return of each trial its file, its role and the file of its inputs, "" where they are in the first."""
    keys = ("file", "role", "inputs") if mapped else ("file", "role")
    if not isinstance(value, list) or not value:
        raise InputError(f"{where}: at least one [[trials]] entry is needed")
    entries: list[tuple[str, str, str]] = []
    named: set[str] = set()
    places: dict[tuple[int, int], int] = {}  # of a file on its disk, whatever it is called: links, `./`
    for index, entry in enumerate(value):
        place = f"{where}: trials[{index}]"
        if not isinstance(entry, Mapping):
            raise InputError(f"{place}: a table is needed, not {shown(entry)}")
        for key in entry:
            if key not in keys:
                raise unknown("key", key, keys, place)
        if "file" not in entry:
            raise InputError(f"{place}.file is missing")
        file = _text(entry["file"], f"{place}.file")
        role = entry.get("role", "")
        if "role" in entry and role not in ROLES:
            raise unknown("role", str(role), ROLES, place)
        if file in named:
            raise InputError(f"{place}.file: {shown(file)} stands twice")
        named.add(file)
        if not _is_file(root / file):
            raise InputError(f"{place}.file: {root / file}: no such file")
        found = (root / file).stat()
        first = places.setdefault((found.st_dev, found.st_ino), index)
        if first != index:
            other = f"trials[{first}].file, {shown(entries[first][0])}"
            raise InputError(f"{place}.file: {shown(file)} is the same file as {other}")
        log = _text(entry["inputs"], f"{place}.inputs") if "inputs" in entry else ""
        if log and not _is_file(root / log):
            raise InputError(f"{place}.inputs: {root / log}: no such file")
        entries.append((file, role, log))
    if all(role == "heldout" for _, role, _ in entries):
        raise InputError(f"{where}: trials: every trial is held out; at least one must train")
    return entries


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a name that is too long for any file
        return False


def _read_trial(
    robot: RobotSpec,
    root: Path,
    entry: tuple[str, str, str],
    inputs: Sequence[str],
    outputs: Sequence[str],
    mapping: FileMap | None,
) -> tuple[Trial, tuple[str, ...]]:
    """Return the trial of an entry, and the names of its file's columns that are passed over."""
    file, role, log = entry
    if mapping is not None:
        table = read_mapped(root / file, mapping, inputs, outputs, root / log if log else None)
        return trial_of_columns(robot, file, role, table, inputs, outputs), table.ignored
    table = read_table(root / file, only=(*inputs, *outputs))
    for name in (*inputs, *outputs):
        if name not in table.columns:
            columns = ", ".join(("time_s", *table.columns, *table.ignored))
            raise InputError(
                f"{table.where}: no column {name}, which dataset.toml lists; columns: {cut(columns, 250)}"
            )
    return trial_of_columns(robot, file, role, table, inputs, outputs), table.ignored


def trial_of_columns(
    robot: RobotSpec, file: str, role: str, table: Table, inputs: Sequence[str], outputs: Sequence[str]
) -> Trial:
    """Return a trial from the columns of its table, which has them all."""
    measured = replace(table, columns={name: table.columns[name] for name in outputs})
    if all(np.isnan(values).all() for values in measured.columns.values()):
        raise InputError(f"{table.where}: every value of the outputs is missing")
    commanded = replace(table, columns={name: table.columns[name] for name in inputs})
    return Trial(file, role, read_inputs(robot, commanded), measured)
