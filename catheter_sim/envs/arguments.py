"""Checks of what an environment is given: every wrong argument is one line that names it and the choices."""

from __future__ import annotations

import inspect
import math
from collections.abc import Iterable, Mapping, Sequence
from numbers import Integral, Real
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.errors import InputError, shown, unknown

_OPEN = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)


def argument_names(environment: type) -> list[str]:
    """Return the names of the arguments of an environment's class, those of its bases included."""
    names: dict[str, None] = {}
    for base in environment.__mro__:
        own = base.__dict__.get("__init__")
        if own is None or base.__module__.split(".")[0] in ("gymnasium", "builtins", "typing"):
            continue
        for name, parameter in inspect.signature(own).parameters.items():
            if name != "self" and parameter.kind not in _OPEN:
                names.setdefault(name)
    return list(names)


def refuse_unknown(given: Iterable[str], choices: Sequence[str], where: str) -> None:
    """Raise `InputError` for the first of the `given` names that is not among `choices`."""
    for name in given:
        if name not in choices:
            raise unknown("argument", name, choices, where)


def checked_choice(name: str, value: Any, choices: Sequence[str], none_too: bool = False) -> Any:
    """Return `value`, one of the texts `choices`, or None where that is one too.

    Raises:
        InputError: it is another.
    """
    if value is None and none_too:
        return None
    if isinstance(value, str) and value in choices:
        return value
    known = [*choices, "None"] if none_too else choices
    if isinstance(value, str):
        raise unknown(name, value, known)
    raise InputError(f"{name} = {shown(value)}: choices: {', '.join(known)}")


def checked_above_zero(name: str, value: Any, most: float = math.inf) -> float:
    """Return `value` as a number above zero, finite, and at most `most`.

    Raises:
        InputError: it is none.
    """
    number = _number(value)
    if not (0.0 < number <= most and math.isfinite(number)):
        bound = "zero and finite" if most == math.inf else f"0 and at most {most:g}"
        given = f"{value:g}" if isinstance(value, float) else shown(value)
        raise InputError(f"{name} = {given}: must be above {bound}")
    return number


def checked_whole(name: str, value: Any, least: int = 1) -> int:
    """Return `value` as a whole number, `least` or more.

    Raises:
        InputError: it is none.
    """
    if isinstance(value, bool) or not isinstance(value, Integral) or value < least:
        raise InputError(f"{name} = {shown(value)}: must be a whole number, {least} or more")
    return int(value)


def checked_flag(name: str, value: Any) -> bool:
    """Return `value`, true or false.

    Raises:
        InputError: it is neither.
    """
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{name} = {shown(value)}: choices: True, False")
    return bool(value)


def checked_vector(name: str, value: Any, needed: str = "three finite numbers are needed") -> Array:
    """Return `value` as an array of three finite numbers, shape (3,).

    Raises:
        InputError: it is none.
    """
    numbers = _array(value)
    if numbers is None or numbers.shape != (3,) or not np.isfinite(numbers).all():
        raise InputError(f"{name} = {shown(value)}: {needed}")
    return numbers


def checked_pair(name: str, value: Any, needed: str) -> tuple[float, float]:
    """Return `value` as two finite numbers, the lower first.

    Raises:
        InputError: it is none; `needed` says what would be one.
    """
    numbers = None if isinstance(value, str | Mapping) else _array(value)
    if numbers is None or numbers.shape != (2,) or not np.isfinite(numbers).all():
        raise InputError(f"{name} = {shown(value)}: {needed}")
    low, high = map(float, numbers)
    if low > high:
        raise InputError(f"{name} = {shown(value)}: {needed}")
    return low, high


def checked_action(name: str, value: Any, shape: tuple[int, ...], needed: str) -> Array:
    """Return an action as an array of numbers of `shape`; infinite ones count as the largest.

    Raises:
        InputError: it has another shape, or holds what is no number; `needed` says what would be right.
    """
    numbers = _array(value)
    if numbers is None or numbers.shape != shape or np.isnan(numbers).any():
        raise InputError(f"{name} = {shown(value)}: {needed}")
    return numbers


def checked_actions(value: Any, shape: tuple[int, int], stepping: np.ndarray) -> Array:
    """Return the actions of many environments, as `checked_action`.

    Args:
        value: to be checked.
        shape: a row for each environment.
        stepping: whose rows count, shape (n,): what starts anew does not read its own.

    Raises:
        InputError: as `checked_action`.
    """
    numbers = _array(value)
    if numbers is None or numbers.shape != shape or np.isnan(numbers[stepping]).any():
        raise InputError(f"actions: {shape} numbers are needed, one row for each environment")
    return numbers


def require_running(ended: np.ndarray) -> None:
    """Raise `InputError` where an environment's episode has ended and nothing starts it anew."""
    if ended.any():
        which = ", ".join(map(str, np.flatnonzero(ended)))
        raise InputError(f"the episodes of environments {which} have ended: reset them (reset_mask)")


def checked_options(options: Any, choices: Sequence[str]) -> dict[str, Any]:
    """Return the options of a reset.

    Raises:
        InputError: they are no mapping, or one is not among `choices`.
    """
    if options is None:
        return {}
    if not isinstance(options, Mapping):
        known = ", ".join(choices) or "(none)"
        raise InputError(f"options = {shown(options)}: a mapping is needed; its keys: {known}")
    for name in options:
        if name not in choices:
            raise unknown("option of reset", name, choices)
    return dict(options)


def checked_seeds(seed: Any, count: int) -> list[int | None]:
    """Return a seed for each of `count` environments: of one seed, the first one's, each next is one more.

    Raises:
        InputError: there are more or fewer, or one is neither a whole number, 0 or more, nor None.
    """
    if seed is None:
        return [None] * count
    if isinstance(seed, Integral) and not isinstance(seed, bool):
        first = checked_whole("seed", seed, 0)
        return [first + one for one in range(count)]
    if isinstance(seed, str) or not isinstance(seed, Sequence | np.ndarray):
        raise InputError(f"seed = {shown(seed)}: a whole number, 0 or more, or {count} of them, is needed")
    if len(seed) != count:
        raise InputError(f"seed: {len(seed)} numbers are given, {count} are needed")
    return [None if own is None else checked_whole("seed", own, 0) for own in seed]


def checked_mask(mask: Any, count: int) -> np.ndarray:
    """Return which of `count` environments `reset_mask` names, as truth values; all where it is None.

    Raises:
        InputError: it is no such array, or names none.
    """
    if mask is None:
        return np.ones(count, dtype=bool)
    if not isinstance(mask, np.ndarray) or mask.dtype != bool or mask.shape != (count,):
        raise InputError(f"reset_mask: an array of {count} truth values is needed")
    if not mask.any():
        raise InputError("reset_mask: at least one environment is to be reset")
    return mask


def _number(value: Any) -> float:
    """Return `value` as a number; not-a-number where it is none."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _array(value: Any) -> Array | None:
    """Return `value` as an array of real numbers, or None where it is none."""
    try:
        if np.asarray(value).dtype.kind not in "biuf":
            return None
        return np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        return None
