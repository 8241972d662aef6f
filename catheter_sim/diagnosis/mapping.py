"""Files as trackers and loggers write them, and the table `[map]` that says what their columns mean."""

from __future__ import annotations

import csv
import io
import math
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.errors import InputError, cut, shown, unknown
from catheter_sim.tables import MAX_ROWS, Table

# ----------------------------------------------------------------------------------------------------
# Units that a file may be in, and the factor from each to the unit of a channel.

COUNTS = "counts"  # of an encoder; `counts_per_turn` says how many make a turn
# Of a channel's unit: units of files, and what a file's number is multiplied by.
UNITS: Mapping[str, Mapping[str, float]] = {
    "mm": {"mm": 1.0, "m": 1e3, "cm": 10.0, "um": 1e-3, "in": 25.4},
    "deg": {"deg": 1.0, "rad": 180.0 / math.pi, "turn": 360.0},
    "rad": {"deg": math.pi / 180.0, "rad": 1.0, "turn": 2.0 * math.pi},
    "m": {"mm": 1e-3, "m": 1.0, "cm": 1e-2, "um": 1e-6, "in": 25.4e-3},
    "N": {"N": 1.0, "mN": 1e-3, "kN": 1e3, "gf": 9.80665e-3, "kgf": 9.80665, "lbf": 4.4482216152605},
    "Nm": {"Nm": 1.0, "Nmm": 1e-3, "mNm": 1e-3},
    "1": {"1": 1.0},
}
SECONDS: Mapping[str, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}
DATE = "date"  # texts such as 2026-05-11T18:30:02.5
ANGLES = (*UNITS["deg"], COUNTS)  # of a motor; a spool's radius turns its angle into a way


def channel_unit(channel: str) -> str:
    """Return the unit of a channel, the end of its name; "1" for parts of a quaternion."""
    unit = channel.rsplit("_", 1)[-1]
    return unit if unit in ("mm", "deg", "N", "Nm") else "1"


def factor_to(
    own: str,
    unit: str,
    where: str,
    spool_radius_mm: float | None = None,
    counts_per_turn: float | None = None,
) -> float:
    """Return what a number in `unit` is multiplied by to be a channel's.

    `own` is the channel's unit, `unit` the file's, `where` its name and key for errors.

    Raises:
        InputError: a unit that the channel cannot have, the message names the choices; or counts without
            `counts_per_turn`, or the other way round.
    """
    units = UNITS[own] if spool_radius_mm is None else UNITS["rad"]
    choices = [*units, *([COUNTS] if "turn" in units else [])]
    if unit not in choices:
        if spool_radius_mm is not None:
            raise unknown("unit", unit, choices, f"{where}: with spool_radius_mm")
        choices += [f"{name} with spool_radius_mm" for name in ANGLES if own == "mm"]
        raise unknown("unit", unit, choices, f"{where}: unit")
    if (unit == COUNTS) != (counts_per_turn is not None):
        raise InputError(f'{where}: counts_per_turn goes with unit = "{COUNTS}", and with no other')
    factor = units[unit] if counts_per_turn is None else units["turn"] / counts_per_turn
    return factor if spool_radius_mm is None else factor * spool_radius_mm


# ----------------------------------------------------------------------------------------------------
# A file as it was written by whatever measured: columns by name, cells as texts, what its head says.

MAX_RAW_ROWS = 300_000  # of a file; `every` thins them out
_DELIMITERS = ",;\t"
Rows = list[tuple[int, list[str]]]  # each with its line


