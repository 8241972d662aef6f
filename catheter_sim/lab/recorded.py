"""A bench that is real: it plays what it finds in a folder, and puts its recordings there as they come.

`play` writes `NAME_inputs.csv`; whoever runs the bench plays that and writes `NAME.csv` beside it: `time_s`,
the measured columns, and, if the bench logs them, the inputs. Files come as they come: half-written, twice,
under a name like `NAME (1).csv`, in any order, with rows appended twice. A recording counts once it is
whole: it reaches the programme's end, and its last line has ended (or nothing was written for ten seconds).
What was once read is kept.
"""

from __future__ import annotations

import csv
import io
import os
import re
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import check_output_channels
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, cut, shown
from catheter_sim.lab.rig import Limits, Said, asked_columns, completed, named_robot
from catheter_sim.tables import MAX_ROWS, Table, time_text, write_table

INPUTS_SUFFIX = "_inputs.csv"
STILL_S = 10.0  # a file that has not changed for so long is not being written any more
_AGREES = 0.02  # of an input's range in the programme, by which a recording's may differ
_AGAIN = r"(?: \(\d+\)|[-_ ](?:copy|again|retry)(?:[-_ ]?\d+)?)?"  # what is put behind the name of a copy
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")


@dataclass(frozen=True)
class _Arrived:
    """What a file holds so far: its rows, or why there is none to use yet."""

    table: Table | None
    words: str


