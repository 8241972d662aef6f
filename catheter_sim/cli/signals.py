"""Signals that ask a program to end unwind it, as Ctrl-C does: what it began it takes away itself."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP")  # those that the system has
_LONGEST_S = 30  # to take everything away; then the system ends the program


class Stopped(KeyboardInterrupt):
    """A signal asked the program to end.

    Attributes:
        number: of the signal.
    """

    def __init__(self, number: int) -> None:
        name = signal.Signals(number).name
        super().__init__("interrupted" if number == signal.SIGINT else f"stopped by {name}")
        self.number = number


@contextmanager
def unwound_by_signals() -> Iterator[None]:
    """Raise `Stopped` where the main thread is when the first such signal comes; the others do nothing.

    A signal that was ignored before (`nohup`, a job in the background) stays ignored.
    """
    if threading.current_thread() is not threading.main_thread():  # signals are the main thread's
        yield
        return
    asked: list[int] = []

    def stop(number: int, frame: FrameType | None) -> None:
        if asked:  # `timeout` and some terminals ask twice: it is on its way
            return
        asked.append(number)
        if hasattr(signal, "alarm"):
            signal.alarm(_LONGEST_S)
        raise Stopped(number)

    numbers = [getattr(signal, name) for name in _NAMES if hasattr(signal, name)]
    before = {number: signal.getsignal(number) for number in numbers}
    taken = [number for number in numbers if before[number] not in (signal.SIG_IGN, None)]
    try:
        for number in taken:
            signal.signal(number, stop)
        yield
    finally:
        if asked and hasattr(signal, "alarm"):
            signal.alarm(0)
        for number in taken:
            signal.signal(number, before[number])
