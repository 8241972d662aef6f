"""Robots, inputs and measured data from what a user has at hand, and what the package offers."""

from __future__ import annotations

import csv
import html
import json
import math
import os
import sys
import warnings
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date, timedelta
from typing import TYPE_CHECKING, Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.robot import flag_of, number_of, whole_of
from catheter_sim.errors import InputError, cut, shown, unknown
from catheter_sim.tables import replaced_when_whole

if TYPE_CHECKING:
    from catheter_sim.core.document import Settings
    from catheter_sim.core.inputs import Inputs
    from catheter_sim.core.robot import RobotSpec
    from catheter_sim.diagnosis.trials import Dataset
    from catheter_sim.tables import Table

# ----------------------------------------------------------------------------------------------------
# Rows of a table that is printed, shown in a notebook, or made a data frame: one list feeds all three.

_WIDEST = 60  # characters of a cell as text
_SHOWN_ROWS = 30  # in a notebook


@dataclass(frozen=True)
class Listing(Sequence[Mapping[str, Any]]):
    """Rows with named columns.

    Attributes:
        title: what is listed.
        columns: the names, in order.
        rows: one mapping of columns to values each.

    Examples:
        >>> rows = Listing("Tips", ("robot", "tip_x_mm"), ({"robot": "section", "tip_x_mm": 12.5},))
        >>> print(rows)
        robot    tip_x_mm
        section  12.5
        >>> rows[0]["tip_x_mm"]
        12.5
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[Mapping[str, Any], ...]

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, index: Any) -> Any:
        return self.rows[index]

    def __iter__(self) -> Iterator[Mapping[str, Any]]:
        return iter(self.rows)

    def column(self, name: str) -> list[Any]:
        """Return the values of one column, row by row."""
        return [row.get(name) for row in self.rows]

    def to_dataframe(self) -> Any:
        """Return the rows as a pandas `DataFrame`; see `data_frame`."""
        return data_frame({name: self.column(name) for name in self.columns})

    def to_json(self) -> str:
        """Return the rows as JSON; an infinite number is a text, as `plain` says."""
        rows = [{name: plain(row.get(name)) for name in self.columns} for row in self.rows]
        return json.dumps(rows, ensure_ascii=False, allow_nan=False)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the rows as CSV, numbers to nine digits, truth as 1 and 0; NaN becomes an empty cell.

        Raises:
            InputError: the file cannot be written.
        """
        with replaced_when_whole(path) as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(self.columns)
            for row in self.rows:
                writer.writerow([_cell(row.get(name)) for name in self.columns])

    def __str__(self) -> str:
        cells = [self.columns, *(tuple(_text(row.get(name)) for name in self.columns) for row in self.rows)]
        widths = [min(max(map(len, column)), _WIDEST) for column in zip(*cells, strict=True)]
        lines = (
            "  ".join(_cut(cell).ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
            for line in cells
        )
        return "\n".join(lines)

    def __repr__(self) -> str:
        return f"<{self.title}: {len(self.rows)} rows>"

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{html.escape(name)}</th>" for name in self.columns)
        body = "".join(
            "<tr>"
            + "".join(f"<td>{html.escape(_text(row.get(name)))}</td>" for name in self.columns)
            + "</tr>"
            for row in self.rows[:_SHOWN_ROWS]
        )
        left = len(self.rows) - _SHOWN_ROWS
        more = f"<p>{left} more rows</p>" if left > 0 else ""
        title = html.escape(self.title)
        above = f"<caption>{title}</caption><thead><tr>{head}</tr></thead>"
        return f"<table>{above}<tbody>{body}</tbody></table>{more}"


def data_frame(columns: Mapping[str, Any]) -> Any:
    """Return `columns` as a pandas `DataFrame`.

    Raises:
        InputError: pandas is not installed.
    """
    try:
        import pandas
    except ImportError:
        raise InputError("to_dataframe: needs pandas: pip install pandas") from None
    return pandas.DataFrame(dict(columns))


def listing_of(title: str, columns: Mapping[str, Sequence[Any] | Array]) -> Listing:
    """Return columns of the same length as a listing."""
    rows = zip(*(_values(column) for column in columns.values()), strict=True)
    return Listing(title, tuple(columns), tuple(dict(zip(columns, row, strict=True)) for row in rows))


def _values(column: Sequence[Any] | Array) -> Sequence[Any]:
    return column.tolist() if isinstance(column, np.ndarray) else column


def plain(value: Any) -> Any:
    """Return a cell as JSON can hold it: an infinite number as TOML and --set write it, NaN as null."""
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return [plain(item) for item in value] if isinstance(value, tuple | list) else value


def _cell(value: Any) -> str:
    if isinstance(value, bool | np.bool_):
        return str(int(value))
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:.9g}"
    return "" if value is None else str(value)


