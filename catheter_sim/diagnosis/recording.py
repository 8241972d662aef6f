"""A measured trial as a file of inputs: its own CSV file, by the `dataset.toml` beside it."""

from __future__ import annotations

import os
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.catalogue import read_toml
from catheter_sim.channels import output_channels, read_inputs
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.prepare import in_base_frame
from catheter_sim.diagnosis.trials import Dataset, Trial, known_inputs, points_of
from catheter_sim.errors import InputError, unknown
from catheter_sim.tables import Table, read_table

DATASET = "dataset.toml"
_LEVELS = 4
"""[folders] In this many, a file's own and those above it, a data set is looked for that lists the file. Why:
assumed. Data sets list files by day or by robot below them, not deeper."""
MEASURED, ERROR = "measured_", "error_"  # before the names of columns that are written


@dataclass(frozen=True)
class Recording:
    """Inputs from a file, with what was measured beside them.

    Attributes:
        inputs: what the robot was commanded.
        measured: rows of the file with its measured columns, which may be none; NaN is missing.
        conditions: the data set's gravity, shape (3,) [m/s^2], and whether the robot moved; None: the file
            belongs to no data set.
        said: one line on what was taken from a data set, "" for nothing.
    """

    inputs: Inputs
    measured: Table
    conditions: tuple[Array, bool] | None = None
    said: str = ""

    def beside(self, computed: Table) -> Table:
        """Return `computed` with the measured columns that it has, and computed minus measured."""
        rows = len(computed.time_s)
        columns = dict(computed.columns)
        for name, values in self.measured.columns.items():
            if name in computed.columns:
                columns[MEASURED + name] = values[:rows]
                columns[ERROR + name] = computed.columns[name] - values[:rows]
        return replace(computed, columns=columns)

    @property
    def point_names(self) -> tuple[str, ...]:
        """Names of the measured points, as `points_at` has them."""
        return tuple(points_of(tuple(self.measured.columns)))

    def points_at(self, time_s: Array) -> Array | None:
        """Return where points were measured, shape (r, k, 3) [m]; None where none was.

        `time_s`, shape (r,), is the inputs' own. NaN is missing; an axis that was not measured is 0.
        """
        columns = self.measured.columns
        places = points_of(tuple(columns))
        found = np.zeros((len(time_s), len(places), 3))
        for index, (name, axes) in enumerate(places.items()):
            for axis in axes:
                values = 1e-3 * columns[f"{name}_{axis}_mm"]
                found[:, index, "xyz".index(axis)] = np.interp(time_s, self.inputs.time_s, values)
        return found if places else None


def recording_of(
    robot: RobotSpec, path: str | os.PathLike[str], trial: str | None = None, other_robot: bool = False
) -> Recording:
    """Return the inputs in a file, and what it holds of measured outputs.

    Args:
        robot: what is driven.
        path: a CSV file of inputs, a trial's own file, or a data set's folder.
        trial: of a folder, the trial's file without its ending.
        other_robot: take a trial of another robot.

    Raises:
        InputError: no such trial, a trial of another robot, or a file that cannot be read as it must be.
    """
    place = Path(path)
    if place.is_dir():
        return _of_trial(robot, place, _named(place, trial), other_robot)
    if trial is not None:
        raise InputError(f"--trial {trial}: {place} is a file; --trial chooses a trial of a folder")
    listed = _listed(place)
    if listed is not None:
        return _of_trial(robot, *listed, other_robot)
    return _of_table(robot, read_table(place))


def table_to_compare(path: str | os.PathLike[str]) -> tuple[Table, str]:
    """Return the columns of a CSV file, and a line on what was taken from a data set, "" for nothing.

    Of a trial's own file they are what was measured, as its data set says, in the base's frame.
    """
    place = Path(path)
    if place.is_dir():
        raise InputError(f"{place}: a folder; give a CSV file, a trial's own too")
    listed = _listed(place)
    if listed is None:
        return read_table(place), ""
    data, found, frame = _trial(load_dataset(listed[0]), listed[1])
    return found.outputs, f"{place}: a trial of {data.name!r}: what was measured{frame}" if frame else ""


