"""What the names of a file's columns say: units, points with three coordinates, the clock."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.mapping import COUNTS, SECONDS, UNITS, RawFile, as_number
from catheter_sim.errors import InputError

PIXELS = "px"  # of a camera's picture: no unit of `[map]`, whose scale says what one is
# What people write for a unit -> how `[map]` writes it.
_SPELLINGS: Mapping[str, str] = {
    **{unit.lower(): unit for units in UNITS.values() for unit in units if unit != "1"},
    **{unit: unit for unit in SECONDS},
    **dict.fromkeys(("meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("millimeter", "millimeters", "millimetre", "millimetres"), "mm"),
    **dict.fromkeys(("inch", "inches"), "in"),
    **dict.fromkeys(("degree", "degrees", "°"), "deg"),
    **dict.fromkeys(("radian", "radians"), "rad"),
    **dict.fromkeys(("turns", "rev", "revs", "revolutions"), "turn"),
    **dict.fromkeys(("count", "counts", "tick", "ticks", "pulses"), COUNTS),
    **dict.fromkeys(("px", "pix", "pixel", "pixels"), PIXELS),
    **dict.fromkeys(("newton", "newtons"), "N"),
    **dict.fromkeys(("sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("msec", "millisec", "milliseconds"), "ms"),
    **dict.fromkeys(("usec", "µs", "microseconds"), "us"),
    **dict.fromkeys(("nsec", "nanosec", "nanoseconds"), "ns"),
}
_BRACKETED = re.compile(r"^(.*?)\s*[\[(]\s*([^\])]+?)\s*[\])]\s*$")
_AXIS = re.compile(r"^(.*?)(?:[\s_.:/-]+|^|(?<=[a-z0-9]))([xyzuvXYZUV])$")
_PLANES = ("xy", "xz", "yz", "uv")
_PICTURE = re.compile(r"(^|[\s_.-])(px|pixel|image|img)", re.IGNORECASE)
_TURNED = re.compile(r"quat|rot|orient|euler|angle|veloc|accel|force|moment|torque", re.IGNORECASE)
_CLOCK = re.compile(
    r"^(t|time|stamp|timestamp|time[ _]?stamp|epoch|clock|date|datetime|elapsed)s?([ _.(\[]|$)", re.IGNORECASE
)
_FRAME = re.compile(r"^(frame|sub frame|index|sample|#|row|n)$", re.IGNORECASE)


@dataclass(frozen=True)
class Heads:
    """What a file's head says.

    Attributes:
        stems: by column, its name without a unit.
        units: by column, its unit as `[map]` writes it, "" where nothing says it.
        clock: the column of time.
        clock_named: whether its name says so.
        points: by name, the columns along the file's x, y and z.
        pairs: by name, two columns along two axes of the file's, across and up or down.
        others: the columns of numbers that remain, in order.
    """

    stems: Mapping[str, str]
    units: Mapping[str, str]
    clock: str
    clock_named: bool
    points: Mapping[str, tuple[str, ...]]
    pairs: Mapping[str, tuple[str, ...]]
    others: tuple[str, ...]

    def of_picture(self, stem: str) -> bool:
        """Return whether a pair is a place in a picture, whose second coordinate grows downward."""
        columns = self.pairs[stem]
        named = bool(_PICTURE.search(stem)) or all(self.stems[name][-1] in "uvUV" for name in columns)
        return self.units[columns[0]] == PIXELS or (named and self.units[columns[0]] not in UNITS["mm"])


def heads_of(raw: RawFile) -> Heads:
    """Return what the names of a file's columns say.

    Raises:
        InputError: no column can be its time.
    """
    parted = {name: _parted(name) for name in raw.names}
    stems = {name: stem for name, (stem, _) in parted.items()}
    units = {
        name: _SPELLINGS.get(raw.units[name].lower(), raw.units[name]) if raw.units.get(name) else unit
        for name, (_, unit) in parted.items()
    }
    clock, named = _clock(raw, stems)
    points, pairs = _points(raw, stems)
    taken = {clock, *(name for columns in points.values() for name in columns)}
    others = tuple(
        name
        for name in raw.names
        if name not in taken
        and not _FRAME.match(stems[name])
        and not _CLOCK.match(name)
        and is_numeric(raw, name)
    )
    return Heads(stems, units, clock, named, points, pairs, others)


def _parted(name: str) -> tuple[str, str]:
    """Return a column's name without its unit, and the unit, "" where it has none."""
    bracketed = _BRACKETED.match(name)
    if bracketed and bracketed[2].lower() in _SPELLINGS:
        return bracketed[1].strip(), _SPELLINGS[bracketed[2].lower()]
    for sign in "_ ":
        stem, _, end = name.strip().rpartition(sign)
        if (stem and end in ("m", "N", "s")) or (stem and len(end) > 1 and end.lower() in _SPELLINGS):
            return stem, _SPELLINGS[end.lower() if end != "N" else "n"]
    return name.strip(), ""


def _clock(raw: RawFile, stems: Mapping[str, str]) -> tuple[str, bool]:
    named = [name for name in raw.names if _CLOCK.match(name) or _CLOCK.match(stems[name])]
    for name in named:
        if _stamps(raw, name):
            return name, True
    for name in raw.names:
        numbers = numbers_of(raw, name)
        if numbers is not None and len(numbers) > 1 and bool((np.diff(numbers) > 0.0).all()):
            return name, False
    raise InputError(f"{raw.where}: no column that can be the time; columns: {', '.join(raw.names)}")


def _stamps(raw: RawFile, name: str) -> bool:
    """Return whether a column holds a time in every row."""
    numbers = numbers_of(raw, name)
    if numbers is not None:
        return bool(np.isfinite(numbers).all())
    return all(re.match(r"\d{4}-\d{2}-\d{2}[T ]\d{2}:\d{2}", text) for text in raw.texts(name, "time"))


def _points(
    raw: RawFile, stems: Mapping[str, str]
) -> tuple[dict[str, tuple[str, ...]], dict[str, tuple[str, ...]]]:
    """Return columns alike but for an axis at their end, by what they share: three each, and two each."""
    found: dict[tuple[str, bool], dict[str, str]] = {}
    for name in raw.names:
        match = _AXIS.match(stems[name])
        if match and not _TURNED.search(match[1]) and is_numeric(raw, name):
            axis = match[2].lower()
            found.setdefault((match[1].strip(" _.:/-"), axis in "uv"), {})[axis] = name
    points: dict[str, tuple[str, ...]] = {}
    pairs: dict[str, tuple[str, ...]] = {}
    for (stem, _), axes in found.items():
        order = "".join(sorted(axes))
        if order in _PLANES:
            pairs.setdefault(stem, tuple(axes[axis] for axis in order))
        elif order == "xyz":
            points[stem] = tuple(axes[axis] for axis in order)
    return points, pairs


def is_numeric(raw: RawFile, name: str) -> bool:
    """Return whether a column holds numbers and gaps alone, one number at least."""
    numbers = numbers_of(raw, name)
    return numbers is not None and bool(np.isfinite(numbers).any())


def numbers_of(raw: RawFile, name: str) -> Array | None:
    """Return a column's numbers, shape (r,), NaN where a cell is empty; None where a cell is none."""
    place = raw.names.index(name)
    found = np.empty(len(raw.cells))
    for row, cells in enumerate(raw.cells):
        value = as_number(cells[place], raw.decimal)
        if value is None or np.isinf(value):
            return None
        found[row] = value
    return found
