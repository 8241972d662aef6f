"""What the names of a file's columns say: units, points, the clock, and which channel each is."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import FORCE_CHANNELS, MOMENT_CHANNELS, actuations, input_channels, output_channels
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.mapping import (
    ANGLES,
    COUNTS,
    DATE,
    FIRST_ROW,
    SECONDS,
    UNITS,
    RawFile,
    as_number,
    channel_unit,
    file_map,
    seconds_of,
)
from catheter_sim.errors import InputError

# ----------------------------------------------------------------------------------------------------
# What a proposal says, and how sure it is of it.


@dataclass(frozen=True)
class Guess:
    """One thing that a proposal settles.

    Attributes:
        key: what of the data set it settles, as `map.tip.unit`.
        said: what was taken, in words.
        why: what it is taken from.
        sure: whether the file itself says so, or only makes it likely.
    """

    key: str
    said: str
    why: str
    sure: bool

    def __str__(self) -> str:
        """The guess in one line."""
        said = " ".join(
            f"{self.key}: {self.said} ({self.why})".split()
        )  # a column's name may hold a line's end
        return f"{'sure  ' if self.sure else 'UNSURE'}  {said}"


# ----------------------------------------------------------------------------------------------------
# What the names of a file's columns say: units, points with three coordinates, the clock.

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


# ----------------------------------------------------------------------------------------------------
# A file's clock: the unit of its stamps, by name and by size.

_EPOCHS = (
    (1e17, "ns"),
    (1e14, "us"),
    (1e11, "ms"),
    (1e8, "s"),
)  # stamps above it count since 1970, in this unit
_LONG_STEP = 5.0  # whole numbers that step by more are taken for ms


def clock_of(raw: RawFile, heads: Heads, rate_Hz: float | None) -> tuple[dict[str, object], list[Guess]]:
    """Return the entry `time_s` of a map, and how sure it is.

    `rate_Hz`: of the frames, where the user states it.
    """
    entry: dict[str, object] = {"column": heads.clock}
    named = "its name" if heads.clock_named else "the first column that only rises"
    guesses = [Guess("map.time_s", f"column {heads.clock!r}", named, heads.clock_named)]
    numbers = numbers_of(raw, heads.clock)
    if numbers is None:
        return entry | {"unit": DATE}, [*guesses, Guess("map.time_s.unit", "dates", "its cells", True)]
    if heads.units[heads.clock] in SECONDS:
        unit, why, sure = heads.units[heads.clock], "the head", True
    elif "frame" in heads.clock.lower():
        entry |= {"unit": "frame", "rate_Hz": rate_Hz or 100.0}
        why = "as stated" if rate_Hz else "assumed: the file does not say it; --rate does"
        return entry, [*guesses, Guess("map.time_s.rate_Hz", f"{rate_Hz or 100.0:g}", why, bool(rate_Hz))]
    else:
        unit, why, sure = _by_size(numbers)
    guesses.append(Guess("map.time_s.unit", unit, why, sure))
    return entry | {"unit": unit}, guesses


def meeting(table: dict[str, dict[str, object]], raw: RawFile, log: RawFile) -> list[Guess]:
    """Let two files' clocks both count from their first rows, where they never meet; return what was guessed.

    Args:
        table: the map's clocks, `time_s` of the first file and `inputs_time_s` of the second; changed here.
        raw, log: the files.
    """
    mapping = file_map(table, (), (), raw.where)
    assert mapping is not None
    first = seconds_of(raw, mapping.time, raw.where)
    second = seconds_of(log, mapping.inputs_time, log.where)
    if first.max() >= second.min() and second.max() >= first.min():
        return []
    for entry in table.values():
        entry["origin"] = FIRST_ROW
    why = "the two files' clocks never meet; shift_s moves one"
    return [Guess(f"map.{name}.origin", FIRST_ROW, why, False) for name in table]


def _by_size(stamps: np.ndarray) -> tuple[str, str, bool]:
    """Return the unit of stamps, why, and whether it is sure."""
    first = float(np.nanmin(stamps))
    for least, unit in _EPOCHS:
        if first > least:
            return unit, f"stamps since 1970, {first:.4g}", True
    step = float(np.nanmedian(np.diff(stamps))) if len(stamps) > 1 else 1.0
    if step > _LONG_STEP and bool((stamps == np.round(stamps)).all()):
        return "ms", f"whole numbers that step by {step:g}", False
    return "s", f"a step of {step:.3g}", False


# ----------------------------------------------------------------------------------------------------
# Which of a file's columns is which channel of the robot, by name, else by order.

_WORDS = re.compile(r"[A-Za-z]+|\d+")
_SAME_START = 3  # letters: "bend" is "bending"
_MOTOR = re.compile(r"motor|servo|spool|pulley|encoder|dial|winch", re.IGNORECASE)
_COMMAND = re.compile(
    r"tension|force|load|pull|disp|tendon|wire|cable|rod|cmd|command|input|axis|drive|advance|insert|feed",
    re.I,
)
_TIP = re.compile(r"\b(tip|end|tool|distal|ee|effector)\b|^tip", re.IGNORECASE)
_BODY = re.compile(r"(?:body|cell|disk|disc|link|ring)[ _]?(\d+)", re.IGNORECASE)
_GENERAL = {"displacement", "tension", "mm", "n", "nm", "deg"}


def match_inputs(robot: RobotSpec, heads: Heads) -> tuple[dict[str, str], list[Guess]]:
    """Return the input columns of the robot's that a file has, by channel, and how sure each is."""
    kinds = tuple(dict.fromkeys((robot.actuation, *actuations(robot))))
    best: dict[str, str] = {}
    for kind in kinds:
        found = _by_words(input_channels(robot, kind), heads)
        if len(found) > len(best):
            best = found
    order = [name for kind in kinds for name in input_channels(robot, kind)]
    best = {name: best[name] for name in order if name in best}
    guesses = [Guess(f"map.{name}", f"column {column!r}", "its name", True) for name, column in best.items()]
    if not best:
        best, guesses = _in_order(robot, kinds, heads)
    for name in (*FORCE_CHANNELS, *MOMENT_CHANNELS):
        if name in heads.others:
            best[name] = name
            guesses.append(Guess(f"map.{name}", f"column {name!r}", "its name", True))
    return best, guesses


