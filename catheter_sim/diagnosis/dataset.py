"""Measured data from a folder or from tables, read and checked: `dataset.toml` and its CSV files."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.catalogue import FILES, load_robot, read_toml
from catheter_sim.channels import check_output_channels, output_channels, read_inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.mapping import FileMap, file_map, read_mapped
from catheter_sim.diagnosis.nuisance import calibration_numbers
from catheter_sim.diagnosis.trials import (
    HELD,
    Dataset,
    Trial,
    all_inputs,
    judged_late,
    known_inputs,
    measured_of,
    motion_named,
    notes_on_ignored,
    refuse_misspelled,
    split_trials,
    unit_of,
)
from catheter_sim.errors import InputError, cut, shown, unknown
from catheter_sim.tables import Table, read_table

LONGEST_WAY_LENGTHS = 20.0
"""[robot lengths] A position that moves over more is refused, because its column cannot be in mm. Why:
assumed. Points of a robot move by two lengths at most. A wrong unit is a factor of 25 or 1000."""
MOST_TURN_DEG = 720.0
"""[deg] A larger measured angle is refused. Why: no joint or tip turns more than twice around."""
MOST_QUATERNION = 1.05
"""[1] A measured quaternion with a larger part is refused. Why: parts of a unit quaternion are at most 1. The
rest allows for rounding in the file."""

# ----------------------------------------------------------------------------------------------------
# Columns of measured values that are empty, or not in their unit.


def check_outputs(robot: RobotSpec, trials: Iterable[Trial], outputs: Sequence[str], where: str) -> None:
    """Refuse columns that are empty, or whose size shows that they are not in their unit.

    A tracker has an origin of its own, so that a position's range counts, not its value. Whether positions
    are in metres is seen later, beside the robot's motion (`diagnosis.frame`).
    """
    length_mm = 1e3 * sum(segment.length_m for segment in robot.segments)
    for name in outputs:
        largest, file = -math.inf, ""
        lowest, highest = math.inf, -math.inf
        for trial in trials:
            values = trial.outputs.columns[name]
            if np.isnan(values).all():
                continue
            lowest, highest = min(lowest, float(np.nanmin(values))), max(highest, float(np.nanmax(values)))
            if float(np.nanmax(np.abs(values))) > largest:
                largest, file = float(np.nanmax(np.abs(values))), trial.outputs.where
        if not file:
            raise InputError(f"{where}: channels.outputs: {name} has no value in any trial")
        unit = unit_of(name)
        if unit == "mm" and highest - lowest > LONGEST_WAY_LENGTHS * length_mm:
            raise InputError(
                f"{file}: {name} moves over {highest - lowest:g}, but the robot is {length_mm:g} mm long; "
                "is the column in mm?"
            )
        for its_unit, limit, why in (
            ("deg", MOST_TURN_DEG, "more than two turns"),
            ("1", MOST_QUATERNION, "part of a unit quaternion"),
        ):
            if unit == its_unit and largest > limit:
                raise InputError(f"{file}: {name} reaches {largest:g}, but {why}; is the column in {unit}?")


# ----------------------------------------------------------------------------------------------------
# A held-out trial that is a training trial once more is refused.


def refuse_copies(dataset: Dataset, digests: Mapping[str, bytes], where: str) -> None:
    """Refuse a held-out trial that is a training trial once more, byte for byte.

    Measured data never repeat to the last digit, so that such a trial was copied, and a fit would be tested
    on what it was fitted to. A repeated measurement is no copy, nor is a trial of one row or in which nothing
    changes. `digests`: of each trial's bytes; `where`: what to call the data in the error.
    """
    first: dict[bytes, str] = {}
    copies: dict[str, str] = {}
    changing = {trial.file for trial in dataset.trials if _changes(trial)}
    for file, digest in digests.items():
        if file in changing and first.setdefault(digest, file) != file:
            copies[file] = first[digest]
    if not copies or all(trial.role == "train" for trial in dataset.trials):
        return
    roles = {trial.file: trial.role for part in split_trials(dataset) for trial in part}
    for copy, original in copies.items():
        if roles[copy] != roles[original]:
            raise InputError(
                f"{where}: trials: {shown(copy)} is a copy of {shown(original)}, byte for byte, and one of "
                "them trains while the other is held out; leave one of them out"
            )


def _changes(trial: Trial) -> bool:
    values = np.hstack([all_inputs(trial.inputs), measured_of(trial, tuple(trial.outputs.columns))])
    return bool((values != values[0]).any())


# ----------------------------------------------------------------------------------------------------
# Measured data from a folder: `dataset.toml` and its CSV files, read and checked.
#
# Everything that can be wrong with the folder ends in one `InputError` that names the file and the key,
# line or column. What comes out is complete: inputs in SI units, outputs in the units of their columns with
# NaN for a missing value.

ROLES = ("train", "heldout")

_KEYS: Mapping[str, tuple[str, ...]] = {
    "dataset": ("name", "robot", "source", "licence"),
    "conditions": ("gravity_mps2",),
    "channels": ("inputs", "outputs"),
}
_OPTIONAL: Mapping[str, tuple[str, ...]] = {"conditions": ("motion", "warm_up_s")}
_OPTIONAL_TABLES = ("calibration", "map")


def load_dataset(folder: str | os.PathLike[str], robot: RobotSpec | None = None) -> Dataset:
    """Return the data set in `folder`, checked; of `robot` in the place of its own, if there is one.

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
    robot = robot or load_robot(str(root / reference) if reference.endswith(FILES) else reference)
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

    `needed` has the keys of each table that must be there (`trials` must be, too), `optional` further keys of
    these; `where` is its name in errors.
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


