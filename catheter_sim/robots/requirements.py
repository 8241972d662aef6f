"""How a check of a robot says which number is impossible: the key and value as files have them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from catheter_sim.errors import InputError
from catheter_sim.units import file_name


def need(holder: Any, name: str, prefix: str, holds: Callable[[Any], bool], what: str) -> None:
    """Raise `InputError`, with the key and value as files have them, unless `holds` of the field."""
    value = getattr(holder, name)
    if not holds(value):
        key, factor = file_name(name)
        shown = f"{value * factor:g}" if isinstance(value, int | float) else repr(value)
        raise InputError(f"{prefix}{key} = {shown}: {what}")


def positive(holder: Any, name: str, prefix: str, finite: bool = True) -> None:
    """Raise `InputError` unless the field is above zero, and finite where that is asked."""
    what = "must be above zero and finite" if finite else "must be above zero"
    need(holder, name, prefix, lambda value: value > 0 and (not finite or math.isfinite(value)), what)


def check_name(name: str, what: str) -> None:
    """Raise `InputError` unless `name` can stand in a column and a dotted key."""
    if not name or not name.replace("_", "").isalnum():
        raise InputError(f"{what} {name!r}: a name needs letters, digits and _ only")
