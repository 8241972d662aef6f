"""Rows of a table that is printed, shown in a notebook, or made a data frame: one list feeds all three."""

from __future__ import annotations

import csv
import html
import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.errors import InputError
from catheter_sim.tables import replaced_when_whole

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
        raise InputError("to_dataframe: needs pandas; install catheter-sim[pandas]") from None
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
