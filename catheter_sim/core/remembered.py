"""What is worked out once for the same object: robots of a fit share their parts, slow to compare."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

T = TypeVar("T")
KEPT = 256


def by_identity(count: int) -> Callable[[Callable[..., T]], Callable[..., T]]:
    """Return a decorator of functions that remember results by their first `count` arguments' identity.

    The others are compared by value. The arguments must never change: tuples of frozen values. At most `KEPT`
    results are kept, with the arguments that they belong to.
    """

    def decorate(function: Callable[..., T]) -> Callable[..., T]:
        known: dict[tuple[Any, ...], tuple[tuple[Any, ...], T]] = {}

        @wraps(function)
        def remembered(*arguments: Any) -> T:
            key = (*map(id, arguments[:count]), *arguments[count:])
            found = known.get(key)
            if found is None:
                if len(known) >= KEPT:
                    known.clear()
                found = known[key] = arguments, function(*arguments)
            return found[1]

        return remembered

    return decorate
