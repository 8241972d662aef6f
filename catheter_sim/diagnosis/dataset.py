"""Measured data from a folder: `dataset.toml` and its CSV files, read and checked.

Everything that can be wrong with the folder ends in one `InputError` that names the file and the
key, line or column. What comes out is complete: inputs in SI units, outputs in the units of their
columns with NaN for a missing value.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from catheter_sim.diagnosis.nuisance import calibration_numbers
from catheter_sim.diagnosis.trials import Dataset, Trial, cycles, is_repeat, split, unit_of
from catheter_sim.errors import InputError, unknown
from catheter_sim.robots.catalogue import load_robot, read_toml
from catheter_sim.robots.channels import (
    FORCE_CHANNELS,
    MOMENT_CHANNELS,
    check_output_channels,
    input_channels,
    output_channels,
    read_inputs,
)
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.posture import Array
from catheter_sim.tables import read_table

__all__ = ["Dataset", "Trial", "cycles", "is_repeat", "load_dataset", "split", "unit_of"]

ROLES = ("train", "heldout")
_LONGEST_WAY = 20.0  # of a position, in robot lengths

_KEYS: Mapping[str, tuple[str, ...]] = {
    "dataset": ("name", "robot", "source", "licence"),
    "conditions": ("gravity_mps2",),
    "channels": ("inputs", "outputs"),
}


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
    _check_keys(document, str(path))
    head = document["dataset"]
    name, reference, source, licence = (
        _text(head[key], f"{path}: dataset.{key}") for key in _KEYS["dataset"]
    )
    robot = load_robot(_robot_path(root, reference))
    gravity = _gravity(document["conditions"]["gravity_mps2"], f"{path}: conditions.gravity_mps2")
    inputs = _channels(document["channels"]["inputs"], f"{path}: channels.inputs")
    outputs = _channels(document["channels"]["outputs"], f"{path}: channels.outputs")
    _check_channels(robot, inputs, outputs, str(path))
    entries = _trial_entries(document["trials"], root, str(path))
    trials = tuple(_read_trial(robot, root, file, role, inputs, outputs) for file, role in entries)
    _check_outputs(robot, trials, outputs, str(path))
    return Dataset(
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
        calibration=calibration_numbers(document.get("calibration", {}), robot, str(path)),
    )


def _check_keys(document: Mapping[str, Any], where: str) -> None:
    tables = (*_KEYS, "trials")
    for table in document:
        if table not in (*tables, "calibration"):
            raise unknown("table", table, (*tables, "calibration"), where)
    for table in tables:
        if table not in document:
            raise InputError(f"{where}: the table [{table}] is missing")
    for table, keys in _KEYS.items():
        if not isinstance(document[table], Mapping):
            raise InputError(f"{where}: {table}: a table is needed, not {document[table]!r}")
        for key in document[table]:
            if key not in keys:
                raise unknown("key", key, keys, f"{where}: [{table}]")
        for key in keys:
            if key not in document[table]:
                raise InputError(f"{where}: {table}.{key} is missing")


def _text(value: Any, where: str) -> str:
    if not isinstance(value, str) or not value.strip():
        raise InputError(f"{where}: a text is needed, not {value!r}")
    return value


def _gravity(value: Any, where: str) -> Array:
    if not isinstance(value, list) or len(value) != 3:
        raise InputError(f"{where}: a list of three numbers is needed, not {value!r}")
    for item in value:
        if isinstance(item, bool) or not isinstance(item, int | float) or not math.isfinite(item):
            raise InputError(f"{where}: a list of three finite numbers is needed, not {value!r}")
    return np.array(value, dtype=float)


def _robot_path(root: Path, reference: str) -> str:
    return str(root / reference) if reference.endswith(".toml") else reference


def _channels(value: Any, where: str) -> tuple[str, ...]:
    if not isinstance(value, list) or not value or not all(isinstance(name, str) for name in value):
        raise InputError(f"{where}: a list of channel names is needed, not {value!r}")
    for name in value:
        if value.count(name) > 1:
            raise InputError(f"{where}: {name!r} stands twice")
    return tuple(value)


def _check_channels(robot: Robot, inputs: Sequence[str], outputs: Sequence[str], where: str) -> None:
    for name in inputs:
        if name in outputs:
            raise InputError(f"{where}: channels: {name!r} is both an input and an output")
    choices = _known_inputs(robot)
    for name in inputs:
        if name not in choices:
            raise unknown("input channel", name, choices, f"{where}: channels.inputs")
    check_output_channels(robot, outputs, f"{where}: channels.outputs")


def _known_inputs(robot: Robot) -> list[str]:
    own = [name for kind in ("tension", "displacement") for name in input_channels(robot, kind)]
    return [*own, *FORCE_CHANNELS, *MOMENT_CHANNELS]


def _trial_entries(value: Any, root: Path, where: str) -> list[tuple[str, str]]:
    if not isinstance(value, list) or not value:
        raise InputError(f"{where}: at least one [[trials]] entry is needed")
    entries: list[tuple[str, str]] = []
    for index, entry in enumerate(value):
        place = f"{where}: trials[{index}]"
        if not isinstance(entry, Mapping):
            raise InputError(f"{place}: a table is needed, not {entry!r}")
        for key in entry:
            if key not in ("file", "role"):
                raise unknown("key", key, ("file", "role"), place)
        if "file" not in entry:
            raise InputError(f"{place}.file is missing")
        file = _text(entry["file"], f"{place}.file")
        role = entry.get("role", "")
        if "role" in entry and role not in ROLES:
            raise unknown("role", str(role), ROLES, place)
        if file in (name for name, _ in entries):
            raise InputError(f"{place}.file: {file!r} stands twice")
        if not (root / file).is_file():
            raise InputError(f"{place}.file: {root / file}: no such file")
        entries.append((file, role))
    if all(role == "heldout" for _, role in entries):
        raise InputError(f"{where}: trials: every trial is held out; at least one must train")
    return entries


def _read_trial(
    robot: Robot, root: Path, file: str, role: str, inputs: Sequence[str], outputs: Sequence[str]
) -> Trial:
    table = read_table(root / file)
    for name in (*inputs, *outputs):
        if name not in table.columns:
            raise InputError(
                f"{table.where}: no column {name}, which dataset.toml lists; "
                f"columns: {', '.join(('time_s', *table.columns))}"
            )
    known = {*_known_inputs(robot), *output_channels(robot)}
    for name in table.columns:
        if name not in known and name not in (*inputs, *outputs):
            raise unknown("column", name, (*inputs, *outputs), table.where)
    measured = replace(table, columns={name: table.columns[name] for name in outputs})
    if all(np.isnan(values).all() for values in measured.columns.values()):
        raise InputError(f"{table.where}: every value of the outputs is missing")
    commanded = replace(table, columns={name: table.columns[name] for name in inputs})
    return Trial(file, role, read_inputs(robot, commanded), measured)


def _check_outputs(robot: Robot, trials: Iterable[Trial], outputs: Sequence[str], where: str) -> None:
    """Refuse columns that are empty, or whose size shows that they are not in their unit.

    A tracker has an origin of its own, so that of positions the way counts, not the place; whether they are
    in metres shows beside the robot's motion (`registration`).
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
        if unit == "mm" and highest - lowest > _LONGEST_WAY * length_mm:
            raise InputError(
                f"{file}: {name} moves over {highest - lowest:g}, but the robot is {length_mm:g} mm long; "
                "is the column in mm?"
            )
        for its_unit, limit, why in (
            ("deg", 720.0, "more than two turns"),
            ("1", 1.05, "part of a unit quaternion"),
        ):
            if unit == its_unit and largest > limit:
                raise InputError(f"{file}: {name} reaches {largest:g}, but {why}; is the column in {unit}?")
