"""The table `[map]` of a `dataset.toml`: which column of a file is which channel, and how it is to be read.

```toml
[map]
axes = ["x", "-z", "y"]             # the base's x, y and z in the tracker's axes: here y points up
every = 4                           # take every fourth row
time_s = { column = "stamp", unit = "ms", origin = "first row" }
tip = { columns = ["X", "Y", "Z"], unit = "m" }
displacement_bending_mm = { column = "motor_1", unit = "deg", spool_radius_mm = 10.0, sign = -1, zero = 12.5 }
displacement_torsion_mm = { column = "m2", unit = "counts", counts_per_turn = 4096, spool_radius_mm = 3.0 }
tension_right_N = { column = "cell", scale = 0.25 }
```

A channel is `sign * factor * (column - zero)`; the factor is that of the unit, or `scale`. A channel that
stands in no line of `[map]` has a column of its own name.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.data.mapping.scales import DATE, SECONDS, channel_unit, factor_to
from catheter_sim.errors import InputError, shown, unknown

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

    Attributes:
        column: the file's.
        factor: from the file's number to the channel's, its sign included.
        zero: the file's number at which the channel is zero.
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

    Args:
        table: as read.
        inputs, outputs: the data set's channels.
        where: its file.
        unit_of: gives a channel's own unit, a key of `UNITS`.

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
