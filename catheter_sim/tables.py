"""Time series in CSV files: `time_s` plus named columns; and two of them side by side."""

from __future__ import annotations

import csv
import os
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.errors import InputError, cut, shown, unknown
from catheter_sim.files import placed_when_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# ----------------------------------------------------------------------------------------------------
# Time series in CSV files: `time_s` plus named columns.
#
# Bad files end in one `InputError` that names the file and the line. Files are written whole or not at all:
# to a temporary file beside the target, then renamed.

MAX_ROWS = 100_000  # of a file; held rows would take an hour and more
_LATEST_S = 1e11  # three thousand years: epoch seconds lie below, epoch milliseconds above


@dataclass(frozen=True)
class Table:
    """A time series.

    Attributes:
        time_s: shape (r,) [s].
        columns: name (with its unit) to values of shape (r,); NaN is a missing value.
        where: what to call the table in errors, usually its file.
        lines: line of the file on which each row ends; empty: rows follow the header line by line.
        ignored: names of the file's columns that were not asked for.
        row_noun: what a row is called in errors: a file's is its line.
    """

    time_s: Array
    columns: dict[str, Array]
    where: str = "inputs"
    lines: tuple[int, ...] = ()
    ignored: tuple[str, ...] = ()
    row_noun: str = "line"

    def row(self, index: int) -> str:
        """Return the name of a row for errors; line 1 of a file is its header."""
        return f"{self.where}: {self.row_noun} {self.lines[index] if index < len(self.lines) else index + 2}"

    def require_complete(self) -> None:
        """Raise `InputError` at the first missing or infinite value."""
        for name, values in self.columns.items():
            bad = ~np.isfinite(values)
            if bad.any():
                raise InputError(f"{self.row(int(np.argmax(bad)))}: {name}: a number is needed")

    def require_increasing_time(self) -> None:
        """Raise `InputError` where `time_s` does not increase, or is too large to be seconds."""
        bad = np.abs(self.time_s) > _LATEST_S
        if bad.any():
            row = int(np.argmax(bad))
            raise InputError(
                f"{self.row(row)}: time_s = {time_text(self.time_s[row])}: must lie within {_LATEST_S:g} s; "
                "is the column in seconds?"
            )
        bad = np.diff(self.time_s) <= 0
        if bad.any():
            row = int(np.argmax(bad)) + 1
            now, before = (time_text(self.time_s[index]) for index in (row, row - 1))
            raise InputError(f"{self.row(row)}: time_s = {now} does not come after {before}")


def own_clock(time_s: Array) -> Array:
    """Return the time since the first row, shape (r,) [s].

    A double holds epoch seconds to a quarter of a microsecond only, so that a difference of two of them
    is no round number where the file's were. It is rounded to the decimals that stamps of this size
    have, unless rows would fall together.
    """
    if not len(time_s) or time_s[0] == 0.0:
        return time_s
    elapsed = time_s - time_s[0]
    decimals = int(np.floor(-np.log10(np.spacing(np.abs(time_s).max()))))
    rounded: Array = np.round(elapsed, min(decimals, 12))
    return elapsed if (np.diff(rounded) <= 0).any() else rounded


def read_table(
    path: str | os.PathLike[str], only: Collection[str] | None = None, spacing_s: float | None = None
) -> Table:
    """Return the table in the CSV file `path`; an empty cell is a missing value (NaN).

    Args:
        path: the file.
        only: the columns to read besides `time_s`; others may hold anything, and are named in `ignored`.
            None: every column.
        spacing_s: time between rows, from 0, where the file has no `time_s` [s]; None: it must have one.

    Raises:
        InputError: the file cannot be read, is empty, ragged, has a column twice, lacks `time_s`, has
            more than `MAX_ROWS` rows, or holds something that is not a finite number.
    """
    where = os.fspath(path)
    lines, rows = _cells(where)
    header = [name.strip() for name in rows[0]]
    if "time_s" not in header and spacing_s is None:
        raise InputError(f"{where}: no column time_s; columns: {cut(', '.join(header), 200)}")
    read = [only is None or name == "time_s" or name in only for name in header]
    for name, count in Counter(name for name, wanted in zip(header, read, strict=True) if wanted).items():
        if count > 1:
            raise InputError(f"{where}: column {shown(name)} stands twice")
    if len(rows) == 1:
        raise InputError(f"{where}: a header without rows")
    places = [(index, name) for index, name in enumerate(header) if read[index]]
    values = np.empty((len(rows) - 1, len(places)))
    for index, row in enumerate(rows[1:]):
        line = f"{where}: line {lines[index + 1]}"
        if len(row) != len(header):
            raise InputError(f"{line}: {len(row)} cells where the header has {len(header)}")
        values[index] = [_number(row[place], line, name) for place, name in places]
    columns = {name: values[:, index].copy() for index, (_, name) in enumerate(places)}
    even: Array = np.arange(len(values), dtype=np.float64) * (spacing_s or 0.0)
    time_s = columns.pop("time_s", even)
    ignored = tuple(name for name, wanted in zip(header, read, strict=True) if not wanted)
    table = Table(time_s, columns, where, lines[1:], ignored)
    if np.isnan(time_s).any():
        raise InputError(f"{table.row(int(np.argmax(np.isnan(time_s))))}: time_s: a number is needed")
    return table