@dataclass(frozen=True)
class RawFile:
    """A file of measurements before anything is known of its columns.

    Attributes:
        where: its path, for errors.
        layout: "plain" (one row of names), "motive" (OptiTrack Motive) or "vicon" (Vicon Nexus).
        names: of the columns, each once; a layout of several rows of names has them joined.
        cells: the rows, shape (r, c), texts.
        lines: of the file, one a row.
        units: by column, where the file says them.
        decimal: the sign before decimals, "." or ",".
    """

    where: str
    layout: str
    names: tuple[str, ...]
    cells: Sequence[Sequence[str]]
    lines: tuple[int, ...]
    units: Mapping[str, str] = field(default_factory=dict)
    decimal: str = "."

    def place(self, name: str, where: str) -> int:
        """Return the index of a column; raise `InputError` where the file has no such column."""
        if name not in self.names:
            raise unknown("column", name, self.names, f"{where}: {self.where}")
        return self.names.index(name)

    def texts(self, name: str, where: str) -> list[str]:
        """Return a column's cells, without blanks around them."""
        place = self.place(name, where)
        return [row[place].strip() for row in self.cells]

    def numbers(self, name: str, where: str) -> Array:
        """Return a column's numbers, shape (r,); NaN where a cell is empty or says nan.

        Raises:
            InputError: no such column, or a cell that is no number; the message names the line.
        """
        found = np.empty(len(self.cells))
        for row, text in enumerate(self.texts(name, where)):
            value = as_number(text, self.decimal)
            if value is None or np.isinf(value):
                said = f"{self.where}: line {self.lines[row]}: {cut(name, 60)} = {shown(text)}"
                raise InputError(f"{said}: not a finite number")
            found[row] = value
        return found


def as_number(text: str, decimal: str = ".") -> float | None:
    """Return the number in a cell, NaN where it is empty, None where it holds none."""
    text = text.strip()
    if not text:
        return float("nan")
    if decimal != ".":
        text = text.replace(decimal, ".")
    try:
        return float(text.replace("_", " "))  # Python would read 1_000 as a thousand
    except ValueError:
        return None


def read_rows(path: str | os.PathLike[str]) -> tuple[Rows, str]:
    """Return the rows of a delimited file, empty ones too, each with its line, and the delimiter.

    Raises:
        InputError: it cannot be read, holds nothing, or more than `MAX_RAW_ROWS` rows.
    """
    where = os.fspath(path)
    try:
        with open(where, newline="", encoding="utf-8-sig") as file:
            text = file.read()
        delimiter = _delimiter(text)
        reader = csv.reader(io.StringIO(text), delimiter=delimiter)
        rows = [(reader.line_num, row) for row in reader]
    except FileNotFoundError:
        raise InputError(f"{where}: no such file") from None
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{where}: cannot be read as CSV: {error}") from None
    if not any(any(cell.strip() for cell in row) for _, row in rows):
        raise InputError(f"{where}: the file is empty; a header with the columns' names is needed")
    if len(rows) > MAX_RAW_ROWS:
        raise InputError(f"{where}: more than {MAX_RAW_ROWS} rows; thin them out")
    return rows, delimiter


def _delimiter(text: str) -> str:
    """Return what parts the cells: the sign that the fullest of the first lines has most of."""
    lines = [line for line in text[:20_000].splitlines()[:12] if not line.startswith("#")]
    counts = {sign: max((line.count(sign) for line in lines), default=0) for sign in _DELIMITERS}
    if counts[";"] and all(line.count(";") in (0, counts[";"]) for line in lines):
        return ";"  # commas may be decimal signs then
    return max(counts, key=lambda sign: counts[sign])


