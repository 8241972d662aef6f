"""Signals that ask a program to end unwind it, as Ctrl-C does: what it began it takes away itself."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

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

    A signal that was ignored before (`nohup`, a job in the background) stays ignored. Compiled code that
    calls back into Python may turn `Stopped` into an error of its own (matplotlib's converters make it a
    `ValueError`): whatever error comes out after a signal leaves as `Stopped`.
    """
    asked: list[int] = []

    def stop(number: int, frame: FrameType | None) -> None:
        if asked:  # `timeout` and some terminals ask twice: it is on its way
            return
        asked.append(number)
        if hasattr(signal, "alarm"):
            signal.alarm(_LONGEST_S)
        raise Stopped(number)

    with _handled(stop):
        try:
            yield
        except Exception as error:
            if asked:
                raise Stopped(asked[0]) from error
            raise
        finally:
            if asked and hasattr(signal, "alarm"):
                signal.alarm(0)


@contextmanager
def held_back() -> Iterator[None]:
    """Let such a signal wait until the context is left; a process of one's own is started meanwhile.

    A signal between a process's start and the note of it would leave a process that nobody ends, which makes
    its file after that has been taken away.
    """
    came: list[int] = []
    try:
        with _handled(lambda number, _: came.append(number)):
            yield
    finally:
        if came:
            signal.raise_signal(came[0])


@contextmanager
def _handled(handler: Callable[[int, FrameType | None], None]) -> Iterator[None]:
    """Give such signals to `handler`, but those that are ignored; outside the main thread change nothing."""
    before: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():  # signals are the main thread's
        numbers = [getattr(signal, name) for name in _NAMES if hasattr(signal, name)]
        before = {number: signal.getsignal(number) for number in numbers}
    taken = [number for number, old in before.items() if old not in (signal.SIG_IGN, None)]
    try:
        for number in taken:
            signal.signal(number, handler)
        yield
    finally:
        for number in taken:
            signal.signal(number, before[number])