def _cells(where: str) -> tuple[tuple[int, ...], tuple[list[str], ...]]:
    """Return the rows of the CSV file `where` that are not empty, its header first, and their lines."""
    numbered: list[tuple[int, list[str]]] = []
    try:
        with open(where, newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file, strict=True)
            for row in reader:
                if row:  # empty lines are passed over
                    numbered.append((reader.line_num, row))
                if len(numbered) > MAX_ROWS + 1:
                    raise InputError(f"{where}: more than {MAX_ROWS} rows; thin them out")
    except FileNotFoundError:
        raise InputError(f"{where}: no such file") from None
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{where}: cannot be read as CSV: {error}") from None
    if not numbered:
        raise InputError(f"{where}: the file is empty; a header with time_s is needed")
    lines, rows = zip(*numbered, strict=True)
    return lines, rows


def _number(cell: str, line: str, name: str) -> float:
    text = cell.strip()
    if not text:
        return float("nan")
    try:
        value = float(text.replace("_", " "))  # Python would read 1_000 as a thousand
    except ValueError:
        raise InputError(f"{line}: {cut(name, 60)} = {shown(text)}: not a number") from None
    if not np.isfinite(value):
        raise InputError(
            f"{line}: {cut(name, 60)} = {cut(text, 60)}: not a finite number (leave a missing value empty)"
        )
    return value


@contextmanager
def replaced_when_whole(path: str | os.PathLike[str], binary: bool = False) -> Iterator[IO]:
    """Open a file that takes its place at `path` only once it is written to the end.

    A link is followed, so that the file it points to is replaced. What is no regular file (a pipe, a
    device such as /dev/null) is written to directly: it must not be replaced by a file.

    Raises:
        InputError: the folder does not exist or cannot be written, or no room is left.
    """
    target = Path(path)
    if target.exists() and not (target.is_file() or target.is_dir()):
        with _opened(target, binary) as direct:
            yield direct
        return
    with placed_when_whole(path) as temporary, _opened(temporary, binary) as file:
        yield file


def _opened(path: Path, binary: bool) -> IO:
    return open(path, "wb") if binary else open(path, "w", newline="", encoding="utf-8")


def write_table(table: Table, path: str | os.PathLike[str]) -> None:
    """Write `table` as CSV, nine significant digits; NaN becomes an empty cell.

    `time_s` has as many digits as it takes to read the same time back: nine would not tell the rows of
    epoch seconds apart.

    Raises:
        InputError: the folder does not exist or cannot be written.
    """
    with replaced_when_whole(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["time_s", *table.columns])
        for index, time_s in enumerate(table.time_s):
            cells = (column[index] for column in table.columns.values())
            writer.writerow([time_text(time_s), *("" if np.isnan(cell) else f"{cell:.9g}" for cell in cells)])


def time_text(time_s: float) -> str:
    """Return a time [s] in the fewest digits that read back to the same number."""
    return repr(float(time_s)).removesuffix(".0")


# ----------------------------------------------------------------------------------------------------
# Two time series side by side: rows matched by time, how far apart they are, a picture of both.

_SAME_TIME = 1e-6  # of the median step: rows nearer than that are of one moment
_MOST_PANELS = 12  # of a picture


@dataclass(frozen=True)
class Apart:
    """How far two series of one column are apart, in the column's unit.

    Attributes:
        column: its name.
        rms: root mean square of the difference.
        largest: its largest size.
        at_s: when that is, by the first file's clock [s].
        mean: of the second minus the first.
        range_: of the first series, largest minus smallest.
    """

    column: str
    rms: float
    largest: float
    at_s: float
    mean: float
    range_: float