def joined_names(parts: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Return a name for each column from the rows above it; what would stand twice is numbered."""
    names: list[str] = []
    for column in parts:
        name = " ".join(part.strip() for part in column if part.strip()) or "(no name)"
        same = sum(other == name or other.startswith(f"{name} #") for other in names)
        names.append(f"{name} #{same + 1}" if same else name)
    return tuple(names)


def data_rows(where: str, rows: Rows, width: int) -> tuple[tuple[list[str], ...], tuple[int, ...]]:
    """Return the cells of the rows up to the first empty one, each as wide as the header, and their lines.

    Raises:
        InputError: there is none, or one has more or fewer cells; the message names the line.
    """
    cells: list[list[str]] = []
    lines: list[int] = []
    for line, row in rows:
        if not any(cell.strip() for cell in row):
            if cells:
                break
            continue
        if len(row) > width and any(cell.strip() for cell in row[width:]):
            raise InputError(f"{where}: line {line}: {len(row)} cells where the header has {width}")
        cells.append([*row[:width], *[""] * (width - len(row))])
        lines.append(line)
    if not cells:
        raise InputError(f"{where}: a header without rows")
    return tuple(cells), tuple(lines)


# ----------------------------------------------------------------------------------------------------
# Readers of the files that trackers export: OptiTrack Motive, Vicon Nexus, and a plain table.
#
# Which layout a file has is seen from its first cells. Sources of the layouts: OptiTrack's documentation of
# "Data Export: CSV" (format versions 1.2 to 1.25) and Vicon Nexus's ASCII export (sections "Trajectories",
# "Devices", "Model Outputs", each with its rate, names, axes and units).

MOTIVE, VICON, PLAIN = "motive", "vicon", "plain"
CLOCK_SECONDS = "time (seconds)"  # made from frames and their rate, where a file counts frames alone
_MOTIVE_UNITS = {"meters": "m", "centimeters": "cm", "millimeters": "mm", "inches": "in"}
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+")
_HEAD_ROWS = 12  # within which Motive's row of axes stands
_SECTIONS = ("trajectories", "devices", "model outputs", "joints", "segments")


def read_raw(path: str | os.PathLike[str]) -> RawFile:
    """Return a tracker's or a logger's file, its layout told by its first cells.

    Raises:
        InputError: it cannot be read, or is not laid out as it begins.
    """
    where = os.fspath(path)
    rows, delimiter = read_rows(path)
    filled = [(line, row) for line, row in rows if any(cell.strip() for cell in row)]
    first = filled[0][1][0].strip().lower()
    if first == "format version":
        return _motive(where, filled)
    if first in _SECTIONS:
        return _vicon(where, rows)
    return _plain(where, filled, delimiter)


def _plain(where: str, rows: Rows, delimiter: str) -> RawFile:
    """Return a table of one row of names; lines before it that begin with # are passed over."""
    rows = [(line, row) for line, row in rows if not row[0].lstrip().startswith("#")]
    if not rows:
        raise InputError(f"{where}: a header with the columns' names is needed")
    header = rows[0][1]
    if all(as_number(cell) is not None for cell in header):
        raise InputError(f"{where}: line {rows[0][0]}: a row of names is needed, this one holds numbers")
    cells, lines = data_rows(where, rows[1:], len(header))
    comma = delimiter != "," and any(_DECIMAL_COMMA.fullmatch(cell.strip()) for cell in cells[0])
    return RawFile(where, PLAIN, joined_names([[cell] for cell in header]), cells, lines, {}, ",."[not comma])


def _motive(where: str, rows: Rows) -> RawFile:
    """Return a take of OptiTrack Motive; a column is named by its object, Position or Rotation, and axis."""
    head = [cell.strip() for cell in rows[0][1]]
    said = {key.lower(): value for key, value in zip(head[::2], head[1::2], strict=False)}
    at = next(
        (index for index, (_, row) in enumerate(rows[:_HEAD_ROWS]) if row[0].strip().lower() == "frame"), 0
    )
    if not at:
        raise InputError(f"{where}: an export of Motive without its row Frame, Time (Seconds), X, Y, Z")
    axes = rows[at][1]
    width = len(axes)
    above = [[*row, *[""] * (width - len(row))] for _, row in rows[1:at]]
    names_row = _motive_names(where, above)
    kinds = above[-1]
    parts = [[names_row[k], kinds[k], axes[k]] for k in range(width)]
    for k in range(width):
        if not kinds[k].strip():  # Frame, Time (Seconds), TimeCode, or an error without an axis
            parts[k] = [names_row[k], axes[k]] if names_row[k].strip().lower() != "name" else [axes[k]]
    names = joined_names(parts)
    unit = _MOTIVE_UNITS.get(said.get("length units", "").lower(), "")
    units = {name: unit for name, kind in zip(names, kinds, strict=True) if unit and kind == "Position"}
    angle = "deg" if said.get("rotation type", "").lower() not in ("", "quaternion") else ""
    units |= {name: angle for name, kind in zip(names, kinds, strict=True) if angle and kind == "Rotation"}
    cells, lines = data_rows(where, rows[at + 1 :], width)
    return RawFile(where, MOTIVE, names, cells, lines, units | {"Time (Seconds)": "s"})


def _motive_names(where: str, above: list[list[str]]) -> list[str]:
    """Return the row of names: the one that calls itself Name, in older versions the second."""
    for row in above:
        if "name" in (cell.strip().lower() for cell in row[:3]):
            return row
    if len(above) < 3:
        raise InputError(f"{where}: an export of Motive without its rows of types and names")
    return above[1]


def _vicon(where: str, rows: Rows) -> RawFile:
    """Return an export of Vicon Nexus: the trajectories, and beside them what devices measured.

    Devices are sampled faster; of each frame the first sub-frame is taken.
    """
    sections = _sections(rows)
    if "trajectories" not in sections:
        found = ", ".join(sections)
        raise InputError(f"{where}: an export of Vicon without a section Trajectories; sections: {found}")
    names, units, cells, lines, rate_Hz = _section(where, sections["trajectories"], "Trajectories")
    frames = [as_number(row[0]) for row in cells]
    seconds = [f"{(frame or 0.0) / rate_Hz:.9g}" for frame in frames]
    names, units = (CLOCK_SECONDS, *names), {CLOCK_SECONDS: "s", **units}
    table = [[second, *row] for second, row in zip(seconds, cells, strict=True)]
    for title in ("devices", "model outputs"):
        if title not in sections:
            continue
        more, its_units, its_cells, _, _ = _section(where, sections[title], title.capitalize())
        by_frame: dict[float | None, list[str]] = {}
        for row in its_cells:
            by_frame.setdefault(as_number(row[0]), row[2:])
        blank = [""] * (len(more) - 2)
        renamed = joined_names([[name] for name in (*names, *more[2:])])[len(names) :]
        units |= {new: its_units[old] for new, old in zip(renamed, more[2:], strict=True) if old in its_units}
        names = (*names, *renamed)
        table = [[*row, *by_frame.get(frame, blank)] for row, frame in zip(table, frames, strict=True)]
    return RawFile(where, VICON, names, table, lines, units)


def _sections(rows: Rows) -> dict[str, Rows]:
    """Return the rows below each section's title, the rate's first."""
    found: dict[str, Rows] = {}
    inside: Rows = []
    for line, row in rows:
        title = row[0].strip().lower() if row else ""
        if title in _SECTIONS and not any(cell.strip() for cell in row[1:]):
            inside = found.setdefault(title, [])
        else:
            inside.append((line, row))
    return found


def _section(
    where: str, rows: Rows, title: str
) -> tuple[tuple[str, ...], dict[str, str], tuple[list[str], ...], tuple[int, ...], float]:
    """Return names, units by name, cells, lines and frames a second of a section."""
    rate_Hz = as_number(rows[0][1][0]) if rows and rows[0][1] else None
    if rate_Hz is None or not rate_Hz > 0.0 or len(rows) < 5:
        line = rows[0][0] if rows else 0
        raise InputError(f"{where}: line {line}: {title}: a rate in Hz and rows of names are needed")
    (_, owners), (line, axes), (_, unit_row) = rows[1:4]
    if [cell.strip().lower() for cell in axes[:2]] != ["frame", "sub frame"]:
        said = cut(", ".join(axes), 80)
        raise InputError(f"{where}: line {line}: {title}: Frame, Sub Frame, ... is needed, not {said}")
    width = len(axes)
    owner, parts = "", []
    for k in range(width):
        if k < len(owners) and owners[k].strip():
            owner = owners[k].strip()
        parts.append([owner, axes[k]] if k > 1 else [axes[k]])
    names = joined_names(parts)
    units = {
        name: unit_row[k].strip().replace("º", "deg")
        for k, name in enumerate(names)
        if k < len(unit_row) and unit_row[k].strip()
    }
    cells, lines = data_rows(where, rows[4:], width)
    return names, units, cells, lines, rate_Hz


# ----------------------------------------------------------------------------------------------------
# The table `[map]` of a `dataset.toml`: which column of a file is which channel, and how it is to be read.
#
# ```toml [map] axes = ["x", "-z", "y"] # the base's x, y and z in the tracker's axes: here y points up
# every = 4 # take every fourth row time_s = { column = "stamp", unit = "ms", origin = "first row" } tip = {
# columns = ["X", "Y", "Z"], unit = "m" } displacement_bending_mm = { column = "motor_1", unit = "deg",
# spool_radius_mm = 10.0, sign = -1, zero = 12.5 } displacement_torsion_mm = { column = "m2", unit =
# "counts", counts_per_turn = 4096, spool_radius_mm = 3.0 } tension_right_N = { column = "cell", scale =
# 0.25 } ```
#
# A channel is `sign * factor * (column - zero)`; the factor is that of the unit, or `scale`. A channel that
# stands in no line of `[map]` has a column of its own name.

FIRST_ROW = "first row"
AXES = ("x", "y", "z", "-x", "-y", "-z")
TIMES = ("time_s", "inputs_time_s")
_COORDINATE = re.compile(r"(.+)_([xyz])_mm")
_SIZES = ("column", "unit", "scale", "sign", "zero", "counts_per_turn", "spool_radius_mm")
_CLOCK = ("column", "unit", "rate_Hz", "origin", "shift_s")
_MOST_EVERY = 10_000


@dataclass(frozen=True)
class ColumnMap:
    """One channel: `factor * (column - zero)`.

    `factor`, its sign included, leads from the number of the file's `column` to the channel's; `zero` is the
    file's number at which the channel is zero.
    """

    column: str
    factor: float
    zero: float = 0.0


@dataclass(frozen=True)
class ClockMap:
    """A file's clock.

    Attributes:
        column: the file's.
        unit_s: what one is in seconds; None: the column holds dates.
        origin: the clock's reading [its unit] at which a trial starts, rows before it left out; None: the
            clock is taken as it is.
        from_first: the first row is the origin, whatever the clock reads there.
        shift_s: added to the clock, where two files' clocks differ [s].
    """

    column: str
    unit_s: float | None = 1.0
    origin: float | None = None
    from_first: bool = False
    shift_s: float = 0.0


@dataclass(frozen=True)
class FileMap:
    """What a file's columns mean.

    Attributes:
        time: the file's clock.
        inputs_time: the clock of a trial's second file, which has its inputs.
        columns: by channel.
        points: of each point ("tip", "body_3", "marker_a") its three columns in the tracker's axes.
        R_bt: from the tracker's axes to the base's, shape (3, 3), signed exchanges.
        every: every how many rows one is taken.
        where: the file of the table, for errors.
    """

    time: ClockMap
    inputs_time: ClockMap
    columns: Mapping[str, ColumnMap]
    points: Mapping[str, tuple[ColumnMap, ColumnMap, ColumnMap]]
    R_bt: Array
    every: int
    where: str


def file_map(
    table: Any,
    inputs: Sequence[str],
    outputs: Sequence[str],
    where: str,
    unit_of: Callable[[str], str] = channel_unit,
) -> FileMap | None:
    """Return the table `[map]` of a data set, checked; None where there is none.

    `unit_of` gives a channel's own unit, a key of `UNITS`.

    Raises:
        InputError: a key or a value that is unknown, missing or impossible.
    """
    if table is None:
        return None
    place = f"{where}: map"
    if not isinstance(table, Mapping):
        raise InputError(f"{place}: a table is needed, not {shown(table)}")
    measured = {match[1] for match in map(_COORDINATE.fullmatch, outputs) if match}
    known = (*TIMES, "axes", "every", *inputs, *outputs, *sorted(measured))
    for key in table:
        if key not in known:
            raise unknown("key", key, known, f"{where}: [map]")
    points = {key: _point(table[key], f"{place}.{key}") for key in table if key in measured}
    for name in table:
        coordinate = _COORDINATE.fullmatch(name)
        if coordinate and coordinate[1] in points:
            raise InputError(f"{place}.{name}: {coordinate[1]} maps it already; leave one of them out")
    every = table.get("every", 1)
    if isinstance(every, bool) or not isinstance(every, int) or not 1 <= every <= _MOST_EVERY:
        raise InputError(
            f"{place}.every: a whole number from 1 to {_MOST_EVERY} is needed, not {shown(every)}"
        )
    time = _clock(table.get("time_s", {"column": "time_s"}), f"{place}.time_s")
    return FileMap(
        time=time,
        inputs_time=_clock(table["inputs_time_s"], f"{place}.inputs_time_s")
        if "inputs_time_s" in table
        else time,
        columns={
            name: _column(unit_of(name), table[name], f"{place}.{name}")
            for name in table
            if name in inputs or name in outputs
        },
        points=points,
        R_bt=_axes(table["axes"], f"{place}.axes") if "axes" in table else np.eye(3),
        every=every,
        where=where,
    )


def _entry(value: Any, known: Sequence[str], where: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise InputError(
            f'{where}: a table such as {{ column = "X", unit = "m" }} is needed, not {shown(value)}'
        )
    for key in value:
        if key not in known:
            raise unknown("key", key, known, where)
    return value


def _column(own: str, value: Any, where: str) -> ColumnMap:
    entry = _entry(value, _SIZES, where)
    return ColumnMap(_name(entry, where), _factor(own, entry, where), _number(entry, "zero", 0.0, where))


def _point(value: Any, where: str) -> tuple[ColumnMap, ColumnMap, ColumnMap]:
    entry = _entry(value, ("columns", "unit", "scale"), where)
    names = entry.get("columns")
    if not isinstance(names, list) or len(names) != 3 or not all(isinstance(name, str) for name in names):
        raise InputError(f"{where}.columns: three names of columns are needed, along the file's x, y and z")
    if len(set(names)) < 3:
        raise InputError(f"{where}.columns: a column stands twice in {shown(names)}")
    factor = _factor("mm", entry, where)
    x, y, z = (ColumnMap(name, factor) for name in names)
    return x, y, z


def _factor(own: str, entry: Mapping[str, Any], where: str) -> float:
    """Return the factor from a column to a channel in the unit `own`: unit, scale, sign, counts and spool."""
    sizes = ("unit", "counts_per_turn", "spool_radius_mm")
    if "scale" in entry and any(key in entry for key in sizes):
        raise InputError(f"{where}: scale stands for {', '.join(sizes)}; leave one of them out")
    sign = entry.get("sign", 1)
    if isinstance(sign, bool) or sign not in (1, -1):
        raise InputError(f"{where}.sign: 1 or -1 is needed, not {shown(sign)}")
    if "scale" in entry:
        scale = _number(entry, "scale", 1.0, where)
        if scale == 0.0:
            raise InputError(f"{where}.scale: a number other than 0 is needed")
        return float(sign) * scale
    unit = entry.get("unit", own)
    if not isinstance(unit, str):
        raise InputError(f"{where}.unit: a text is needed, not {shown(unit)}")
    counts, radius = (
        _above_zero(entry, "counts_per_turn", where),
        _above_zero(entry, "spool_radius_mm", where),
    )
    if radius is not None and own != "mm":
        raise InputError(f"{where}.spool_radius_mm: {where.rpartition('.')[2]} is no way of a tendon")
    return float(sign) * factor_to(own, unit, where, radius, counts)


def _above_zero(entry: Mapping[str, Any], key: str, where: str) -> float | None:
    """Return a number above zero; None where the entry has no such key."""
    if key not in entry:
        return None
    value = _number(entry, key, 1.0, where)
    if not value > 0.0:
        raise InputError(f"{where}.{key}: must be above 0, not {value:g}")
    return value


def _clock(value: Any, where: str) -> ClockMap:
    entry = _entry(value, _CLOCK, where)
    column, unit = _name(entry, where), entry.get("unit", "s")
    choices = (*SECONDS, "frame", DATE)
    if not isinstance(unit, str) or unit not in choices:
        raise unknown("unit", str(unit), choices, f"{where}: unit")
    if (unit == "frame") != ("rate_Hz" in entry):
        raise InputError(f'{where}: rate_Hz goes with unit = "frame", and with no other')
    if unit == "frame":
        rate_Hz = _number(entry, "rate_Hz", 1.0, where)
        if not rate_Hz > 0.0:
            raise InputError(f"{where}.rate_Hz: must be above 0, not {rate_Hz:g}")
        unit_s: float | None = 1.0 / rate_Hz
    else:
        unit_s = SECONDS.get(unit)
    from_first = entry.get("origin") == FIRST_ROW
    start = _number(entry, "origin", 0.0, where) if "origin" in entry and not from_first else None
    if start is not None and unit == DATE:
        raise InputError(f'{where}.origin: of dates "{FIRST_ROW}" alone will do')
    return ClockMap(column, unit_s, start, from_first, _number(entry, "shift_s", 0.0, where))


def _name(entry: Mapping[str, Any], where: str) -> str:
    name = entry.get("column")
    if not isinstance(name, str) or not name:
        raise InputError(f"{where}.column: the name of a column is needed")
    return name


def _number(entry: Mapping[str, Any], key: str, default: float, where: str) -> float:
    value = entry.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        more = f' or "{FIRST_ROW}"' if key == "origin" else ""
        raise InputError(f"{where}.{key}: a finite number{more} is needed, not {shown(value)}")
    return float(value)


def _axes(value: Any, where: str) -> Array:
    """Return the signed exchange of axes that three of `AXES` name; it must be a turn."""
    if not isinstance(value, list) or len(value) != 3:
        raise InputError(f"{where}: three of {', '.join(AXES)} are needed, along the base's x, y and z")
    R_bt = np.zeros((3, 3))
    for row, name in enumerate(value):
        if name not in AXES:
            raise unknown("axis", shown(name), AXES, where)
        R_bt[row, "xyz".index(name[-1])] = -1.0 if name.startswith("-") else 1.0
    if (np.abs(R_bt).sum(axis=0) != 1.0).any():
        raise InputError(f"{where}: {shown(value)}: each of the file's axes stands once")
    if np.linalg.det(R_bt) < 0.0:
        raise InputError(f"{where}: {shown(value)}: a mirror image, no turn; change one sign")
    return R_bt


# ----------------------------------------------------------------------------------------------------
# From a tracker's or a logger's file to channels, as the table `[map]` of its data set says.


def read_mapped(
    path: str | os.PathLike[str],
    mapping: FileMap,
    inputs: Sequence[str],
    outputs: Sequence[str],
    inputs_path: str | os.PathLike[str] | None = None,
) -> Table:
    """Return the channels of a trial, rows thinned out as the map says.

    Where the inputs are in a file of their own, they move linearly from one of its rows to the next, and rows
    of the first file outside it are left out.

    Raises:
        InputError: a file cannot be read or lacks a column, a cell is no number, two clocks do not meet.
    """
    raw = read_raw(path)
    clock = seconds_of(raw, mapping.time, mapping.where)
    rows: NDArray[np.intp] = np.arange(len(clock))
    if mapping.time.origin is not None:
        rows = rows[clock >= 0.0]
    if inputs_path is None:
        columns = channels_of(raw, mapping, (*inputs, *outputs))
        used = {name for item in (*inputs, *outputs) for name in _columns_of(item, mapping)}
    else:
        columns, rows = _with_inputs(raw, clock, rows, mapping, (inputs, outputs), inputs_path)
        used = {name for item in outputs for name in _columns_of(item, mapping)}
    rows = rows[:: mapping.every]
    if not len(rows):
        raise InputError(f"{raw.where}: no row comes after map.time_s.origin")
    if len(rows) > MAX_ROWS:
        raise InputError(f"{raw.where}: more than {MAX_ROWS} rows; thin them out with map.every")
    ignored = tuple(name for name in raw.names if name not in used and name != mapping.time.column)
    lines = tuple(raw.lines[row] for row in rows)
    taken = {name: values[rows] for name, values in columns.items()}
    return Table(clock[rows], taken, raw.where, lines, ignored)


def channels_of(raw: RawFile, mapping: FileMap, channels: Sequence[str]) -> dict[str, Array]:
    """Return channels by name, shape (r,) each, from a file's columns."""
    found: dict[str, Array] = {}
    for name in channels:
        point, _, axis = name.rpartition("_")[0].rpartition("_")
        if point in mapping.points:
            row = mapping.R_bt["xyz".index(axis)]
            index = int(np.argmax(np.abs(row)))
            found[name] = row[index] * _values(raw, mapping.points[point][index], mapping.where)
        else:
            found[name] = _values(raw, mapping.columns.get(name, ColumnMap(name, 1.0)), mapping.where)
    return found


def seconds_of(raw: RawFile, clock: ClockMap, where: str) -> Array:
    """Return a file's time since its origin, shape (r,) [s]; the clock as it is, where none is stated.

    Raises:
        InputError: a stamp is missing or cannot be read; the message names the line.
    """
    if clock.unit_s is None:
        seconds = _dates(raw, clock.column, where)
    else:
        seconds = clock.unit_s * (raw.numbers(clock.column, where) - (clock.origin or 0.0))
    if np.isnan(seconds).any():
        line = raw.lines[int(np.argmax(np.isnan(seconds)))]
        raise InputError(f"{raw.where}: line {line}: {shown(clock.column)}: a time is needed")
    return seconds - (seconds[0] if clock.from_first else 0.0) + clock.shift_s


def _dates(raw: RawFile, column: str, where: str) -> Array:
    """Return dates as seconds since the first one, shape (r,)."""
    found = []
    for row, text in enumerate(raw.texts(column, where)):
        try:
            found.append(datetime.fromisoformat(text))
        except ValueError:
            said = f"{raw.where}: line {raw.lines[row]}: {shown(column)} = {shown(text)}"
            raise InputError(f"{said}: a date such as 2026-05-11T18:30:02.5 is needed") from None
    try:
        return np.array([(stamp - found[0]).total_seconds() for stamp in found])
    except TypeError:
        raise InputError(
            f"{raw.where}: {shown(column)}: some dates have a time zone and some have none"
        ) from None


def _values(raw: RawFile, column: ColumnMap, where: str) -> Array:
    values = raw.numbers(column.column, f"{where}: map")
    return values if (column.factor, column.zero) == (1.0, 0.0) else column.factor * (values - column.zero)


def _columns_of(channel: str, mapping: FileMap) -> tuple[str, ...]:
    """Return the file's columns that belong to a channel, all three of a point."""
    point = channel.rpartition("_")[0].rpartition("_")[0]
    if point in mapping.points:
        return tuple(item.column for item in mapping.points[point])
    return (mapping.columns[channel].column if channel in mapping.columns else channel,)


def _with_inputs(
    raw: RawFile,
    clock: Array,
    rows: NDArray[np.intp],
    mapping: FileMap,
    channels: tuple[Sequence[str], Sequence[str]],
    inputs_path: str | os.PathLike[str],
) -> tuple[dict[str, Array], NDArray[np.intp]]:
    """Return inputs from a second file beside outputs from the first, and the rows that have both."""
    inputs, outputs = channels
    log = read_raw(inputs_path)
    log_clock = seconds_of(log, mapping.inputs_time, mapping.where)
    commanded = channels_of(log, mapping, inputs)
    table = Table(log_clock, commanded, log.where, log.lines)
    table.require_complete()
    table.require_increasing_time()
    rows = rows[(clock[rows] >= log_clock[0]) & (clock[rows] <= log_clock[-1])]
    if len(rows) < 2:
        spans = [f"{item[0]:.10g} to {item[-1]:.10g} s" for item in (clock, log_clock)]
        raise InputError(
            f"{log.where}: its clock, {spans[1]}, does not meet that of {raw.where}, {spans[0]}; "
            "map.inputs_time_s has origin and shift_s"
        )
    columns = {name: np.interp(clock, log_clock, values) for name, values in commanded.items()}
    return columns | channels_of(raw, mapping, outputs), rows
