"""Robots to and from nested documents (TOML tables, `--set`), and numbers by dotted keys."""

from __future__ import annotations

import dataclasses
import math
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from numbers import Integral, Real
from typing import Any, cast

from catheter_sim.core.robot import R
from catheter_sim.errors import InputError, cut, shown, unknown
from catheter_sim.units import file_name

# ----------------------------------------------------------------------------------------------------
# Numbers of a robot by their dotted keys, in SI units: read and written fast, many at once.
#
# The keys are those of files (`segments.bending.rest_deg`, `core.document`); where a key leads is looked up
# once for each class of robots. A fit rebuilds robots thousands of times.


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


# ----------------------------------------------------------------------------------------------------
# Robots to and from nested documents (TOML tables, `--set`), with units converted at this edge.
#
# A document's keys are the dataclass fields' names with the unit that files use (`length_m` ->
# `length_mm`). Lists of named tables are addressed by name or position in dotted keys:
# `segments.distal.length_mm`, `tendons.0.radius_mm`.

Document = dict[str, Any]

_DIGITS, ALL_DIGITS = 12, 17
_DEEPEST = 16  # levels of tables and lists; no document of ours has half as many
_MOST_ENTRIES = 1000  # of a list; checked again, more closely, where a robot is
_BEYOND_64_BITS = 2**63
_LARGEST_WHOLE = 10**9  # of what is counted: disks, joints, rings


def to_document(value: Any, most_digits: int = _DIGITS) -> Document:
    """Return the dataclass `value` as a nested document in file units; defaults are kept.

    Args:
        value: the dataclass.
        most_digits: a number has no more of them, and only as many beyond 12 as it takes to read the same
            value back. An SI value that is no number of a file over its unit is met to the last bit.
    """
    document: Document = {}
    for item in dataclasses.fields(value):
        key, factor = file_name(item.name)
        document[key] = _plain(getattr(value, item.name), factor, most_digits)
    return document


def _plain(value: Any, factor: float, most_digits: int) -> Any:
    if dataclasses.is_dataclass(value):
        return to_document(value, most_digits)
    if isinstance(value, tuple):
        return [_plain(item, factor, most_digits) for item in value]
    if isinstance(value, Mapping):
        return {str(key): _plain(item, 1.0, most_digits) for key, item in value.items()}
    if isinstance(value, float):
        # 12 digits: undoes the last-bit noise of the unit's factor, keeps the number.
        tried = [float(f"{value * factor:.{digits}g}") for digits in range(_DIGITS, most_digits + 1)]
        near = tried[-1]
        if len(tried) > 1:  # the factor rounds, too
            tried += [math.nextafter(near, end) for end in (-math.inf, math.inf)]
        return next((number for number in tried if number / factor == value), near)
    return value


def from_document(kind: type, document: Any, where: str) -> Any:
    """Return a `kind` (a dataclass) read from a document in file units.

    Args:
        kind: dataclass to make.
        document: nested mapping in file units.
        where: what to call the document in errors (file name and dotted key).

    Raises:
        InputError: a key is unknown or missing, or a value has the wrong type or is not a number.
    """
    if not isinstance(document, Mapping):
        raise InputError(f"{where}: a table is needed, not {shown(document)}")
    hints = typing.get_type_hints(kind)
    keys = {file_name(item.name)[0]: item for item in dataclasses.fields(kind)}
    for key in document:
        if key not in keys:
            raise unknown("key", str(key), sorted(keys), where)
    missing = [
        key
        for key, item in keys.items()
        if key not in document
        and item.default is dataclasses.MISSING
        and item.default_factory is dataclasses.MISSING
    ]
    if missing:
        raise InputError(f"{where}: {', '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing")
    values: dict[str, Any] = {}
    for key, item in keys.items():
        if key in document:
            _, factor = file_name(item.name)
            if item.default == () and document[key] in ([], ()):
                continue
            values[item.name] = _typed(hints[item.name], document[key], factor, f"{where}: {key}")
    return kind(**values)


def _typed(hint: Any, value: Any, factor: float, where: str) -> Any:
    origin = typing.get_origin(hint)
    if dataclasses.is_dataclass(hint):
        return from_document(typing.cast(type, hint), value, where)
    if origin is tuple:
        if not isinstance(value, list | tuple) or not value:
            raise InputError(f"{where}: a list with at least one entry is needed")
        if len(value) > _MOST_ENTRIES:
            raise InputError(f"{where}: {len(value)} entries: more than {_MOST_ENTRIES}")
        kind = typing.get_args(hint)[0]
        return tuple(
            _typed(kind, item, factor, f"{where}.{_label(item, index)}") for index, item in enumerate(value)
        )
    if origin in (dict, types.MappingProxyType) or (isinstance(origin, type) and issubclass(origin, Mapping)):
        if not isinstance(value, Mapping):
            raise InputError(f"{where}: a table is needed, not {shown(value)}")
        kind = typing.get_args(hint)[1]
        return {str(key): _typed(kind, item, 1.0, f"{where}.{key}") for key, item in value.items()}
    if hint is float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InputError(f"{where}: a number is needed, not {shown(value)}")
        number = _as_float(value, where)
        if math.isnan(number):
            raise InputError(f"{where}: a number is needed, not nan")
        return number / factor
    if hint is int:
        if isinstance(value, bool) or not isinstance(value, int):
            raise InputError(f"{where}: a whole number is needed, not {shown(value)}")
        if abs(value) > _LARGEST_WHOLE:
            raise InputError(f"{where} = {shown(value)}: must lie within {_LARGEST_WHOLE:g}")
        return value
    if not isinstance(value, str):
        raise InputError(f"{where}: a text is needed, not {shown(value)}")
    return value