def _listed(place: Path) -> tuple[Path, str] | None:
    """Return the folder of the data set that lists a file, in the file's folder or above, and the entry."""
    own = place.absolute().parent
    for folder in list(place.absolute().parents)[:_LEVELS]:
        if not (folder / DATASET).is_file():
            continue
        try:
            files = _files(folder)
        except InputError:
            if folder == own:
                raise
            continue  # what lies above may be another's
        for file in files:
            if (folder / file).resolve() == place.resolve():
                return (place.parent if folder == own else folder), file
    return None


def _files(folder: Path) -> list[str]:
    """Return the files of a data set's trials."""
    entries = read_toml(folder / DATASET).get("trials", [])
    return [str(item["file"]) for item in entries if isinstance(item, dict) and "file" in item]


def _named(folder: Path, trial: str | None) -> str:
    if not (folder / DATASET).is_file():
        raise InputError(f"{folder}: a folder without {DATASET}; give a CSV file or a data set's folder")
    listed = _files(folder)
    stems = Counter(Path(file).stem for file in listed)
    files = {}
    for file in listed:  # two of one name in two folders are told by their folders
        stem = Path(file).stem
        files[stem if stems[stem] == 1 else Path(file).with_suffix("").as_posix()] = file
    if trial is None:
        raise InputError(f"{folder}: --trial is needed; choices: {', '.join(files)}")
    if trial not in files:
        raise unknown("trial", trial, files, str(folder))
    return files[trial]


def _of_trial(robot: RobotSpec, folder: Path, file: str, other_robot: bool) -> Recording:
    own = load_dataset(folder)
    if own.robot.name != robot.name and not other_robot:
        place = folder / own.robot_reference
        raise InputError(
            f"{folder / file}: measured on {own.robot.name}, not on {robot.name}; "
            f"give {place if place.is_file() else own.robot_reference}, or say --other-robot to take it"
        )
    data = own if own.robot == robot else load_dataset(folder, robot)
    data, found, frame = _trial(data, file)
    x, y, z = data.gravity_mps2
    said = (
        f"{folder / file}: a trial of {data.name!r}: {data.motion.name}, gravity {x:g},{y:g},{z:g} m/s^2, "
        f"columns as {DATASET} says{frame}"
    )
    return Recording(found.inputs, found.outputs, (data.gravity_mps2, data.motion.moving), said)


def _trial(data: Dataset, file: str) -> tuple[Dataset, Trial, str]:
    """Return the data in the base's frame, one of their trials, and words on a tracker elsewhere."""
    moved, frame = _in_base_frame(data)
    return moved, next(item for item in moved.trials if item.file == file), frame


def _in_base_frame(data: Dataset) -> tuple[Dataset, str]:
    """Return held data with positions where a diagnosis would have them, and words on a tracker elsewhere."""
    if data.motion.moving:  # its fast model is the simulation, too slow to ask here
        return data, ""
    try:
        moved, registration = in_base_frame(data)
    except InputError:  # nothing to tell the frame by; a diagnosis says so
        return data, ""
    if moved is data:
        return data, ""
    x, y, z = registration.shift_mm
    return (
        moved,
        f", the tracker's positions moved to the base, which it sees at ({x:.4g}, {y:.4g}, {z:.4g}) mm",
    )


def _of_table(robot: RobotSpec, table: Table) -> Recording:
    """Return a file's inputs; columns that the robot has as outputs are what was measured."""
    inputs = known_inputs(robot)
    outputs = [name for name in output_channels(robot) if name in table.columns and name not in inputs]
    measured = replace(table, columns={name: table.columns[name] for name in outputs})
    commanded = {name: values for name, values in table.columns.items() if name not in outputs}
    return Recording(read_inputs(robot, replace(table, columns=commanded)), measured)
