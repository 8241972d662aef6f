"""From a tracker's or a logger's file to channels, as the table `[map]` of its data set says."""

from __future__ import annotations

import os
from collections.abc import Sequence
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.data.mapping.file_map import ClockMap, ColumnMap, FileMap
from catheter_sim.diagnosis.data.mapping.layouts import read_raw
from catheter_sim.diagnosis.data.mapping.raw_file import RawFile
from catheter_sim.errors import InputError, shown
from catheter_sim.tables import MAX_ROWS, Table


def read_mapped(
    path: str | os.PathLike[str],
    mapping: FileMap,
    inputs: Sequence[str],
    outputs: Sequence[str],
    inputs_path: str | os.PathLike[str] | None = None,
) -> Table:
    """Return the channels of a trial, rows thinned out as the map says.

    Args:
        path: the trial's file.
        mapping: what its columns mean.
        inputs, outputs: the channels wanted.
        inputs_path: the file of the trial's inputs, where they are not in the first; they move linearly from
            one of its rows to the next, and rows of the first file outside it are left out.

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