def _as_float(value: float, where: str) -> float:
    try:
        return float(value)
    except OverflowError:
        raise InputError(f"{where} = {shown(value)}: too large a number") from None


def check_plain(document: Document, where: str) -> None:
    """Raise `InputError` where a document from a file holds what TOML allows and no document of ours has.

    These are tables and lists nested so deep that what goes down into them by calling itself fails, and
    whole numbers of more than 64 bits, which are no floats.
    """
    level: list[tuple[str, Any]] = [("", document)]
    for _ in range(_DEEPEST):
        below: list[tuple[str, Any]] = []
        for path, holder in level:
            named = holder.items() if isinstance(holder, Mapping) else enumerate(holder)
            below += [(f"{path}.{key}" if path else str(key), item) for key, item in named]
        for path, item in below:
            if isinstance(item, int) and abs(item) >= _BEYOND_64_BITS:
                raise InputError(f"{where}: {cut(path, 100)}: a whole number of more than 64 bits")
        level = [(path, item) for path, item in below if isinstance(item, Mapping | list | tuple)]
        if not level:
            return
    raise InputError(f"{where}: {cut(level[0][0], 100)}: tables or lists nested deeper than {_DEEPEST}")


def _label(item: Any, index: int) -> str:
    return str(item["name"]) if isinstance(item, Mapping) and "name" in item else str(index)


def parse_override(text: str, said: str = "--set") -> tuple[str, Any]:
    """Return the key and value of `KEY=VALUE`; a value that reads as a number is one.

    `said`: what errors call it.

    Raises:
        InputError: there is no `=`, no key before it, or a number that is too large.
    """
    key, separator, value = text.partition("=")
    if not separator or not key.strip():
        raise InputError(f"{said} {cut(text, 100)}: KEY=VALUE is needed, as in friction.mu=0.2")
    raw = value.strip()
    try:
        number = float(raw)
    except ValueError:
        return key.strip(), raw
    if math.isinf(number) and "inf" not in raw.lower():
        raise InputError(f"{said} {cut(text, 100)}: too large a number")
    try:
        return key.strip(), int(raw)
    except ValueError:
        return key.strip(), number


def override(document: Document, key: str, value: Any, said: str = "--set", names_too: bool = True) -> None:
    """Set the dotted `key` of `document` to `value`, in place.

    Below `effects` new keys `effects.NAME.PARAMETER` may appear (the effects check them); elsewhere
    the key must exist.

    Args:
        document: of the robot.
        key: dotted.
        value: a number or a text.
        said: what errors call the setting.
        names_too: where a text stands, take a number for a name that looks like one.

    Raises:
        InputError: no such key; the message names the choices at the level where it fails.
    """
    *path, last = key.split(".")
    where = f"{said} {cut(key, 100)}"
    below_effects = path[:1] == ["effects"]
    if below_effects and (len(path) != 2 or not all([*path, last])):
        raise InputError(f"{where}: an effect is set as effects.NAME.PARAMETER=VALUE")
    table: Any = document
    for depth, part in enumerate(path):
        table = _descend(table, part, where, create=depth > 0 and below_effects)
    if isinstance(table, list):
        raise InputError(f"{where}: names a whole table; choices: {cut(', '.join(_names(table)), 200)}")
    if not isinstance(table, dict):
        raise InputError(f"{where}: {'.'.join(path)} is a value, it has no keys")
    if last not in table and not below_effects:
        raise unknown("key", last, sorted(table), where)
    current = table.get(last)
    if isinstance(current, Mapping | list):
        raise InputError(f"{where}: names a whole table; choices: {cut(', '.join(_names(current)), 200)}")
    if names_too and isinstance(current, str):  # a name may look like a number
        value = str(value)
    table[last] = float(value) if isinstance(current, float) and isinstance(value, int) else value


def _names(table: Mapping[str, Any] | list[Any]) -> Iterator[str]:
    if isinstance(table, Mapping):
        yield from table
    else:
        yield from (_label(item, index) for index, item in enumerate(table))


def _descend(table: Any, part: str, where: str, create: bool) -> Any:
    if isinstance(table, list):
        by_position = {str(index): item for index, item in enumerate(table)}
        by_name = {_label(item, index): item for index, item in enumerate(table)}
        if part in by_position | by_name:  # a name that is a number is a name, not a position
            return (by_position | by_name)[part]
    elif isinstance(table, dict):
        if part in table:
            return table[part]
        if create:
            return table.setdefault(part, {})
    raise unknown("key", part, list(_names(table)) if isinstance(table, dict | list) else [], where)


