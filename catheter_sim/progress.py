"""What long work is doing, on standard error: a bar on a terminal, lines where there is none."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from tqdm import tqdm

T = TypeVar("T")

EVERY_S = 10.0  # between two lines about work that is counted
_NAMED = 6  # files of kernels in the line that says what was compiled


def note(text: str) -> None:
    """Write a line to standard error at once, above a bar if one is shown.

    Standard error that is closed, or that nobody reads any more, is no reason to stop working.
    """
    with suppress(OSError, ValueError):
        if bars_shown():
            from tqdm import tqdm  # here, as the command line's help is to be there at once

            tqdm.write(text, file=sys.stderr)
        elif sys.stderr is not None:
            print(text, file=sys.stderr, flush=True)


def on_terminal() -> bool:
    """Return whether standard error is a terminal."""
    with suppress(ValueError):  # it is closed
        return sys.stderr is not None and sys.stderr.isatty()
    return False


def bars_shown() -> bool:
    """Return whether standard error shows bars: it is a terminal, or this is a notebook."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    return on_terminal() or getattr(shell, "kernel", None) is not None


class Stages:
    """Says which stage long work is in.

    On a terminal and in a notebook one line holds the stage and a clock, and is gone at the end. Elsewhere
    each stage is a line with the time since the beginning, and how much there is: "diagnose: choosing causes
    (12.3 of 300 s)".
    """

    def __init__(self, name: str, shown: bool, every_s: float = 0.0, budget_s: float = math.inf) -> None:
        """Start the clock.

        Args:
            name: of the work; lines begin with it.
            shown: False: nothing is written at all.
            every_s: least time between two lines, and before the first one [s].
            budget_s: what the work may take, for who reads it [s].
        """
        self._name, self._shown, self._every_s = name, shown, every_s
        self._of = f" of {budget_s:g} s" if math.isfinite(budget_s) else ""
        self._start = self._last = time.monotonic()
        self._bar: tqdm[Any] | None = None
        if shown and bars_shown():
            from tqdm import tqdm

            self._bar = tqdm(bar_format=f"{{desc}} ({{elapsed}}{self._of})", leave=False)

    def say(self, stage: str) -> None:
        """Say that a stage begins."""
        if self._bar is not None:
            self._bar.set_description(stage)
            return
        now = time.monotonic()
        if self._shown and now - self._last >= self._every_s:
            note(f"{self._name}: {stage} ({now - self._start:.1f}{self._of or ' s'})")
            self._last = now

    def __enter__(self) -> Stages:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._bar is not None:
            self._bar.close()


def counted(
    items: Iterable[T], count: int, name: str, unit: str, shown: bool, every_s: float = EVERY_S
) -> Iterator[T]:
    """Yield `items` and show how many of them are done.

    On a terminal and in a notebook by a bar; elsewhere by a line now and then: "simulating: row 120 of 5000
    (12.3 s)".

    Args:
        items: what is worked through.
        count: how many there are.
        name: of the work; lines begin with it.
        unit: what one of them is called.
        shown: False: nothing is written at all.
        every_s: time between two lines [s].
    """
    if shown and bars_shown():
        from tqdm import tqdm

        yield from tqdm(items, total=count, unit=unit, leave=False)
        return
    with Stages(name, shown, every_s) as stages:
        for number, item in enumerate(items, 1):
            stages.say(f"{unit} {number} of {count}")
            yield item


@dataclass
class _CompilationNotice:
    """Compilations since somebody wants to know of them; one may lie inside another."""

    kernels: int = 0
    seconds: float = 0.0
    of: list[str] = field(default_factory=list)  # the files that they stand in
    _said: bool = False
    _began: list[float] = field(default_factory=list)

    def begin(self) -> None:
        if not self._said:
            note("catheter-sim: compiling numerical kernels, once after installation ...")
            self._said = True
        self._began.append(time.monotonic())

    def end(self, counts: bool, of: str) -> None:
        if not self._began:  # it began before anybody wanted to know
            return
        began = self._began.pop()
        self.kernels += counts
        if counts and of and of not in self.of:
            self.of.append(of)
        if not self._began:
            self.seconds += time.monotonic() - began


_WANTED: list[_CompilationNotice] = []  # by whom compilations are to be told; `compiled` reports them


@contextmanager
def compilations_told() -> Iterator[None]:
    """Say when a kernel is compiled for the first time, and at the end which ones were and how long it took.

    Nothing is said where all kernels are kept on disk. What ends in an error ends with the error's line.
    """
    told = _CompilationNotice()
    _WANTED.append(told)
    try:
        yield
    finally:
        _WANTED.remove(told)
    if told.kernels:
        plural = "s" if told.kernels > 1 else ""
        more = len(told.of) - _NAMED
        names = ", ".join(told.of[:_NAMED]) + (f" and {more} more" if more > 0 else "")
        what = f" ({names})" if names else ""
        note(f"catheter-sim: compiled {told.kernels} kernel{plural} in {told.seconds:.1f} s{what}")


def compilation_begins() -> None:
    """Tell whoever wants to know that a kernel is being compiled."""
    for told in _WANTED:
        told.begin()


def compilation_ends(counts: bool, of: str = "") -> None:
    """Tell them that it is done; `counts`: it was one of this package's kernels; `of`: the file it is in."""
    for told in _WANTED:
        told.end(counts, of)