def _text(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, tuple | list):
        return ", ".join(_text(item) for item in value)
    return " ".join(str(value).split())


def _cut(text: str) -> str:
    return text if len(text) <= _WIDEST else f"{text[: _WIDEST - 3]}..."


# ----------------------------------------------------------------------------------------------------
# Arguments that every public function takes in the same way, each bad one an error of one line.

AT_REST = (0.0, 0.0, 0.0)  # no gravity
_MOST_JOBS = 256


def path_of(value: str | os.PathLike[str], where: str) -> str:
    """Return a path, or an id, as a text.

    Raises:
        InputError: it is none.
    """
    if not isinstance(value, str | os.PathLike):
        raise InputError(f"{where}: a path is needed, not {shown(value)}")
    return os.fspath(value)


def robot_of(robot: RobotSpec | str | os.PathLike[str]) -> RobotSpec:
    """Return `robot` itself, or the one that it names.

    Raises:
        InputError: unknown robot, or neither a robot nor a name.
    """
    from catheter_sim.catalogue import robot_of as value_of

    return value_of(robot)


def gravity_of(value: Sequence[float]) -> Array:
    """Return gravity as an array, shape (3,) [m/s^2].

    Raises:
        InputError: not three finite numbers.
    """
    try:
        gravity = [number_of(part, "gravity_mps2") for part in value]
    except (TypeError, InputError):
        gravity = []
    if len(gravity) != 3:
        raise InputError(f"gravity_mps2 = {shown(value)}: three finite numbers are needed")
    return np.array(gravity)


def texts_of(value: Any, where: str, needed: str, least: int = 0) -> list[str]:
    """Return names as a list; one name will do.

    `where`: what they are called; `needed`: what would be right, in the plural; `least`: how many there must
    be.

    Raises:
        InputError: they are none.
    """
    if isinstance(value, str):
        return [value]
    try:
        listed = list(value)
    except TypeError:
        listed = [None]
    if len(listed) < least or not all(isinstance(name, str) for name in listed):
        raise InputError(f"{where} = {shown(value)}: {needed} are needed")
    return listed


def columns_of(names: Sequence[str] | str) -> list[str]:
    """Return names of columns as a list; one name will do.

    Raises:
        InputError: they are none.
    """
    return texts_of(names, "columns", "names of output columns", 1)


def mapping_of(value: Any, where: str, needed: str) -> dict[str, Any]:
    """Return a mapping by its names; None is an empty one. The others as of `texts_of`.

    Raises:
        InputError: it is none.
    """
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise InputError(f"{where} = {shown(value)}: a mapping of {needed} is needed")
    return {str(name): item for name, item in value.items()}


def jobs_of(value: int) -> int:
    """Return how many processes to fit with.

    Raises:
        InputError: it is no whole number, or not one of 1 to 256.
    """
    return whole_of(value, "jobs", f"a whole number of 1 to {_MOST_JOBS}", 1, _MOST_JOBS)


def budget_of(value: float) -> float:
    """Return how long a search may take [s].

    Raises:
        InputError: it is no number above zero.
    """
    return number_of(value, "budget_s", "a number of seconds above 0", lambda seconds: seconds > 0.0)


def progress_of(value: bool | None) -> bool:
    """Return whether to show what is being done; None: on a terminal, and in a notebook.

    Raises:
        InputError: it is neither True, False nor None.
    """
    from catheter_sim.progress import bars_shown

    return bars_shown() if value is None else flag_of(value, "progress")


# ----------------------------------------------------------------------------------------------------
# Robots, inputs and measured data from what a user has at hand: ids, files, mappings, data frames.