@dataclass(frozen=True)
class TableComparison:
    """Two tables at the same moments.

    Attributes:
        first, second: their columns in common, rows matched; both on the first one's clock.
        matched: rows of the first whose moment the second has too; the others lie between two of its rows.
        left_out: rows of the first at which the second has nothing.
        apart: by column.
    """

    first: Table
    second: Table
    matched: int
    left_out: int
    apart: tuple[Apart, ...]

    def text(self) -> str:
        """The comparison as lines of text."""
        rows = len(self.first.time_s)
        between = f" ({rows - self.matched} between two rows of the second)" if rows > self.matched else ""
        lines = [f"{rows} rows matched by time{between}; {self.left_out} rows of the first left out"]
        lines.append(
            f"{'column':28} {'rms':>10} {'largest':>10} {'at time_s':>12} {'mean':>10} {'range':>10}"
        )
        for item in self.apart:
            sizes = f"{item.rms:10.4g} {item.largest:10.4g} {time_text(item.at_s):>12}"
            lines.append(f"{item.column:28} {sizes} {item.mean:10.3g} {item.range_:10.4g}")
        distance = self.tip_distance_mm()
        if distance is not None:
            rms = float(np.sqrt(np.nanmean(distance**2)))
            lines.append(f"tip, distance in space: rms {rms:.4g} mm, largest {np.nanmax(distance):.4g} mm")
        return "\n".join(lines)

    def tip_distance_mm(self) -> Array | None:
        """The tip's distance between the two, shape (r,) [mm]; None where not both have it."""
        names = [f"tip_{axis}_mm" for axis in "xyz"]
        if not all(name in self.first.columns for name in names):
            return None
        apart = [self.second.columns[name] - self.first.columns[name] for name in names]
        return np.asarray(np.sqrt(sum(item**2 for item in apart)))

    def figure(self) -> Figure:
        """Three panels over time for each of 12 columns at most: first, second over it, their difference.

        The first two have one scale.
        """
        from matplotlib.figure import Figure

        shown = [item.column for item in self.apart][:_MOST_PANELS]
        figure = Figure(figsize=(15.0, 1.2 + 1.9 * len(shown)), layout="constrained")
        panels = figure.subplots(len(shown), 3, sharex=True, squeeze=False)
        time_s = self.first.time_s
        for (alone, both, apart), name in zip(panels, shown, strict=True):
            one, other = self.first.columns[name], self.second.columns[name]
            alone.plot(time_s, one, color="#222222")
            both.sharey(alone)
            both.plot(time_s, one, color="0.75")
            both.plot(time_s, other, color="#1f5f8b")
            apart.axhline(0.0, color="0.6", linewidth=0.7)
            apart.plot(time_s, other - one, color="#a03b2a")
            alone.set_ylabel(name, fontsize=8)
            for panel in (alone, both, apart):
                panel.tick_params(labelsize=8)
                panel.grid(color="0.92", linewidth=0.7)
                panel.spines[["top", "right"]].set_visible(False)
        titles = (
            self.first.where,
            f"{self.second.where} (grey: the first)",
            "difference: second minus first",
        )
        for panel, title in zip(panels[0], titles, strict=True):
            panel.set_title(title, fontsize=9)
        for panel in panels[-1]:
            panel.set_xlabel("time since the first row [s]", fontsize=9)
        return figure


def compare_tables(first: Table, second: Table, columns: Sequence[str] | None = None) -> TableComparison:
    """Return two tables at the moments of the first's rows; each clock starts at its own first row.

    Args:
        first, second: columns of one name are compared; the second is taken linearly between its rows.
        columns: which; None: all that both have.

    Raises:
        InputError: no column or no moment in common, or time that does not increase.
    """
    common = [name for name in first.columns if name in second.columns]
    if not common:
        raise InputError(f"{first.where} and {second.where}: no column in common but time_s")
    for name in columns or ():
        if name not in common:
            raise unknown("column", name, common, "--columns")
    names = list(columns or common)
    for table in (first, second):
        table.require_increasing_time()
    a, b = own_clock(first.time_s), own_clock(second.time_s)
    step = float(np.median(np.diff(b))) if len(b) > 1 else 1.0
    inside = (a >= b[0] - _SAME_TIME * step) & (a <= b[-1] + _SAME_TIME * step)
    times = a[inside]
    if not len(times):
        raise InputError(f"{first.where} and {second.where}: no moment in common")
    nearest = np.abs(
        times[:, np.newaxis] - b[np.clip(np.searchsorted(b, times)[:, np.newaxis] + [-1, 0], 0, len(b) - 1)]
    )
    matched = int((nearest.min(axis=1) <= _SAME_TIME * step).sum())
    one = {name: first.columns[name][inside] for name in names}
    other = {name: np.interp(times, b, second.columns[name]) for name in names}
    apart = tuple(_apart(name, first.time_s[inside], one[name], other[name]) for name in names)
    return TableComparison(
        Table(times, one, first.where),
        Table(times, other, second.where),
        matched,
        int((~inside).sum()),
        apart,
    )


def _apart(name: str, time_s: Array, one: Array, other: Array) -> Apart:
    difference = other - one
    known = np.isfinite(difference)
    if not known.any():
        return Apart(name, np.nan, np.nan, np.nan, np.nan, np.nan)
    sizes = np.where(known, np.abs(difference), -1.0)
    row = int(np.argmax(sizes))
    return Apart(
        column=name,
        rms=float(np.sqrt((difference[known] ** 2).mean())),
        largest=float(sizes[row]),
        at_s=float(time_s[row]),
        mean=float(difference[known].mean()),
        range_=float(np.ptp(one[known])),
    )
