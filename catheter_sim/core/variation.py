"""How a number of a cause may vary: as a value, as a name, and as a table in a file.

The number is its own value plus the sum of its variations, each `by` times a course between 0 and about 1. A
course is a function of the row, or of the place along the robot. In `robot.effects` a variation stands beside
its number, under a name that says all but how much ("scale~time.step(37.5)"); in files it is a table:

    [[effects.stiffness.varies]]
    number = "scale"
    with = "time"
    shape = "step"
    at = [37.5]
    by = -0.3
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.errors import InputError, unknown

MARK = "~"  # between a number's name and what it varies with
TIMES = "*"  # between two courses that are multiplied
_COURSE = re.compile(r"(?P<along>\w+)\.(?P<shape>\w+)(?:@(?P<channel>\w+))?\((?P<at>[^()]*)\)")

# ----------------------------------------------------------------------------------------------------
# What a number may vary with, and in which shapes. A shape says how many fixed numbers it has (`at`).


def _waiting(level: Array, at: Sequence[float]) -> Array:
    """Return 1 - exp(-x/T)."""
    return -np.expm1(-level / at[0])


def _hat(level: Array, at: Sequence[float]) -> Array:
    """Return a hat that is 1 at the middle one of three levels and 0 from the outer ones on."""
    low, middle, high = at
    return np.interp(level, [low, middle, high], [float(low == middle), 1.0, float(high == middle)])


def _ramp(level: Array, at: Sequence[float]) -> Array:
    """Return 0 up to the first level and 1 at the second, on in proportion."""
    return np.maximum(level - at[0], 0.0) / max(at[1] - at[0], 1e-12)


@dataclass(frozen=True)
class Shape:
    """How a number varies.

    Attributes:
        count: numbers in `at`.
        of: the course by what it varies with (r,) and `at`.
        words: for a report, with `{}` for each number of `at`.
    """

    count: int
    of: Callable[[Array, Sequence[float]], Array]
    words: str


SHAPES: Mapping[str, Shape] = {
    "linear": Shape(1, lambda x, at: x / at[0], "in proportion, so much at {}"),
    "saturating": Shape(1, _waiting, "toward an end, with the constant {}"),
    "logarithmic": Shape(1, lambda x, at: np.log1p(x / at[0]), "by the logarithm of 1 + x / {}"),
    "step": Shape(1, lambda x, at: (x > at[0]).astype(float), "at once beyond {}"),
    "ramp": Shape(2, _ramp, "from {} on, so much at {}"),
    "hat": Shape(3, _hat, "about {1}, none from {0} and {2} on"),
    "between": Shape(2, lambda x, at: ((x > at[0]) & (x <= at[1])).astype(float), "from {} to {}"),
}

# With what: of a trial's time; of one input: its size, its sign, whether it rises, whether its size rises;
# what came before: the way it has gone, its largest size so far, how often it has turned; the place along
# the robot, as a share.
ALONG: Mapping[str, tuple[str, ...]] = {
    "time": ("linear", "saturating", "logarithmic", "step", "ramp", "hat", "between"),
    "level": ("linear", "step", "ramp", "hat"),
    "sign": ("step",),
    "direction": ("step",),
    "outward": ("step",),
    "path": ("linear", "saturating", "logarithmic", "step", "hat"),
    "largest": ("linear", "step", "hat"),
    "turns": ("linear", "saturating", "step", "hat"),
    "place": ("between",),
}
ALONG_ROWS = tuple(name for name in ALONG if name != "place")
OF_SIDES = ("sign", "direction", "outward")  # above zero or below
OF_CHANNEL = ("level", "sign", "direction", "outward", "path", "largest", "turns")


@dataclass(frozen=True)
class Variation:
    """With what a number varies and how, but for how much.

    Attributes:
        number: the parameter's name.
        along: what it varies with, of `ALONG`.
        shape: of `SHAPES`.
        channel: the input column ("tension_right_N"), "" of time and place.
        at: the shape's numbers: seconds, shares of the length, turns, or the unit of the channel.
        times: a second course, by which the first is multiplied: late, say, and far out.
    """

    number: str
    along: str
    shape: str
    channel: str = ""
    at: tuple[float, ...] = ()
    times: Variation | None = None

    @property
    def name(self) -> str:
        """The name under which it stands beside its number."""
        return self.name_of(self.number)

    def name_of(self, number: str) -> str:
        """Return the name under which another number varies so."""
        return f"{number}{MARK}{self._course}"

    @cached_property
    def _course(self) -> str:
        return TIMES.join(_course_name(item) for item in self.courses)

    @property
    def courses(self) -> tuple[Variation, ...]:
        """Itself, and the course by which it is multiplied, if any."""
        return (self,) if self.times is None else (self, self.times)


def _course_name(item: Variation) -> str:
    channel = f"@{item.channel}" if item.channel else ""
    at = ",".join(f"{value:.12g}" for value in item.at)
    return f"{item.along}.{item.shape}{channel}({at})"


_WITH = {
    "time": "time",
    "place": "the place along the robot",
    "level": "the size of {}",
    "sign": "the sign of {}",
    "direction": "the direction of {}",
    "outward": "the growth of the size of {}",
    "path": "the way gone by {}",
    "largest": "the largest {} so far",
    "turns": "the turns of {}",
}
_UNITS = {"time": " s", "place": " of the length", "turns": ""}


def variation_words(item: Variation) -> str:
    """Return with what a number varies and how: "with time, at once beyond 37.5 s"."""
    return ", times a second course ".join(_course_words(each) for each in item.courses)


def _course_words(item: Variation) -> str:
    channel, _, unit = item.channel.rpartition("_")
    what = _WITH[item.along].format(channel.replace("_", " "))
    if item.along in OF_SIDES:
        return f"with {what}, so much above zero"
    at = [f"{value:g}{_UNITS.get(item.along, f' {unit}')}" for value in item.at]
    return f"with {what}, {SHAPES[item.shape].words.format(*at)}"


def axis_of_variation(along: str, channel: str) -> str:
    """Return what an axis is called along which a number varies, with its unit."""
    named, _, unit = channel.rpartition("_")
    what = _WITH[along].format(named.replace("_", " "))
    unit = _UNITS.get(along, "" if along in OF_SIDES else f" {unit}").strip()
    return f"{what} [{unit}]" if unit else what


def said_of(name: str) -> str:
    """Return a number's name, or the words for by how much it varies."""
    if MARK not in name:
        return name
    item = variation_of(name)
    return f"{item.number}, more {variation_words(item)}"