def load_robot(ref: str | os.PathLike[str], settings: Settings = ()) -> RobotSpec:
    """Return the robot that `ref` names, with `settings` applied, checked.

    Args:
        ref: a robot id (`list_robots`), an id with a parameter set (`chest_tube_section@prototype`), or the
            path of a robot `.toml`.
        settings: a text `KEY=VALUE`, several, or a mapping of dotted keys to values: every key of the robot's
            `.toml` form, and every effect's parameter (`effects.backlash.width_mm`).

    Raises:
        InputError: unknown robot or key, unreadable file, impossible robot.

    Examples:
        >>> import catheter_sim as cs
        >>> cs.load_robot("neuroendoscope_section", {"friction.mu": 0.2}).friction.mu
        0.2
    """
    from catheter_sim.catalogue import load_robot as load

    return load(path_of(ref, "robot"), settings)


def save_robot(robot: RobotSpec | str | os.PathLike[str], path: str | os.PathLike[str]) -> None:
    """Write a robot with its effects to a `.toml` that `load_robot` reads back to an equal value.

    Args:
        robot: a robot, its id or its file.
        path: file to write, `.toml`.

    Raises:
        InputError: the robot is not possible, or the file cannot be written or does not end in `.toml`.

    Examples:
        >>> import catheter_sim as cs
        >>> worn = cs.load_robot("mitral_4dof", {"effects.backlash.width_mm": 0.4})
        >>> cs.save_robot(worn, "worn.toml")
        >>> cs.load_robot("worn.toml") == worn
        True
    """
    from catheter_sim.catalogue import robot_toml
    from catheter_sim.tables import replaced_when_whole

    value, file = robot_of(robot), path_of(path, "save_robot")
    if not file.endswith(".toml"):
        raise InputError(f"{file}: a robot is saved as a table; choices: .toml")
    with replaced_when_whole(file) as target:
        target.write(robot_toml(value))


def inputs(robot: RobotSpec | str | os.PathLike[str], table: Any) -> Inputs:
    """Return what drives `robot`, from a mapping or a data frame.

    Args:
        robot: a robot, its id or its file.
        table: `time_s` [s], shape (r,), and input columns by name, each with its unit in its name, shape (r,)
            or one number for all rows. A channel that is left out is zero. `time_s` may hold dates or
            durations: they are taken as seconds, dates from the first row on.

    Raises:
        InputError: no `time_s`, an unknown channel, a missing or impossible value; the message names the row.

    Examples:
        >>> import catheter_sim as cs
        >>> pull = {"time_s": [0.0, 1.0], "tension_right_N": [0.0, 0.4]}
        >>> cs.inputs("neuroendoscope_section", pull).tendon[:, 0]
        array([0. , 0.4])
    """
    from catheter_sim.channels import read_inputs as read

    return read(robot_of(robot), table_of(table, "inputs"))


def read_inputs(robot: RobotSpec | str | os.PathLike[str], path: str | os.PathLike[str]) -> Inputs:
    """Return what drives `robot`, from a CSV file with `time_s` and the robot's channels.

    A trial's own file is read as the `dataset.toml` beside it says; it must be of this robot. Output columns
    are passed over.

    Raises:
        InputError: the file cannot be read, or as for `inputs`; the message names the line.

    Examples:
        >>> import catheter_sim as cs
        >>> from pathlib import Path
        >>> _ = Path("in.csv").write_text("time_s,tension_right_N\\n0,0\\n1,0.4\\n")
        >>> len(cs.read_inputs("neuroendoscope_section", "in.csv"))
        2
    """
    from catheter_sim.diagnosis.recording import recording_of

    return recording_of(robot_of(robot), path_of(path, "inputs")).inputs


def inputs_of(robot: RobotSpec, given: Any) -> Inputs:
    """Return `given` as inputs: inputs as they are, else a file's path, a mapping or a data frame."""
    from catheter_sim.core.inputs import Inputs as Value

    if isinstance(given, Value):
        if given.tendon.shape[1] != len(robot.tendons):
            raise InputError(
                f"inputs: of {given.tendon.shape[1]} tendons; {robot.name} has {len(robot.tendons)}"
            )
        return given
    return read_inputs(robot, given) if isinstance(given, str | os.PathLike) else inputs(robot, given)


