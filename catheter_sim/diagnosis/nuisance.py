"""Known-uncertain numbers of a specimen, calibrated before anything is called wrong.

A data set that has a table `[calibration]` names them itself (`calibration_numbers`). For the others,
the ranges are those of the robot's own file (`core.published`): every specimen may differ by so much, and no
cause is named for it. Any other robot brings no such ranges, so that nothing of it
is calibrated: what its file says is taken at its word.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

from catheter_sim.arrays import Array
from catheter_sim.catalogue import PUBLISHED
from catheter_sim.core.document import (
    from_file,
    leaves,
    number,
    number_at,
    to_document,
    with_number,
    with_values,
)
from catheter_sim.core.effect import Parameter
from catheter_sim.core.inputs import READ_WITH
from catheter_sim.core.published import Uncertain
from catheter_sim.core.robot import RobotSpec, as_number, check_name
from catheter_sim.effects.apply import causes_same_as
from catheter_sim.errors import InputError, unknown
from catheter_sim.robots import check_robot

_SCALE = 0.125  # of a change that matters, of a number's range
_TIED_BY = ("range", "factor")  # what a data set gives of several numbers that are one
_RANGE_PARTS = 20.0  # of a calibrated number's whole range


@dataclass(frozen=True)
class Nuisance:
    """One number of a specimen.

    Attributes:
        parameter: its name in reports, its specified value (`null`) and its range.
        change_robot: the specification with a value of it.
        spread: standard deviation known beforehand; inf: nothing is known but the range.
        superseded_by: effects that free the same number; with one of them this stays as specified.
        stands_for: effects that are not tried, since this number is free already.
        change_outputs: where the number acts on what is measured and not on the robot: the output columns'
            names, outputs (B, r, o) in file units and values (B,) to outputs; None elsewhere.
    """

    parameter: Parameter
    change_robot: Callable[[RobotSpec, float], RobotSpec]
    spread: float = math.inf
    superseded_by: tuple[str, ...] = ()
    stands_for: tuple[str, ...] = ()
    change_outputs: Callable[[tuple[str, ...], Array, Array], Array] | None = None

    @property
    def name(self) -> str:
        """The number's name."""
        return self.parameter.name


@lru_cache(maxsize=16)
def nuisances_of(robot_reference: str) -> tuple[Nuisance, ...]:
    """Return the nuisance parameters of a robot by its id; none for a path."""
    published = PUBLISHED.get(robot_reference)
    if published is None:
        return ()
    robot = published.build()
    return tuple(_factor(item, causes_same_as(robot, item.keys)) for item in published.uncertain)


def _factor(uncertain: Uncertain, superseded_by: tuple[str, ...]) -> Nuisance:
    """Return a factor on specified numbers, uniform in its range about 1."""
    half = uncertain.half
    scale = 2.0 * half * _SCALE
    parameter = Parameter(uncertain.name, 1.0, 1.0 - half, 1.0 + half, scale=scale, start=1.0)
    return Nuisance(parameter, partial(_scaled, uncertain.keys), half / math.sqrt(3.0), superseded_by)


def _scaled(keys: Sequence[str], robot: RobotSpec, factor: float) -> RobotSpec:
    return with_values(robot, {key: number(robot, key) * factor for key in keys})


def calibration_numbers(table: Any, robot: RobotSpec, where: str) -> tuple[Nuisance, ...]:
    """Return the numbers that a data set wants calibrated.

    `table`, nested or flat: dotted key of the robot's specification -> [lower, upper], in file units; the fit
    starts at the specified value. The upper end may be inf, and so may the specified value. Or a name of its
    own -> `keys` of several numbers that are one, with the `range` of what they all are, or of a `factor` on
    them.

    Raises:
        InputError: a key that the robot does not have, or that stands twice, a range that is none, or one
            whose ends are impossible for the robot.
    """
    if not isinstance(table, Mapping):
        raise InputError(f"{where}: calibration: a table is needed, not {table!r}")
    specified = dict(leaves(to_document(robot)))
    found = []
    taken: set[str] = set()
    for name, entry in _flat(table):
        place = f"{where}: calibration.{name}"
        if isinstance(entry, Mapping):
            keys, number = _tied(name, entry, robot, specified, place)
        else:
            _check_key(name, specified, f"{where}: calibration", place)
            keys, number = (name,), _single(name, entry, robot, specified[name], place)
        for key in keys:
            if key in taken:
                raise InputError(f"{place}: {key} is calibrated already")
            taken.add(key)
        found.append(number)
    return tuple(found)


def _check_key(key: str, specified: Mapping[str, float], where: str, place: str) -> None:
    if key not in specified:
        raise unknown("number", key, specified, where)
    if key.endswith(READ_WITH):
        raise InputError(f"{place}: inputs are read with {key}, it cannot be calibrated")


