"""How a check says which value is impossible: of a robot, its key and value as files have them.

Arguments in Python go through `number_of`, `whole_of` and `flag_of`: NumPy's scalars are taken as Python's
are, and a boolean is no number.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from numbers import Integral, Real
from typing import Any

import numpy as np

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


def number_of(
    value: Any, where: str, needed: str = "a finite number", holds: Callable[[float], bool] = math.isfinite
) -> float:
    """Return an argument as a number.

    Args:
        value: what a user gave: a number of Python's or of NumPy's.
        where: what it is called.
        needed: what would be right, with its article.
        holds: whether a number is.

    Raises:
        InputError: it is no number, or `holds` is false of it.
    """
    number = as_number(value)
    if number is not None and holds(number):
        return number
    raise InputError(f"{where} = {shown(value)}: {needed} is needed")


def as_number(value: Any) -> float | None:
    """Return a number of Python's or of NumPy's as a float; None: it is none, or a boolean."""
    item = _scalar(value)
    if isinstance(item, bool) or not isinstance(item, Real):
        return None
    try:
        return float(item)
    except OverflowError:
        return math.copysign(math.inf, item)


def whole_of(value: Any, where: str, needed: str, least: int, most: float = math.inf) -> int:
    """Return an argument as a whole number of `least` to `most`; the others as of `number_of`.

    Raises:
        InputError: it is none.
    """
    item = _scalar(value)
    if isinstance(item, Integral) and not isinstance(item, bool) and least <= int(item) <= most:
        return int(item)
    raise InputError(f"{where} = {shown(value)}: {needed} is needed")


def flag_of(value: Any, where: str) -> bool:
    """Return an argument as True or False; 1 and 0 are taken for them.

    Raises:
        InputError: it is none of these.
    """
    item = _scalar(value)
    if isinstance(item, Integral) and item in (0, 1):
        return bool(item)
    raise InputError(f"{where} = {shown(value)}: True or False is needed")


def _scalar(value: Any) -> Any:
    """Return one number or boolean of NumPy's as Python's; what is none stays what it is."""
    one = isinstance(value, np.generic | np.ndarray) and value.ndim == 0
    return value.item() if one else value


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
