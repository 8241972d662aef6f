"""What a command of the tests left: its exit status and both its outputs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

COMPILING = "catheter-sim: compiling numerical kernels, once after installation ...\n"


@dataclass(frozen=True)
class Ran:
    """What a command left: its exit status and both its outputs."""

    status: int
    out: str
    err: str

    def error(self) -> str:
        """Return the error's text, having made sure that it is one line, exit 2, and the user's fault.

        Kernels that were on no disk yet announce their compilation before it.
        """
        assert self.status == 2, (self.status, self.out, self.err)
        err = self.err.removeprefix(COMPILING)
        assert err.startswith("catheter-sim: error: ")
        assert err.endswith("\n")
        assert err.count("\n") == 1, err
        assert "internal error" not in err
        assert "Traceback" not in err
        assert self.out == ""
        return err.removeprefix("catheter-sim: error: ").rstrip("\n")


Run = Callable[..., Ran]
