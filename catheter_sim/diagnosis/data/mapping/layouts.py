"""Readers of the files that trackers export: OptiTrack Motive, Vicon Nexus, and a plain table.

Which layout a file has is seen from its first cells. Sources of the layouts: OptiTrack's documentation of
"Data Export: CSV" (format versions 1.2 to 1.25) and Vicon Nexus's ASCII export (sections "Trajectories",
"Devices", "Model Outputs", each with its rate, names, axes and units).
"""

from __future__ import annotations

import os
import re

from catheter_sim.diagnosis.data.mapping.raw_file import (
    RawFile,
    Rows,
    as_number,
    data_rows,
    joined_names,
    read_rows,
)
from catheter_sim.errors import InputError, cut

MOTIVE, VICON, PLAIN = "motive", "vicon", "plain"
SECONDS = "time (seconds)"  # made from frames and their rate, where a file counts frames alone
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
    names, units = (SECONDS, *names), {SECONDS: "s", **units}
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