def number_at(value: Any, key: str) -> float:
    """Return the number of the dataclass `value` at a dotted key, in file units.

    Raises:
        KeyError: no such key, or what it names takes no fractions.
    """
    head, _, rest = key.partition(".")
    if isinstance(value, tuple):
        for index, item in enumerate(value):
            if rest and getattr(item, "name", str(index)) == head:
                return number_at(item, rest)
        raise KeyError(key)
    for field in dataclasses.fields(value):
        name, factor = file_name(field.name)
        if name == head:
            now = getattr(value, field.name)
            if rest:
                return number_at(now, rest)
            if isinstance(now, float):
                return now * factor
    raise KeyError(key)


def with_number(value: Any, key: str, number: float) -> Any:
    """Return the dataclass `value` with the number at a dotted key changed, in file units.

    Raises:
        KeyError: no such key, or what it names takes no fractions.
    """
    head, _, rest = key.partition(".")
    if isinstance(value, tuple):
        labels = [getattr(item, "name", str(index)) for index, item in enumerate(value)]
        index = labels.index(head) if head in labels else -1
        if index < 0 or not rest:
            raise KeyError(key)
        return (*value[:index], with_number(value[index], rest, number), *value[index + 1 :])
    for item in dataclasses.fields(value):
        name, factor = file_name(item.name)
        if name == head:
            now = getattr(value, item.name)
            if not rest and not isinstance(now, float):
                raise KeyError(key)
            changed = with_number(now, rest, number) if rest else number / factor
            return dataclasses.replace(value, **{item.name: changed})
    raise KeyError(key)


def leaves(document: Any, prefix: str = "") -> Iterator[tuple[str, float]]:
    """Yield the dotted key and value of every number in `document`, effects and sources left out."""
    if isinstance(document, Mapping):
        for key, item in document.items():
            if not prefix and key in ("effects", "sources"):
                continue
            yield from leaves(item, f"{prefix}.{key}" if prefix else str(key))
    elif isinstance(document, list):
        for index, item in enumerate(document):
            yield from leaves(item, f"{prefix}.{_label(item, index)}")
    elif isinstance(document, int | float) and not isinstance(document, bool):
        yield prefix, float(document)


# ----------------------------------------------------------------------------------------------------
# Settings of a robot as users give them in Python: a text, texts, or a mapping.

# "friction.mu=0", ["friction.mu=0", "mount.stiffness_N_per_m=1e4"] or {"friction.mu": 0}
Settings = str | Sequence[str] | Mapping[str, Any]
SAID = "settings"  # what errors call them
_NEEDED = "texts KEY=VALUE, or a mapping of keys to values, are needed, as in {'friction.mu': 0.2}"
_KEY_NEEDED = "a dotted key is needed, as in friction.mu"


def settings_table(settings: Settings, said: str = SAID) -> dict[str, str | int | float]:
    """Return settings by their dotted keys; of a key that is set twice the last value.

    Values are as given, texts not yet read.

    Args:
        settings: one text `KEY=VALUE`, several, or a mapping.
        said: what errors call them.

    Raises:
        InputError: they are none of these, or one has no key or no value.
    """
    if isinstance(settings, Mapping):
        return {_key(key, said): _value(value, f"{said} {key}") for key, value in settings.items()}
    texts = [settings] if isinstance(settings, str) else settings
    if not isinstance(texts, Sequence) or not all(isinstance(text, str) for text in texts):
        raise InputError(f"{said} = {shown(settings)}: {_NEEDED}")
    table: dict[str, str | int | float] = {}
    for text in texts:
        head = text.partition("=")[0]
        if not head.isprintable():
            raise InputError(f"{said} {shown(head)}: {_KEY_NEEDED}")
        key, _ = parse_override(text, said)
        table.pop(key, None)  # so that the last one also comes last
        table[key] = text.partition("=")[2]
    return table


def set_all(document: Document, settings: Settings, said: str = SAID) -> None:
    """Set every setting in a robot's `document`, in place.

    Args:
        document: of the robot, complete.
        settings: see `settings_table`. A number stays a number; a text is read as `--set` reads it.
        said: what errors call them.

    Raises:
        InputError: they are no settings, or there is no such key.
    """
    for key, value in settings_table(settings, said).items():
        if isinstance(value, str):
            read = parse_override(f"{key}={value}", said)[1]
            override(document, key, _value(read, f"{said} {key}"), said)
        else:
            override(document, key, value, said, names_too=False)


def _key(key: Any, said: str) -> str:
    if not isinstance(key, str) or not key.strip() or "=" in key or not key.isprintable():
        raise InputError(f"{said} {shown(key)}: {_KEY_NEEDED}")
    return key.strip()


def _value(value: Any, where: str) -> str | int | float:
    if isinstance(value, str):
        return value
    if isinstance(value, Real) and not isinstance(value, bool):
        try:
            number = float(value)
        except OverflowError:
            raise InputError(f"{where} = {shown(value)}: too large a number") from None
        return int(value) if isinstance(value, Integral) else number
    raise InputError(f"{where} = {shown(value)}: a number or a text is needed")
