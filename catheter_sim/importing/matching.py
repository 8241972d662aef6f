"""Which of a file's columns is which channel of the robot, by name, else by order."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence

from catheter_sim.channels import FORCE_CHANNELS, MOMENT_CHANNELS, actuations, input_channels, output_channels
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.mapping import ANGLES, UNITS, channel_unit
from catheter_sim.importing.guesses import Guess
from catheter_sim.importing.heads import Heads

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
