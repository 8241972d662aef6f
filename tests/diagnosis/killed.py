"""Calls for the tests of workers: they must be importable in other processes."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path


def square(number: float, marks: Path | None = None) -> float:
    """Return the square, and leave a mark that it was worked out."""
    if marks is not None:
        (marks / f"{number}_{os.getpid()}_{len(list(marks.iterdir()))}").touch()
    return number * number


def die_once(number: float, mark: Path) -> float:
    """Kill the own process the first time that 2 is asked for."""
    if number == 2.0 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


def always_die(number: float) -> float:
    """Kill the own process."""
    os.kill(os.getpid(), signal.SIGKILL)
    return number


def say_and_sleep(number: float, folder: str) -> float:
    """Leave a mark that the call has begun, and take long."""
    Path(folder, f"{number}").touch()
    time.sleep(600.0)
    return number
