"""What a command of the tests left: its exit status and both its outputs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Ran:
    """What a command left: its exit status and both its outputs."""

    status: int
    out: str
    err: str

    def error(self) -> str:
        """Return the error's text, having made sure that it is one line, exit 2, and the user's fault."""
        assert self.status == 2, (self.status, self.out, self.err)
        assert self.err.startswith("catheter-sim: error: ")
        assert self.err.endswith("\n")
        assert self.err.count("\n") == 1, self.err
        assert "internal error" not in self.err
        assert "Traceback" not in self.err
        assert self.out == ""
        return self.err.removeprefix("catheter-sim: error: ").rstrip("\n")


Run = Callable[..., Ran]