def number_varied(name: str) -> str:
    """Return the number that a name stands for, or that it says varies."""
    return name.partition(MARK)[0]


@lru_cache(maxsize=4096)
def variation_of(name: str) -> Variation:
    """Return what a name under an effect says of how its number varies.

    Raises:
        InputError: it says nothing that a number may do.
    """
    number, _, ways = name.partition(MARK)
    first, *others = ways.split(TIMES)
    found = replace(_course_of(first, name), number=number)
    if not number.isidentifier() or len(others) > 1:
        raise _not_a_way(name)
    return checked(replace(found, times=_course_of(others[0], name)) if others else found)


def _course_of(text: str, name: str) -> Variation:
    match = _COURSE.fullmatch(text)
    if match is None:
        raise _not_a_way(name)
    try:
        at = tuple(float(part) for part in match["at"].split(",") if part)
    except ValueError:
        raise InputError(f"{name!r}: numbers are needed in the brackets") from None
    return Variation("", match["along"], match["shape"], match["channel"] or "", at)


def _not_a_way(name: str) -> InputError:
    return InputError(f"{name!r}: varies as in {Variation('scale', 'time', 'step', at=(60.0,)).name}")


def checked(item: Variation, where: str = "varies") -> Variation:
    """Return a variation that is possible.

    Raises:
        InputError: what it varies with or its shape is not known, its numbers are not those of its shape, or
            a place along the robot is multiplied by something else.
    """
    if item.times is not None:
        if "place" in (item.along, item.times.along):
            raise InputError(f"{where}: with = 'place' goes with no second course")
        checked(item.times, f"{where}.times")
    if item.along not in ALONG:
        raise unknown("with", item.along, ALONG, where)
    if item.shape not in ALONG[item.along]:
        raise unknown("shape", item.shape, ALONG[item.along], f"{where} with {item.along}")
    count = SHAPES[item.shape].count
    if len(item.at) != count or not np.isfinite(item.at).all() or list(item.at) != sorted(item.at):
        needed = f"{count} finite number{'s' if count > 1 else ''}, the smallest first, are needed"
        raise InputError(f"{where}: at = {list(item.at)}: {needed}")
    if item.shape in ("linear", "saturating", "logarithmic") and item.at[0] <= 0.0:
        raise InputError(f"{where}: at = {list(item.at)}: must be above zero")
    if bool(item.channel) != (item.along in OF_CHANNEL):
        said = "has no channel" if item.channel else "needs a channel"
        raise InputError(f"{where}: with = {item.along!r} {said}")
    return item


