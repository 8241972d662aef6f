"""How a check of a robot says which number is impossible: the key and value as files have them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from catheter_sim.errors import InputError, shown
from catheter_sim.units import file_name

MAX_LINKS = 400  # in a row: MuJoCo reads files nested 500 deep at most
MAX_TENDONS = 100
_SMALLEST, _LARGEST = 1e-18, 1e18  # in SI units, of what must be above zero
_LONGEST_NAME = 60  # characters; names stand in columns


def need(holder: Any, name: str, prefix: str, holds: Callable[[Any], bool], what: str) -> None:
    """Raise `InputError`, with the key and value as files have them, unless `holds` of the field."""
    value = getattr(holder, name)
    if not holds(value):
        key, factor = file_name(name)
        text = f"{value * factor:g}" if isinstance(value, int | float) else shown(value)
        raise InputError(f"{prefix}{key} = {text}: {what}")


def positive(holder: Any, name: str, prefix: str, finite: bool = True) -> None:
    """Raise `InputError` unless the field is above zero, and finite where that is asked.

    A finite number whose square or fourth power would be no number any more is refused as well.
    """
    what = "must be above zero and finite" if finite else "must be above zero"
    need(holder, name, prefix, lambda value: value > 0 and (not finite or math.isfinite(value)), what)
    what = "too small or too large to compute with"
    need(holder, name, prefix, lambda value: math.isinf(value) or _SMALLEST <= value <= _LARGEST, what)


def check_name(name: str, what: str) -> None:
    """Raise `InputError` unless `name` can stand in a column and a dotted key."""
    if not name or not name.replace("_", "").isalnum():
        raise InputError(f"{what} {shown(name)}: a name needs letters, digits and _ only")
    if len(name) > _LONGEST_NAME:
        raise InputError(f"{what} {shown(name)}: a name has at most {_LONGEST_NAME} characters")


def check_counts(segments: Sequence[Any], tendons: Sequence[Any], where: str) -> None:
    """Raise `InputError` where a robot has more segments or tendons than can be built in seconds."""
    for what, found, most in (("segments", segments, MAX_LINKS), ("tendons", tendons, MAX_TENDONS)):
        if len(found) > most:
            raise InputError(f"{where}: {len(found)} {what}: more than {most}")