def match_outputs(robot: RobotSpec, heads: Heads, inputs: Iterable[str]) -> dict[str, str]:
    """Return measured channels that are no positions, where a column has a channel's own name."""
    taken = set(inputs)
    return {name: name for name in output_channels(robot) if name in heads.others and name not in taken}


def match_points(
    points: Mapping[str, tuple[str, ...]],
    elements: int,
    spreads: Mapping[str, float],
    markers: Sequence[str] = (),
) -> tuple[dict[str, tuple[str, ...]], list[Guess]]:
    """Return which of a file's points are points of the robot's, and how sure each is.

    Args:
        points: of the file, by name: the columns of three coordinates each, or of two.
        elements: how many bodies the robot has.
        spreads: how far each of the file's points moves, in the file's unit.
        markers: names of the robot's markers.
    """
    found: dict[str, tuple[str, ...]] = {}
    guesses: list[Guess] = []
    for stem, columns in points.items():
        name = _point_of(stem, elements, markers)
        if name and name not in found:
            found[name] = columns
            guesses.append(Guess(f"map.{name}", f"columns {', '.join(columns)}", "their name", True))
    if points and not found:
        stem = max(points, key=lambda item: spreads[item])
        found["tip"] = points[stem]
        alone = len(points) == 1
        why = "the only point" if alone else f"of {len(points)} points the one that moves most"
        guesses.append(Guess("map.tip", f"columns {', '.join(found['tip'])}", why, alone))
    return found, guesses


def plane_points(heads: Heads) -> dict[str, tuple[str, ...]]:
    """Return a file's points of two coordinates, by name; two motors of one name are none."""
    return {
        stem: columns
        for stem, columns in heads.pairs.items()
        if _TIP.search(stem.replace("_", " ")) or not (_MOTOR.search(stem) or _COMMAND.search(stem))
    }


def _point_of(stem: str, elements: int, markers: Sequence[str]) -> str:
    """Return the robot's point that a file's point is by its name; "" where the name does not say."""
    words = "_".join(re.findall(r"[a-z0-9]+", stem.lower()))
    for marker in markers:
        if words in (marker.lower(), f"marker_{marker.lower()}"):
            return f"marker_{marker}"
    body = _BODY.search(stem)
    if body and 1 <= int(body[1]) <= elements:
        return f"body_{int(body[1])}"
    return "tip" if _TIP.search(stem.replace("_", " ")) else ""


def _by_words(channels: Sequence[str], heads: Heads) -> dict[str, str]:
    """Return the columns that say a channel's words, each once, the fullest agreement first."""
    scored = []
    for channel in channels:
        wanted = [word for word in _words(channel) if word not in _GENERAL]
        for column in heads.others:
            if not fits(channel, heads.units[column]):
                continue
            has = _words(column)
            shared = sum(any(_alike(word, other) for other in has) for word in wanted)
            if shared == len(wanted):
                extra = sum(not any(_alike(word, other) for word in wanted) for other in has)
                scored.append((channel != column, -shared, extra, channel, column))
    found: dict[str, str] = {}
    for _, _, _, channel, column in sorted(scored):
        if channel not in found and column not in found.values():
            found[channel] = column
    return found


def _in_order(robot: RobotSpec, kinds: Sequence[str], heads: Heads) -> tuple[dict[str, str], list[Guess]]:
    """Return columns that look like commands as the robot's channels, in order."""
    said = [name for name in heads.others if _MOTOR.search(name) or _COMMAND.search(name)]
    columns = said or list(heads.others)
    for kind in kinds:
        channels = input_channels(robot, kind)
        fitting = [name for name in columns if channels and fits(channels[0], heads.units[name])]
        if fitting and channels:
            found = dict(zip(channels, fitting, strict=False))
            alone = len(channels) == len(fitting) == 1
            why = "the only column that can be it" if alone else "the columns' order, not their names"
            return found, [Guess(f"map.{k}", f"column {v!r}", why, alone) for k, v in found.items()]
    return {}, []


def fits(channel: str, unit: str) -> bool:
    """Return whether a column in `unit` ("" where none is known) can be `channel`, by a spool if need be."""
    own = channel_unit(channel)
    known = unit in ANGLES or any(unit in units for units in UNITS.values())
    return not known or unit in UNITS[own] or (own == "mm" and unit in ANGLES)


def is_motor(column: str, unit: str) -> bool:
    """Return whether a column is a motor's angle: by its unit, or by its name where no unit is known."""
    return unit in ANGLES or (not unit and bool(_MOTOR.search(column)))


def _words(name: str) -> list[str]:
    return [word.lower() for word in _WORDS.findall(re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name))]


def _alike(one: str, other: str) -> bool:
    """Return whether two words are the same, or one a beginning of the other."""
    if one.isdigit() or other.isdigit():
        return one.lstrip("0") == other.lstrip("0")
    short, long = sorted((one, other), key=len)
    return one == other or (len(short) >= _SAME_START and long.startswith(short))
