"""Calls whose results are kept as far as time allows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from catheter_sim.diagnosis.fitting.workers import OutOfTime, Workers, map_calls

K = TypeVar("K")
V = TypeVar("V")


def work_out(
    place: Workers,
    deadline: float,
    store: dict[K, V],
    keys: Sequence[K],
    call: Callable[..., V],
    arguments: Sequence[tuple[Any, ...]],
) -> None:
    """Put the results of calls into `store` by their keys.

    Args:
        place: where to call.
        deadline: on the clock of `time.monotonic`, as of `map_calls` [s].
        store: by key.
        keys: one of each call.
        call: a function of a module.
        arguments: of each call.

    Raises:
        OutOfTime: before the end; what is done by then is in `store`.
    """
    try:
        found = dict(enumerate(map_calls(place, call, arguments, deadline)))
    except OutOfTime as late:
        store |= {keys[index]: item for index, item in late.found.items()}
        raise
    store |= {keys[index]: item for index, item in found.items()}