# ----------------------------------------------------------------------------------------------------
# Measured data from tables that lie in no folder, checked as those in one are.


def dataset_of(
    robot: RobotSpec,
    reference: str,
    tables: Sequence[tuple[str, str, Table]],
    outputs: Sequence[str] | None,
    gravity_mps2: Array,
    calibration: Mapping[str, Sequence[float] | Mapping[str, Any]],
    name: str,
    motion: str = HELD.name,
    warm_up_s: float = 0.0,
) -> Dataset:
    """Return measured data that lie in no folder, checked as those in one are.

    Args:
        robot, reference: the robot as specified, and its id or name.
        tables: of each trial its name, its role ("train", "heldout" or "") and its columns.
        outputs: columns that were measured; None: every output column that all tables have.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        calibration, motion, warm_up_s: as `[calibration]` and `[conditions]` of a `dataset.toml`.
        name: of the data.

    Raises:
        InputError: a trial or a column is missing, unknown or impossible.
    """
    if not tables:
        raise InputError(f"{name}: at least one trial is needed")
    inputs = tuple(
        column for column in known_inputs(robot) if any(column in table.columns for _, _, table in tables)
    )
    if outputs is None:
        measured = _measured_by_all(robot, tables, inputs, name)
    else:
        measured = channel_list(_listed(outputs), f"{name}: outputs")
    _check_tables(robot, tables, inputs, measured, name)
    read = [_trial_of(robot, trial, role, table, inputs, measured) for trial, role, table in tables]
    trials = judged_late([trial for trial, _ in read], warm_up_s, f"{name}: warm_up_s")
    check_outputs(robot, trials, measured, name)
    bounds = {key: _listed(item) for key, item in calibration.items()}
    dataset = Dataset(
        folder=Path(name),
        name=name,
        robot=robot,
        robot_reference=reference,
        source="",
        licence="",
        gravity_mps2=gravity_mps2,
        input_channels=inputs,
        output_channels=measured,
        trials=trials,
        motion=motion_named(motion, f"{name}: motion"),
        calibration=calibration_numbers(bounds, robot, name) or None,
        notes=notes_on_ignored(
            robot,
            {trial.file: ignored for trial, ignored in read if ignored},
            "no channel that every trial has," if outputs is None else "not among the outputs",
            output_channels(robot) if outputs is None else (),
        ),
    )
    refuse_copies(dataset, {trial.file: _content(trial) for trial in trials}, name)
    return dataset


def _check_tables(
    robot: RobotSpec,
    tables: Sequence[tuple[str, str, Table]],
    inputs: tuple[str, ...],
    outputs: tuple[str, ...],
    name: str,
) -> None:
    """Raise `InputError` where a column or role is unknown, no trial trains, or an input is misspelled."""
    check_channels(robot, inputs, outputs, name)
    for trial, role, table in tables:
        if role and role not in ROLES:
            raise unknown("role", str(role), ROLES, f"{name}: {trial}")
        refuse_misspelled(robot, table)
    if all(role == "heldout" for _, role, _ in tables):
        raise InputError(f"{name}: every trial is held out; at least one must train")


def _measured_by_all(
    robot: RobotSpec, tables: Sequence[tuple[str, str, Table]], inputs: Sequence[str], where: str
) -> tuple[str, ...]:
    """Return the output columns that all of `tables` have and that are no inputs, in the robot's order."""
    measured = tuple(
        name
        for name in output_channels(robot)
        if name not in inputs and all(name in table.columns for _, _, table in tables)
    )
    if not measured:
        raise InputError(f"{where}: no output column that every trial has; choices: tip_x_mm ...")
    return measured


def _trial_of(
    robot: RobotSpec, file: str, role: str, table: Table, inputs: Sequence[str], outputs: Sequence[str]
) -> tuple[Trial, tuple[str, ...]]:
    """Return the trial in `table`, and the names of columns that are passed over."""
    for name in outputs:
        if name not in table.columns:
            columns = ", ".join(("time_s", *table.columns, *table.ignored))
            raise InputError(f"{table.where}: no column {name}; columns: {cut(columns, 250)}")
    passed_over = tuple(name for name in table.columns if name not in (*inputs, *outputs))
    commanded = tuple(name for name in inputs if name in table.columns)
    return trial_of_columns(robot, file, role, table, commanded, outputs), (*table.ignored, *passed_over)


def _listed(value: Any) -> Any:
    """Return a sequence as a list, as files hold it, in a mapping too; what is none stays what it is."""
    if isinstance(value, Mapping):
        return {key: _listed(item) for key, item in value.items()}
    return value if isinstance(value, str) or not isinstance(value, Iterable) else list(value)


def _content(trial: Trial) -> bytes:
    """Return a digest of a trial's numbers."""
    inputs, columns = trial.inputs, trial.outputs.columns.values()
    parts = (inputs.time_s, inputs.tendon, inputs.force_tip, inputs.moment_tip, *columns)
    return hashlib.sha256(b"".join(np.ascontiguousarray(part).tobytes() for part in parts)).digest()