@dataclass
class RecordedRig:
    """A bench that answers by files in a folder (`lab.rig.Rig`).

    Attributes:
        folder: where inputs are put and recordings arrive; it is there.
        robot: as specified.
        reference: how a data set names it.
        columns: what every recording measures.
        gravity_mps2: in the base frame, shape (3,) [m/s^2].
        limits: what the bench can do.
        said: what errors call them.
    """

    folder: Path
    robot: RobotSpec
    reference: str
    columns: tuple[str, ...]
    gravity_mps2: Array
    limits: Limits
    said: Said = field(default_factory=Said)
    _played: tuple[str, Table] | None = field(default=None, repr=False)
    _kept: dict[str, Table] = field(default_factory=dict, repr=False)
    _words: str = field(default="", repr=False)

    def __post_init__(self) -> None:
        """Check the folder and the columns.

        Raises:
            InputError: no such folder, or a column that the robot has not.
        """
        if not Path(self.folder).is_dir():
            raise InputError(f"{self.folder}: no such folder; recordings arrive in a folder that is there")
        check_output_channels(self.robot, self.columns, self.said.columns)

    def reset(self) -> None:
        """Forget what was played; the person at the bench brings the robot to rest."""
        self._played = None

    def play(self, inputs: Table, name: str) -> None:
        """Put inputs where the bench finds them: see `Rig.play`.

        Raises:
            InputError: beyond the limits, a name that is no file's, or the folder cannot be written.
        """
        if not _NAME.fullmatch(name):
            raise InputError(f"{shown(name)}: a play's name has letters, digits, _, - and . alone")
        self.limits.check(inputs)
        inputs.require_complete()
        write_table(inputs, Path(self.folder) / f"{name}{INPUTS_SUFFIX}")
        self._played = (name, inputs)

    def read(self, columns: Sequence[str] | None = None) -> Table | None:
        """Return the recording of the last play, None where it has not arrived: see `Rig.read`.

        Raises:
            InputError: nothing was played, no such column, or the file that has arrived is not this play's
                recording: a column is missing, a cell is no number, the inputs are others.
        """
        if self._played is None:
            raise InputError("lab: nothing was played")
        name, inputs = self._played
        wanted = asked_columns(columns, self.columns)
        if name not in self._kept:
            found = self._arrived(name, inputs)
            if found is None:
                return None
            self._kept[name] = found
        table = self._kept[name]
        measured = {column: table.columns[column] for column in wanted}
        commanded = {column: table.columns[column] for column in inputs.columns}
        return Table(table.time_s, {**commanded, **measured}, table.where)

    def waiting(self) -> str:
        """Return what is missing, in words; "" for nothing."""
        return self._words

    def _arrived(self, name: str, inputs: Table) -> Table | None:
        """Return the first whole recording of a play; of several, the one whose name is the play's own."""
        pattern = re.compile(re.escape(name) + _AGAIN + r"\.csv", re.IGNORECASE)
        files = [path for path in Path(self.folder).iterdir() if pattern.fullmatch(path.name)]
        files.sort(key=lambda path: (len(path.name), path.name))
        words = [f"{Path(self.folder) / name}.csv: not there yet"]
        refused: list[InputError] = []
        for path in files:
            try:
                got = self._whole(path, inputs)
            except InputError as error:  # another copy may be sound
                refused.append(error)
                continue
            if got.table is not None:
                self._words = ""
                return got.table
            words.append(got.words)
        if refused and len(words) == 1:
            raise refused[0]
        self._words = words[-1]
        return None

    def _whole(self, path: Path, inputs: Table) -> _Arrived:
        """Return a file's recording if it is whole.

        Raises:
            InputError: it is whole and wrong.
        """
        try:
            raw, age_s = path.read_bytes(), time.time() - path.stat().st_mtime
        except OSError as error:  # it was taken away, or is being replaced
            return _Arrived(None, f"{path}: cannot be read yet: {error.strerror}")
        ended = raw.endswith((b"\n", b"\r"))
        still = age_s >= STILL_S
        lines = _cells(raw, str(path), ended or still)
        if len(lines) < 2:
            return _Arrived(None, f"{path}: no row yet")
        header = [cell.strip() for cell in lines[0][1]]
        if "time_s" not in header:
            raise InputError(f"{path}: no column time_s; columns: {cut(', '.join(header), 200)}")
        missing = [name for name in self.columns if name not in header]
        if missing:
            raise InputError(f"{path}: no column {missing[0]}; columns: {cut(', '.join(header), 200)}")
        wanted = [name for name in (*inputs.columns, *self.columns) if name in header]
        rows = _numbers(lines[1:], header, ["time_s", *wanted], str(path))
        values = _in_order(rows, str(path), wanted)
        end_s = float(inputs.time_s[-1] - inputs.time_s[0])
        spacing_s = float(np.diff(inputs.time_s).max(initial=0.0))
        time_s = values[:, 0] - values[0, 0] if len(values) else np.zeros(0)
        if not len(values) or time_s[-1] < end_s - 0.5 * min(spacing_s, 0.1 * end_s):
            so_far = time_text(round(float(time_s[-1]), 3)) if len(values) else "0"
            return _Arrived(None, f"{path}: {so_far} s of {time_text(end_s)} s so far")
        found = {column: values[:, 1 + index] for index, column in enumerate(wanted)}
        table = Table(time_s, found, str(path))
        return _Arrived(_with_inputs(table, inputs, self.columns), "")


def recorded_rig(
    folder: Path,
    robot: RobotSpec | str,
    columns: tuple[str, ...],
    limits: Mapping[str, tuple[float, float]],
    longest_s: float,
    gravity_mps2: Array,
    said: Said | None = None,
) -> RecordedRig:
    """Return the bench of a robot, its id or its file, whose limits are checked: see `RecordedRig`.

    Raises:
        InputError: unknown robot or column, impossible limits, or no such folder.
    """
    (value, reference), words = named_robot(robot), said or Said()
    can = Limits(completed(value, limits, words.limits), longest_s)
    return RecordedRig(folder, value, reference, columns, gravity_mps2, can, words)