def table_of(table: Any, where: str, known: Collection[str] | None = None) -> Table:
    """Return a mapping or a data frame, anything with `keys()` and columns by name, as a table.

    `table` has `time_s` and columns by name, shape (r,) or one number each. Columns that are not `known`
    (None: all are) may hold anything, and are named in the table's `ignored`.

    Raises:
        InputError: it is none, has no `time_s`, or columns of other lengths or of no numbers.
    """
    from catheter_sim.tables import Table as Value

    if isinstance(table, Value):
        return table
    if not is_table(table):
        raise InputError(f"{where}: a mapping or a data frame of columns is needed, not {shown(table)}")
    keys = {str(key): key for key in table.keys()}  # noqa: SIM118 - a data frame's iterator is its columns too
    if "time_s" not in keys:
        raise InputError(f"{where}: no column time_s; columns: {cut(', '.join(keys), 200) or '(none)'}")
    time_s = _seconds(table["time_s"], f"{where}: time_s")
    if time_s.ndim != 1 or not len(time_s):
        raise InputError(f"{where}: time_s: one number a row is needed, one row at least")
    rows = tuple(range(1, len(time_s) + 1))
    columns, ignored = {}, []
    for name, key in keys.items():
        if name == "time_s":
            continue
        if known is not None and name not in known:
            ignored.append(name)
            continue
        columns[name] = _column(table[key], time_s, f"{where}: {name}")
    read = Value(time_s, columns, where, rows, tuple(ignored), row_noun="row")
    if not np.isfinite(time_s).all():
        raise InputError(f"{read.row(int(np.argmin(np.isfinite(time_s))))}: time_s: a number is needed")
    return read


def is_table(value: Any) -> bool:
    """Return whether `value` has columns by name, as a mapping or a data frame has."""
    return hasattr(value, "keys") and hasattr(value, "__getitem__")


def _column(values: Any, time_s: Array, where: str) -> Array:
    numbers = _numbers(values, where)
    if numbers.ndim == 0:
        return np.full(len(time_s), float(numbers))
    if numbers.shape != time_s.shape:
        raise InputError(f"{where}: shape {numbers.shape} where time_s has {time_s.shape}")
    return numbers


