"""How a command or a call ended, within a time limit, and whether that is an end that is allowed."""

from __future__ import annotations

import io
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

from catheter_sim.cli.main import main
from catheter_sim.errors import LONGEST_MESSAGE, InputError

LIMIT_S = 10
MOST_LINES = 3


class TooLong(BaseException):
    """A case went beyond its time limit; no `except Exception` takes it for something else."""


@dataclass(frozen=True)
class End:
    """How a case ended: its exit status, what it wrote on standard error, and whether an output is empty."""

    status: int
    err: str
    undefined: bool = False

    def fault(self) -> str:
        """Return what is wrong with this end, "" for nothing."""
        if self.status not in (0, 1, 2):
            return f"exit status {self.status}"
        if self.undefined:
            return "an empty cell among the outputs"
        lines = self.err.splitlines()
        if len(lines) > MOST_LINES:
            return f"{len(lines)} lines on standard error"
        if max(map(len, lines), default=0) > LONGEST_MESSAGE + 50:
            return f"a line of {max(map(len, lines))} characters"
        for word in ("internal error", "Traceback", "Warning"):
            if word in self.err:
                return word
        return "exit 2 without a word" if self.status == 2 and not lines else ""


@contextmanager
def time_limit(seconds: int = LIMIT_S) -> Iterator[None]:
    """Raise `TooLong` in what computes longer, or takes ten times as long by the clock of a busy machine."""

    def stop(number: int, frame: FrameType | None) -> None:
        raise TooLong

    clocks = (
        (signal.SIGPROF, signal.ITIMER_PROF, seconds),
        (signal.SIGALRM, signal.ITIMER_REAL, 10 * seconds),
    )
    before = {number: signal.signal(number, stop) for number, _, _ in clocks}
    for _, timer, limit in clocks:
        signal.setitimer(timer, limit)
    try:
        yield
    finally:
        for number, timer, _ in clocks:
            signal.setitimer(timer, 0.0)
            signal.signal(number, before[number])


def end_of_command(words: list[str]) -> End:
    """Run the command line in this process; what it wrote to the file `out` must be whole."""
    out, err = io.StringIO(), io.StringIO()
    written = Path("out")
    written.unlink(missing_ok=True)
    with time_limit(), redirect_stdout(out), redirect_stderr(err):
        status = main(words)
    undefined = status == 0 and words[0] in ("statics", "simulate") and _has_gap(written.read_text())
    return End(status, err.getvalue(), undefined)


def _has_gap(text: str) -> bool:
    return any(",," in line or line.endswith(",") or "inf" in line for line in text.splitlines()[1:])


def end_of_call(call: Callable[[], object]) -> End:
    """Run a function of the library; an `InputError` is its one line and status 2."""
    try:
        with time_limit():
            call()
    except InputError as error:
        return End(2, f"{error}\n")
    return End(0, "")
