"""Settings of a robot as users give them in Python: a text, texts, or a mapping."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from numbers import Integral, Real
from typing import Any

from catheter_sim.core.document import Document, override, parse_override
from catheter_sim.errors import InputError, shown

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