def _numbers(values: Any, where: str) -> Array:
    try:
        if (
            np.asarray(values).dtype.kind not in "bmM"
        ):  # booleans, durations and dates would be read as numbers
            return np.array(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        pass
    raise InputError(f"{where}: numbers are needed, not {shown(values)}") from None


def _seconds(values: Any, where: str) -> Array:
    """Return a clock as numbers: dates from the first row on, durations as they are, by their own unit [s].

    Raises:
        InputError: they are neither numbers, dates nor durations, or one is missing.
    """
    try:
        given = np.asarray(values)
    except ValueError:  # rows of several lengths
        given = np.zeros(0)
    if given.ndim != 1 or not len(given) or given.dtype.kind not in "mMO":
        return _numbers(values, where)
    try:
        if given.dtype.kind == "M":
            if (
                np.datetime_data(given.dtype)[0] in "YM"
            ):  # years and months have no length, their first days do
                given = given.astype("datetime64[s]")
            return np.asarray((given - given[0]) / np.timedelta64(1, "s"))
        if given.dtype.kind == "m" and np.datetime_data(given.dtype)[0] not in ("Y", "M", "generic"):
            return np.asarray(given / np.timedelta64(1, "s"))
        if isinstance(given[0], date):  # of Python and of pandas
            return np.array([(item - given[0]).total_seconds() for item in given])
        if isinstance(given[0], timedelta):
            return np.array([item.total_seconds() for item in given])
    except (AttributeError, TypeError, ValueError):
        raise InputError(f"{where}: dates or durations of one kind are needed in every row") from None
    return _numbers(values, where)


def load_dataset(path: str | os.PathLike[str]) -> Dataset:
    """Return the measured data in a folder (`dataset.toml` and a CSV for each trial), checked.

    Columns that the robot does not know are ignored, with a warning.

    Raises:
        InputError: anything in the folder is missing, unknown or impossible.

    Examples:
        >>> import catheter_sim as cs
        >>> from catheter_sim.resources import assets_folder
        >>> cs.load_dataset(assets_folder() / "examples" / "opencr_v4").robot.name
        'opencr_v4'
    """
    from catheter_sim.diagnosis.dataset import load_dataset as load
    from catheter_sim.foreign.model import is_foreign

    folder = path_of(path, "dataset")
    if is_foreign(folder):
        raise InputError(
            f"{folder}: its robot is somebody's MJCF, driven by its controls: use diagnose_model"
        )
    return _warned_of_columns(load(folder))


def dataset(
    robot: RobotSpec | str | os.PathLike[str],
    tables: Any,
    outputs: Sequence[str] | None = None,
    gravity_mps2: Sequence[float] = AT_REST,
    roles: Mapping[str, str] | Sequence[str] = (),
    calibration: Mapping[str, Sequence[float] | Mapping[str, Any]] | None = None,
    name: str = "data",
    motion: str = "held",
    warm_up_s: float = 0.0,
) -> Dataset:
    """Return measured data from mappings or data frames, one a trial, checked as those in a folder are.

    Columns that the robot does not know are ignored, with a warning; a misspelled input is an error.

    Args:
        robot: a robot, its id or its file.
        tables: of each trial, by its name or in order, or of the only one: `time_s` [s], input columns and
            measured columns, as in a trial's CSV; NaN is a missing value of an output.
        outputs: names of the measured columns that count; default: every output column that all tables have.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
        roles: "train", "heldout" or "", by a trial's name or in order; default: the tool splits by whole
            trials, or by whole cycles of one trial.
        calibration: numbers of the robot with their bounds (`{"friction.mu": (0.0, 0.5)}`) that are fitted
            before anything is called wrong, as under `[calibration]` of a `dataset.toml`; numbers that are
            one by a name (`{"hole_mm": {"keys": (...), "range": (4.0, 5.0)}}`).
        name: what reports call the data.
        motion: "held": each row was held until the robot rested; "dynamic": it moved as the inputs did, from
            rest under each trial's first row.
        warm_up_s: so long each trial is played and not judged: a stretch of a longer recording does not
            begin at rest.

    Raises:
        InputError: anything is missing, unknown or impossible; the message names the trial.

    Examples:
        >>> import catheter_sim as cs
        >>> import numpy as np
        >>> t = np.arange(4.0)
        >>> trial = {"time_s": t, "tension_right_N": 0.1 * t, "tip_x_mm": 2.0 * t}
        >>> again = trial | {"tip_x_mm": 2.1 * t}
        >>> cs.dataset("neuroendoscope_section", [trial, again]).output_channels
        ('tip_x_mm',)
    """
    from catheter_sim.channels import output_channels
    from catheter_sim.diagnosis.dataset import dataset_of, known_inputs

    if not isinstance(name, str) or not name.strip():
        raise InputError(f"name = {shown(name)}: a text is needed")
    value = robot_of(robot)
    reference = os.fspath(robot) if isinstance(robot, str | os.PathLike) else value.name
    columns = {*known_inputs(value), *output_channels(value)}
    named = {trial: table_of(table, trial, columns) for trial, table in _named(tables, name).items()}
    given = _roles(roles, list(named))
    trials = [(trial, given.get(trial, ""), table) for trial, table in named.items()]
    gravity = gravity_of(gravity_mps2)
    free = mapping_of(calibration, "calibration", "numbers of the robot to (least, most)")
    made = dataset_of(value, reference, trials, outputs, gravity, free, name, motion, warm_up_s)
    return _warned_of_columns(made)


def _warned_of_columns(dataset: Dataset) -> Dataset:
    """Return `dataset`; warn, at the line outside the package that asked for it, of columns left out."""
    from catheter_sim.diagnosis.trials import UNKNOWN

    level, frame = 1, sys._getframe()
    while frame.f_back is not None and frame.f_globals["__name__"].startswith("catheter_sim."):
        level, frame = level + 1, frame.f_back
    for note in dataset.notes:
        if note.code == UNKNOWN:
            warnings.warn(note.text, stacklevel=level)
    return dataset


def _named(tables: Any, name: str) -> dict[str, Any]:
    """Return tables by their trials' names."""
    if is_table(tables) and "time_s" in tables:
        return {"trial_1": tables}
    if isinstance(tables, Mapping):
        return {str(trial): table for trial, table in tables.items()}
    if isinstance(tables, str) or not isinstance(tables, Iterable):
        raise InputError(f"{name}: tables, one a trial, are needed, not {shown(tables)}")
    return {f"trial_{index}": table for index, table in enumerate(tables, start=1)}


def _roles(roles: Mapping[str, str] | Sequence[str], trials: Sequence[str]) -> dict[str, str]:
    """Return roles by the trials' names."""
    if isinstance(roles, Mapping):
        for trial in roles:
            if trial not in trials:
                raise unknown("trial", str(trial), trials, "roles")
        return dict(roles)
    listed = list(roles) if isinstance(roles, Iterable) and not isinstance(roles, str) else [roles]
    if listed and (isinstance(roles, str) or len(listed) != len(trials)):
        raise InputError(f"roles = {shown(roles)}: one for each of {len(trials)} trials is needed, or none")
    return dict(zip(trials, listed, strict=False))


# ----------------------------------------------------------------------------------------------------
# What the package offers: robots, static models, effects and environments, as listings.
#
# The command line's `list` shows the same rows.

PREFIX = "catheter_sim/"  # of the environments' ids


def list_robots() -> Listing:
    """Return the robots by id, with their inputs and static models.

    Columns: `id`, `kind`, `description`, `inputs`, `parameter_sets` (ids of the same robot with other
    published numbers), `static_models`.

    Examples:
        >>> import catheter_sim as cs
        >>> "neuroendoscope_section" in cs.list_robots().column("id")
        True
    """
    from catheter_sim.catalogue import ROBOTS, load_robot
    from catheter_sim.channels import input_channels
    from catheter_sim.robots import kind_of

    rows = []
    for reference in ROBOTS:
        if "@" in reference:
            continue
        robot = load_robot(reference)
        row = {
            "id": reference,
            "kind": kind_of(robot).name,
            "description": robot.description,
            "inputs": tuple(input_channels(robot)),
            "parameter_sets": parameter_sets(reference),
            "static_models": tuple(list_models(robot).column("name")),
        }
        rows.append(row)
    return Listing("Robots", tuple(rows[0]), tuple(rows))


def parameter_sets(reference: str) -> tuple[str, ...]:
    """Return the ids of the parameter sets of the robot with the id `reference`."""
    from catheter_sim.catalogue import ROBOTS

    return tuple(name for name in ROBOTS if name.startswith(f"{reference}@"))


def list_models(robot: RobotSpec | str | os.PathLike[str] | None = None) -> Listing:
    """Return the static models that know `robot`, effects included.

    Columns: `name`, `summary`.

    Args:
        robot: a robot, its id or its file; None: the static models of all robots.

    Raises:
        InputError: unknown robot.

    Examples:
        >>> import catheter_sim as cs
        >>> cs.list_models("chest_tube_section").column("name")
        ['printed', 'complete', 'complete_sliding', 'virtual_work', 'pcc']
    """
    from catheter_sim.theory.static_models import STATIC_MODELS

    value = None if robot is None else robot_of(robot)
    rows = tuple(
        {"name": name, "summary": model.summary}
        for name, model in STATIC_MODELS.items()
        if value is None or model.applies_to(value)
    )
    whose = "all robots" if value is None else value.name
    return Listing(f"Static models of {whose}", ("name", "summary"), rows)


def list_effects(robot: RobotSpec | str | os.PathLike[str]) -> Listing:
    """Return the effects that `robot` (a robot, its id or its file) may have, a row for each parameter.

    Columns: `effect`, `form` (in which it acts), `parameter`, `no_effect` (the value that does nothing),
    `lower`, `upper`, `summary`. An effect is set as `effects.<effect>.<parameter>`.

    Raises:
        InputError: unknown robot.

    Examples:
        >>> import catheter_sim as cs
        >>> rows = cs.list_effects("neuroendoscope_section")
        >>> [row["parameter"] for row in rows if row["effect"] == "rate"][:2]
        ['lag_s', 'delay_s']
    """
    from catheter_sim.effects import EFFECTS

    value = robot_of(robot)
    rows = tuple(
        {
            "effect": name,
            "form": form.name,
            "parameter": item.name,
            "no_effect": item.null,
            "lower": item.lower,
            "upper": item.upper,
            "summary": effect.summary,
        }
        for name, effect in EFFECTS.items()
        for form in effect.forms
        for item in form.parameters(value)
    )
    columns = ("effect", "form", "parameter", "no_effect", "lower", "upper", "summary")
    return Listing(f"Effects of {value.name}", columns, rows)


def list_environments() -> Listing:
    """Return the Gymnasium environments by id, for `gymnasium.make`.

    Columns: `id`, `robot`, `steps` (of an episode).

    Examples:
        >>> import catheter_sim as cs
        >>> cs.list_environments()[0]["id"].startswith("catheter_sim/")
        True
    """
    import gymnasium

    rows = tuple(
        {"id": name, "robot": spec.kwargs.get("robot"), "steps": spec.max_episode_steps}
        for name, spec in sorted(gymnasium.registry.items())
        if name.startswith(PREFIX)
    )
    return Listing("Environments", ("id", "robot", "steps"), rows)