# ----------------------------------------------------------------------------------------------------
# In files: a table for each variation, in the place of its name.

_COURSE_KEYS = ("with", "shape", "channel", "at")
_KEYS = ("number", *_COURSE_KEYS, "times", "by")


def tables_of(values: Mapping[str, float]) -> dict[str, Any]:
    """Return an effect's values as files have them: plain numbers, and a list of tables `varies`."""
    found: dict[str, Any] = {name: value for name, value in values.items() if MARK not in name}
    tables = [table_of(variation_of(name), value) for name, value in values.items() if MARK in name]
    return found | ({"varies": tables} if tables else {})


def table_of(item: Variation, by: float) -> dict[str, Any]:
    """Return a variation as a table in a file."""
    times = {} if item.times is None else {"times": _course_table(item.times)}
    return {"number": item.number, **_course_table(item), "by": by, **times}


def _course_table(item: Variation) -> dict[str, Any]:
    channel = {"channel": item.channel} if item.channel else {}
    return {"with": item.along, "shape": item.shape, **channel, "at": list(item.at)}


def read_tables(document: dict[str, Any], where: str) -> dict[str, Any]:
    """Return a robot's document with its effects' tables `varies` under their names.

    Raises:
        InputError: a table is not what it must be; the message names the key.
    """
    effects = document.get("effects")
    if not isinstance(effects, Mapping):
        return document
    found: dict[str, Any] = {}
    for effect, values in effects.items():
        if not isinstance(values, Mapping) or "varies" not in values:
            found[effect] = values
            continue
        said = f"{where}: effects.{effect}.varies"
        if not isinstance(values["varies"], list):
            raise InputError(f"{said}: tables are needed, as [[effects.{effect}.varies]]")
        found[effect] = {name: value for name, value in values.items() if name != "varies"}
        found[effect] |= dict(_read(values["varies"], said))
    return document | {"effects": found}


def _read(tables: Sequence[Any], where: str) -> Iterator[tuple[str, Any]]:
    for index, table in enumerate(tables):
        said = f"{where}[{index}]"
        item = _read_course(table, _KEYS, said)
        times = _read_course(table["times"], _COURSE_KEYS, f"{said}.times") if "times" in table else None
        whole = checked(replace(item, number=str(table["number"]), times=times), said)
        yield whole.name, _number(table["by"], f"{said}: by")


def _read_course(table: Any, keys: Sequence[str], where: str) -> Variation:
    if not isinstance(table, Mapping):
        raise InputError(f"{where}: a table is needed")
    for key in table:
        if key not in keys:
            raise unknown("key", str(key), keys, where)
    missing = [key for key in keys if key not in table and key not in ("channel", "times")]
    if missing:
        raise InputError(f"{where}: {', '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing")
    given = table["at"] if isinstance(table["at"], list) else [table["at"]]
    at = tuple(_number(value, f"{where}: at") for value in given)
    return Variation("", str(table["with"]), str(table["shape"]), str(table.get("channel", "")), at)


def _number(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{where}: numbers are needed")
    return float(value)