def _single(key: str, ends: Any, robot: RobotSpec, value: float, place: str) -> Nuisance:
    low, high = _range(ends, value, place)
    _check_ends(robot, (low, high), lambda end: with_number(robot, key, end), place)
    return _calibrated(key, (low, high), value, place, causes_same_as(robot, [key]))


def _tied(
    name: str, entry: Mapping[str, Any], robot: RobotSpec, specified: Mapping[str, float], place: str
) -> tuple[tuple[str, ...], Nuisance]:
    """Return the keys of several numbers that are one, and that one."""
    check_name(name, f"{place}:")
    if name in specified:
        raise InputError(f"{place}: is a number of the robot; a name of its own is needed")
    for key in entry:
        if key not in ("keys", *_TIED_BY):
            raise unknown("key", str(key), ("keys", *_TIED_BY), place)
    given = entry["keys"]
    if not isinstance(given, list) or len(given) < 2 or not all(isinstance(key, str) for key in given):
        raise InputError(f"{place}.keys: a list of two numbers of the robot or more is needed, not {given!r}")
    keys = tuple(given)
    for key in keys:
        _check_key(key, specified, f"{place}.keys", place)
        try:
            number_at(robot, key)
        except KeyError:
            raise InputError(f"{place}.keys: {key} is a whole number, it cannot be calibrated") from None
    ways = [way for way in _TIED_BY if way in entry]
    if len(ways) != 1:
        raise InputError(f"{place}: range = [lower, upper] or factor = [lower, upper] is needed, one of them")
    value, change = 1.0, partial(_scaled, keys)
    if ways == ["range"]:
        value, change = _one_value(keys, specified, place), partial(_with_all, keys)
    elif not all(math.isfinite(specified[key]) for key in keys):
        raise InputError(f"{place}.factor: a number among them is inf")
    ends = _range(entry[ways[0]], value, f"{place}.{ways[0]}")
    if math.isinf(ends[1]):
        raise InputError(f"{place}.{ways[0]}: must be finite")
    _check_ends(robot, ends, lambda end: change(robot, end), place)
    parameter = Parameter(name, value, *ends, scale=(ends[1] - ends[0]) / _RANGE_PARTS, start=value)
    return keys, Nuisance(parameter, change, stands_for=causes_same_as(robot, keys))


def _one_value(keys: Sequence[str], specified: Mapping[str, float], place: str) -> float:
    """Return the value that several numbers of one unit have, in their file's unit."""
    first = keys[0]
    for key in keys:
        if key.rpartition(".")[2] != first.rpartition(".")[2]:
            raise InputError(f"{place}.keys: {first} and {key} are no numbers of one sort; factor takes such")
        if specified[key] != specified[first]:
            differ = f"{first} = {specified[first]:g} and {key} = {specified[key]:g}"
            raise InputError(f"{place}.keys: {differ} are specified; factor takes numbers that differ")
    return specified[first]


def _range(ends: Any, value: float, place: str) -> tuple[float, float]:
    """Return [lower, upper] as given, checked: the specified value lies within."""
    two = isinstance(ends, list) and len(ends) == 2
    low, high = (as_number(end) for end in ends) if two else (None, None)
    if low is None or high is None or not low < high:
        raise InputError(f"{place}: [lower, upper] is needed, lower below upper, not {ends!r}")
    if not low <= value <= high:
        raise InputError(f"{place}: the specified value, {value:g}, lies outside {low:g} to {high:g}")
    return low, high


def _check_ends(
    robot: RobotSpec, ends: tuple[float, float], changed: Callable[[float], RobotSpec], place: str
) -> None:
    """Raise `InputError` where the robot is impossible at an end of a range."""
    try:
        for end in ends:
            check_robot(changed(end), f"{place} = {end:g}")
    except KeyError:
        raise InputError(f"{place}: is a whole number, it cannot be calibrated") from None


def _flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted keys and values: in TOML, `friction.mu = ...` without quotes is a nested table."""
    for key, value in table.items():
        if isinstance(value, Mapping) and "keys" not in value:
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _calibrated(
    key: str, ends: tuple[float, float], value: float, place: str, same: tuple[str, ...]
) -> Nuisance:
    low, high = ends
    inverse = math.isinf(high)
    if inverse and low <= 0.0:
        raise InputError(f"{place}: up to inf, the lower end must be above 0")
    width = 1.0 / low if inverse else high - low
    parameter = Parameter(key, value, low, high, scale=width / _RANGE_PARTS, start=value, inverse=inverse)
    return Nuisance(parameter, partial(_with_all, (key,)), stands_for=same)


def _with_all(keys: Sequence[str], robot: RobotSpec, value: float) -> RobotSpec:
    return with_values(robot, {key: from_file(robot, key, value) for key in keys})
