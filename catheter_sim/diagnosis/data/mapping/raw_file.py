"""A file as it was written by whatever measured: columns by name, cells as texts, what its head says."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.errors import InputError, cut, shown, unknown

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
