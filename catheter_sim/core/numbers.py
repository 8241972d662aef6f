"""Numbers of a robot by their dotted keys, in SI units: read and written fast, many at once.

The keys are those of files (`segments.bending.rest_deg`, `core.document`); where a key leads is looked up
once for each class of robots. A fit rebuilds robots thousands of times.
"""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, cast

from catheter_sim.core.robot import R
from catheter_sim.units import file_name


@dataclass(frozen=True)
class _Place:
    """Where a key leads: a field of the robot, one part of what it holds, and a field of that.

    `part` is empty where the field holds one value, `leaf` where it holds the number itself.
    """

    field: str
    part: str
    leaf: str
    factor: float  # number in the file's unit = number in SI * factor


@lru_cache(maxsize=2048)
def _place(kind: type, key: str) -> _Place:
    head, _, rest = key.partition(".")
    field, hint, factor = _field(kind, head, key)
    if not rest:
        return _Place(field, "", "", factor)
    part = ""
    if typing.get_origin(hint) is tuple:
        hint = typing.get_args(hint)[0]
        part, _, rest = rest.rpartition(".")
    leaf, _, factor = _field(hint, rest, key)
    return _Place(field, part, leaf, factor)


def _field(kind: Any, name: str, key: str) -> tuple[str, Any, float]:
    """Return the field of a dataclass that files call `name`, its type and its factor."""
    if dataclasses.is_dataclass(kind):
        hints = typing.get_type_hints(kind)
        for item in dataclasses.fields(kind):
            file, factor = file_name(item.name)
            if file == name:
                return item.name, hints[item.name], factor
    raise KeyError(key)


def _at(robot: Any, key: str) -> _Place:
    kind: Any = type(robot)
    return _place(kind, key)


def number(robot: Any, key: str) -> float:
    """Return the number of `robot` at a dotted key, in SI units.

    Raises:
        KeyError: no such key.
    """
    place = _at(robot, key)
    value = getattr(robot, place.field)
    if place.part:
        value = next((item for item in value if item.name == place.part), None)
        if value is None:
            raise KeyError(key)
    return float(getattr(value, place.leaf) if place.leaf else value)


def from_file(robot: Any, key: str, value: float) -> float:
    """Return in SI units what a file gives as `value` at a dotted key."""
    return value / _at(robot, key).factor


def si_of(robot: Any, key: str, change: float) -> float:
    """Return in SI units a change of the number at a dotted key, given in its file's unit."""
    return change * (1.0 / _at(robot, key).factor)


def with_values(robot: R, values: Mapping[str, Any]) -> R:
    """Return `robot` with the values at dotted keys changed, numbers in SI units.

    Raises:
        KeyError: no such key.
    """
    fields: dict[str, Any] = {}
    parts: dict[tuple[str, str], dict[str, Any]] = {}
    for key, value in values.items():
        place = _at(robot, key)
        if place.leaf:
            parts.setdefault((place.field, place.part), {})[place.leaf] = value
        else:
            fields[place.field] = value
    for (field, part), leaves in parts.items():
        now = fields[field] if field in fields else getattr(robot, field)
        if part:
            fields[field] = tuple(replace(item, **leaves) if item.name == part else item for item in now)
        else:
            fields[field] = replace(now, **leaves)
    return cast(R, replace(robot, **fields))
