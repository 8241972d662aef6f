"""How a command or a call ended, within a time limit, and whether that is an end that is allowed."""

from __future__ import annotations

import io
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from types import FrameType

from catheter_sim.cli.main import main
from catheter_sim.errors import LONGEST_MESSAGE, InputError

LIMIT_S = 10
MOST_LINES = 3


class TooLong(BaseException):
    """A case went beyond its time limit; no `except Exception` takes it for something else."""


@dataclass(frozen=True)
class End:
    """How a case ended: its exit status and what it wrote on standard error."""

    status: int
    err: str

    def fault(self) -> str:
        """Return what is wrong with this end, "" for nothing."""
        if self.status not in (0, 1, 2):
            return f"exit status {self.status}"
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
    """Raise `TooLong` in what runs longer."""

    def stop(number: int, frame: FrameType | None) -> None:
        raise TooLong

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def end_of_command(words: list[str]) -> End:
    """Run the command line in this process."""
    out, err = io.StringIO(), io.StringIO()
    with time_limit(), redirect_stdout(out), redirect_stderr(err):
        status = main(words)
    return End(status, err.getvalue())


def end_of_call(call: Callable[[], object]) -> End:
    """Run a function of the library; an `InputError` is its one line and status 2."""
    try:
        with time_limit():
            call()
    except InputError as error:
        return End(2, f"{error}\n")
    return End(0, "")
