"""Rows of a batch shared out to threads; compiled code runs side by side there."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor


def share_out(solve: Callable[[slice], None], rows: int, threads: int) -> None:
    """Call `solve` with slices of the rows, at most one for each thread, and wait for all.

    Raises:
        ValueError: fewer than one thread.
    """
    if threads < 1:
        raise ValueError(f"threads = {threads}: must be at least 1")
    size = -(-rows // threads) or 1
    parts = [slice(start, min(start + size, rows)) for start in range(0, rows, size)]
    if len(parts) <= 1:
        solve(slice(0, rows))
        return
    with ThreadPoolExecutor(len(parts)) as pool:
        list(pool.map(solve, parts))
