"""Processes that fit side by side."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from typing import Any, TypeVar

T = TypeVar("T")


@contextmanager
def workers(jobs: int) -> Iterator[Executor | None]:
    """Give an executor with `jobs` processes; None for one, which needs no other process."""
    if jobs <= 1:
        yield None
        return
    # The matrices are small: threads of the linear algebra would only stand in one another's way. The
    # libraries read these names when a process starts.
    names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
    before = {name: os.environ.get(name) for name in names}
    os.environ.update({name: os.environ.get(name, "1") for name in names})
    try:
        with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
            yield pool
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def each(pool: Executor | None, call: Callable[..., T], arguments: Sequence[tuple[Any, ...]]) -> list[T]:
    """Return the results of several calls, in order, made in the pool's processes where there is one."""
    if pool is None:
        return [call(*item) for item in arguments]
    return [future.result() for future in [pool.submit(call, *item) for item in arguments]]
