"""Time series in CSV files: `time_s` plus named columns.

Bad files end in one `InputError` that names the file and the line. Files are written whole or not
at all: to a temporary file beside the target, then renamed.
"""

from __future__ import annotations

import csv
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from catheter_sim.errors import InputError
from catheter_sim.files import placed_when_whole

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Table:
    """A time series.

    Attributes:
        time_s: shape (r,) [s].
        columns: name (with its unit) to values of shape (r,); NaN is a missing value.
        where: what to call the table in errors, usually its file.
        lines: line of the file on which each row ends; empty: rows follow the header line by line.
    """

    time_s: Array
    columns: dict[str, Array]
    where: str = "inputs"
    lines: tuple[int, ...] = ()

    def row(self, index: int) -> str:
        """Return the name of a row for errors; line 1 of a file is its header."""
        return f"{self.where}: line {self.lines[index] if index < len(self.lines) else index + 2}"

    def require_complete(self) -> None:
        """Raise `InputError` at the first missing or infinite value."""
        for name, values in self.columns.items():
            bad = ~np.isfinite(values)
            if bad.any():
                raise InputError(f"{self.row(int(np.argmax(bad)))}: {name}: a number is needed")

    def require_increasing_time(self) -> None:
        """Raise `InputError` where `time_s` does not increase."""
        bad = np.diff(self.time_s) <= 0
        if bad.any():
            row = int(np.argmax(bad)) + 1
            raise InputError(
                f"{self.row(row)}: time_s = {self.time_s[row]:g} does not come after {self.time_s[row - 1]:g}"
            )


def read_table(path: str | os.PathLike[str]) -> Table:
    """Return the table in the CSV file `path`; an empty cell is a missing value (NaN).

    Raises:
        InputError: the file cannot be read, is empty, ragged, has a column twice, lacks `time_s`,
            or holds something that is not a finite number.
    """
    where = os.fspath(path)
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file, strict=True)
            numbered = [(reader.line_num, row) for row in reader if row]  # empty lines are passed over
    except FileNotFoundError:
        raise InputError(f"{where}: no such file") from None
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{where}: cannot be read as CSV: {error}") from None
    if not numbered:
        raise InputError(f"{where}: the file is empty; a header with time_s is needed")
    lines, rows = zip(*numbered, strict=True)
    header = [name.strip() for name in rows[0]]
    if "time_s" not in header:
        raise InputError(f"{where}: no column time_s; columns: {', '.join(header)}")
    for name in header:
        if header.count(name) > 1:
            raise InputError(f"{where}: column {name!r} stands twice")
    if len(rows) == 1:
        raise InputError(f"{where}: a header without rows")
    values = np.empty((len(rows) - 1, len(header)))
    for index, row in enumerate(rows[1:]):
        line = f"{where}: line {lines[index + 1]}"
        if len(row) != len(header):
            raise InputError(f"{line}: {len(row)} cells where the header has {len(header)}")
        values[index] = [_number(cell, f"{line}: {name}") for cell, name in zip(row, header, strict=True)]
    columns = {name: values[:, index].copy() for index, name in enumerate(header)}
    time_s = columns.pop("time_s")
    table = Table(time_s, columns, where, lines[1:])
    if np.isnan(time_s).any():
        raise InputError(f"{table.row(int(np.argmax(np.isnan(time_s))))}: time_s: a number is needed")
    return table


def _number(cell: str, where: str) -> float:
    text = cell.strip()
    if not text:
        return float("nan")
    try:
        value = float(text.replace("_", " "))  # Python would read 1_000 as a thousand
    except ValueError:
        raise InputError(f"{where} = {text!r}: not a number") from None
    if not np.isfinite(value):
        raise InputError(f"{where} = {text}: not a finite number (leave a missing value empty)")
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

    Raises:
        InputError: the folder does not exist or cannot be written.
    """
    with replaced_when_whole(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["time_s", *table.columns])
        for index, time_s in enumerate(table.time_s):
            cells = (column[index] for column in table.columns.values())
            writer.writerow([f"{time_s:.9g}", *("" if np.isnan(cell) else f"{cell:.9g}" for cell in cells)])