def _cells(raw: bytes, where: str, ended: bool) -> list[tuple[int, list[str]]]:
    """Return the lines that have cells, with their numbers; the last one only if it has ended."""
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        if not ended:
            return []  # half of a letter: more is coming
        raise InputError(f"{where}: cannot be read as CSV: it is no UTF-8 text") from None
    if not ended:
        text = text[: max(text.rfind("\n"), text.rfind("\r")) + 1]
    rows = [(number, row) for number, row in enumerate(csv.reader(io.StringIO(text)), start=1) if row]
    if len(rows) > MAX_ROWS + 1:
        raise InputError(f"{where}: more than {MAX_ROWS} rows; thin them out")
    return rows


def _numbers(
    lines: Sequence[tuple[int, list[str]]], header: Sequence[str], wanted: Sequence[str], where: str
) -> list[tuple[int, tuple[float, ...]]]:
    """Return line numbers and values of the rows.

    A header that comes again, as where a file was appended twice, is passed over.

    Raises:
        InputError: a row has too few or too many cells, unless it is the last, or a cell is no number.
    """
    places = [list(header).index(name) for name in wanted]
    rows: list[tuple[int, tuple[float, ...]]] = []
    for position, (number, cells) in enumerate(lines):
        if [cell.strip() for cell in cells] == list(header):
            continue
        if len(cells) != len(header):
            if position == len(lines) - 1 and len(cells) < len(header):
                return rows  # its end has not arrived
            raise InputError(f"{where}: line {number}: {len(cells)} cells where the header has {len(header)}")
        row = []
        for place, name in zip(places, wanted, strict=True):
            text = cells[place].strip()
            try:
                value = float(text) if text else float("nan")
            except ValueError:
                raise InputError(f"{where}: line {number}: {name} = {shown(text)}: not a number") from None
            if text and not np.isfinite(value):
                raise InputError(f"{where}: line {number}: {name} = {cut(text, 40)}: not a finite number")
            row.append(value)
        if np.isnan(row[0]):
            raise InputError(f"{where}: line {number}: time_s: a number is needed")
        rows.append((number, tuple(row)))
    return rows


def _in_order(rows: Sequence[tuple[int, tuple[float, ...]]], where: str, wanted: Sequence[str]) -> Array:
    """Return rows by time, each once, shape (r, 1 + columns).

    Raises:
        InputError: two rows of one time differ.
    """
    found: dict[float, tuple[int, tuple[float, ...]]] = {}
    for number, row in rows:
        first = found.setdefault(row[0], (number, row))
        if not np.array_equal(first[1], row, equal_nan=True):
            column = next(
                name
                for index, name in enumerate(wanted, start=1)
                if not np.array_equal([first[1][index]], [row[index]], equal_nan=True)
            )
            raise InputError(
                f"{where}: lines {first[0]} and {number}: time_s = {time_text(row[0])} stands twice, with "
                f"other values of {column}"
            )
    return np.array([found[key][1] for key in sorted(found)]).reshape(len(found), 1 + len(wanted))


def _with_inputs(table: Table, inputs: Table, measured: Sequence[str]) -> Table:
    """Return a recording with the programme's inputs, on the line between two rows where it logs none.

    Raises:
        InputError: what it logs is not what was to be played, or an output has no value at all.
    """
    clock = inputs.time_s - inputs.time_s[0]
    commanded = {}
    for name, values in inputs.columns.items():
        planned = np.interp(table.time_s, clock, values)
        logged = table.columns.get(name)
        commanded[name] = planned if logged is None else logged
        if logged is None:
            continue
        room = _AGREES * max(float(np.ptp(values)), float(np.abs(values).max()), 1e-9)
        wrong = ~(np.abs(logged - planned) <= room)
        if wrong.any():
            row = int(np.argmax(wrong))
            raise InputError(
                f"{table.where}: time_s = {time_text(table.time_s[row])}: {name} = {logged[row]:g}, but "
                f"{os.path.basename(inputs.where)} plays {planned[row]:.6g}: is it another recording?"
            )
    for name in measured:
        if np.isnan(table.columns[name]).all():
            raise InputError(f"{table.where}: {name}: every value is missing")
    return Table(table.time_s, {**commanded, **{name: table.columns[name] for name in measured}}, table.where)
