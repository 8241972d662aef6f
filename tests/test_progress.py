"""What long work says on standard error, and that compilations announce themselves."""

from __future__ import annotations

import io
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from catheter_sim.cli.main import VERBS, main
from catheter_sim.errors import InputError
from catheter_sim.mechanics.compiled import compiled
from catheter_sim.progress import (
    Stages,
    compilation_begins,
    compilation_ends,
    compilations_told,
    counted,
    note,
)

COMPILING = "catheter-sim: compiling numerical kernels, once after installation ..."
COMPILED = r"catheter-sim: compiled 1 kernel in \d+\.\d s"


class Terminal(io.StringIO):
    """Standard error of a terminal."""

    def isatty(self) -> bool:
        return True


def test_a_stage_is_a_line_with_the_time_where_there_is_no_terminal(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Written when the stage begins; nothing at the end, and nothing on standard output."""
    with Stages("diagnose", True) as stages:
        stages.say("calibrating")
        assert re.fullmatch(r"diagnose: calibrating \(0\.\d s\)\n", capsys.readouterr().err)
        stages.say("choosing causes")
    told = capsys.readouterr()
    assert re.fullmatch(r"diagnose: choosing causes \(\d+\.\d s\)\n", told.err)
    assert told.out == ""


def test_a_stage_says_how_much_time_there_is(capsys: pytest.CaptureFixture[str]) -> None:
    """Of a budget; without an end none is said."""
    with Stages("diagnose", True, budget_s=300.0) as stages:
        stages.say("calibrating")
    assert re.fullmatch(r"diagnose: calibrating \(\d+\.\d of 300 s\)\n", capsys.readouterr().err)


def test_a_library_that_was_not_asked_says_nothing(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither off a terminal nor on one."""
    for terminal in (None, Terminal()):
        if terminal:
            monkeypatch.setattr(sys, "stderr", terminal)
        with Stages("diagnose", False) as stages:
            stages.say("calibrating")
        assert list(counted("abc", 3, "simulating", "row", False, every_s=0.0)) == ["a", "b", "c"]
        assert capsys.readouterr().err == ""
        assert not terminal or terminal.getvalue() == ""


def test_quick_work_that_is_counted_says_nothing_and_long_work_now_and_then(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """No line within the first ten seconds; with no time between lines, one for each."""
    assert list(counted("abc", 3, "simulating", "row", True)) == ["a", "b", "c"]
    assert capsys.readouterr().err == ""
    assert list(counted("ab", 2, "simulating", "row", True, every_s=0.0)) == ["a", "b"]
    lines = capsys.readouterr().err.splitlines()
    assert [re.sub(r"\(0\.\d s\)", "(t)", line) for line in lines] == [
        "simulating: row 1 of 2 (t)",
        "simulating: row 2 of 2 (t)",
    ]


def test_on_a_terminal_there_is_a_bar_that_is_gone_at_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stage and clock in one line that is wiped out; a note stands in a line of its own."""
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with Stages("diagnose", True) as stages:
        stages.say("choosing causes")
        note("a note")
    assert "choosing causes:  (00:00)" in terminal.getvalue()
    assert terminal.getvalue().count("\n") == 1
    assert "a note\n" in terminal.getvalue()
    assert terminal.getvalue().endswith("\r")
    assert list(counted("abc", 3, "simulating", "row", True)) == ["a", "b", "c"]
    assert "0/3 [00:00" in terminal.getvalue()


def test_closed_standard_error_does_not_stop_the_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor does one that is missing."""
    closed = io.StringIO()
    closed.close()
    for stream in (closed, None):
        monkeypatch.setattr(sys, "stderr", stream)
        with Stages("diagnose", True) as stages:
            stages.say("calibrating")
        assert list(counted("ab", 2, "simulating", "row", True, every_s=0.0)) == ["a", "b"]


def new_kernel() -> Any:
    """Return a kernel that is on no disk."""
    names: dict[str, Callable[..., Any]] = {}
    exec("def twice(x):\n    return 2.0 * x", names)
    return compiled(names["twice"])


def pretend_to_compile() -> None:
    """Tell of two compilations, one inside the other; the inner one is no kernel of this package."""
    compilation_begins()
    compilation_begins()
    compilation_ends(False)
    compilation_ends(True)


@pytest.mark.slow
def test_a_compilation_announces_itself_once_and_says_how_long_it_took(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Before the first one and at the end; a call of what is compiled says nothing, nor does a library."""
    kernel = new_kernel()
    with compilations_told():
        assert kernel(2.0) == 4.0
        assert capsys.readouterr().err == f"{COMPILING}\n"
    assert re.fullmatch(COMPILED + "\n", capsys.readouterr().err)
    with compilations_told():
        assert kernel(3.0) == 6.0
    new_kernel()(1.0)
    assert capsys.readouterr().err == ""


def test_what_was_compiled_is_named_by_its_files(capsys: pytest.CaptureFixture[str]) -> None:
    """Each file once, the first six by name."""
    with compilations_told():
        for name in ("spans", "spans", "turns", "", "a", "b", "c", "d", "e"):
            compilation_begins()
            compilation_ends(bool(name), name)
    line = capsys.readouterr().err.splitlines()[1]
    assert re.fullmatch(
        r"catheter-sim: compiled 8 kernels in 0\.0 s \(spans, turns, a, b, c, d and 1 more\)", line
    )


@pytest.mark.slow
def test_a_kernel_that_is_kept_on_disk_is_not_announced(tmp_path: Path) -> None:
    """The second program to use it finds it there."""
    tmp_path.joinpath("kernel_on_disk.py").write_text(
        "from catheter_sim.mechanics.compiled import compiled\n\n\n"
        "@compiled\ndef twice(x):\n    return 2.0 * x\n"
    )
    program = (
        "from catheter_sim.progress import compilations_told\n"
        "from kernel_on_disk import twice\n"
        "with compilations_told():\n    assert twice(2.0) == 4.0\n"
    )
    said = [
        subprocess.run(
            [sys.executable, "-c", program],
            check=True,
            capture_output=True,
            text=True,
            env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "kept"), "PYTHONPATH": str(tmp_path)},
        ).stderr
        for _ in range(2)
    ]
    assert said[0].startswith(COMPILING)
    assert said[1] == ""


def test_the_command_line_announces_compilations_and_an_error_stays_the_last_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Any verb's; standard output stays as it is."""

    def compile_and_print(_: Any) -> int:
        pretend_to_compile()
        print("done")
        return 0

    def compile_and_fail(_: Any) -> int:
        pretend_to_compile()
        raise InputError("in.csv: line 3: no number")

    monkeypatch.setattr(VERBS["list"], "run", compile_and_print)
    assert main(["list"]) == 0
    told = capsys.readouterr()
    assert told.out == "done\n"
    assert re.fullmatch(f"{re.escape(COMPILING)}\n{COMPILED}\n", told.err)
    monkeypatch.setattr(VERBS["list"], "run", compile_and_fail)
    assert main(["list"]) == 2
    assert capsys.readouterr().err == f"{COMPILING}\ncatheter-sim: error: in.csv: line 3: no number\n"
    pretend_to_compile()  # nobody wants to know any more
    assert capsys.readouterr().err == ""
