"""Signals that ask the program to end: it takes away what it began, and says so by its exit status."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from catheter_sim.cli.main import VERBS, main
from catheter_sim.errors import InputError
from catheter_sim.files import Stopped, unwound_by_signals

NUMBERS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


@pytest.mark.parametrize("number", NUMBERS)
def test_a_signal_unwinds_the_verb(
    number: signal.Signals, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """What is under way is left through its `finally`; asked twice, it is still left in order."""
    left = []

    def stopped(_: object) -> int:
        try:
            signal.raise_signal(number)
        finally:
            for again in NUMBERS:
                signal.raise_signal(again)
            left.append("in order")
        return 0

    before = [signal.getsignal(item) for item in NUMBERS]
    monkeypatch.setattr(VERBS["list"], "run", stopped)
    assert main(["list"]) == 128 + number
    assert left == ["in order"]
    word = "interrupted" if number == signal.SIGINT else f"stopped by {number.name}"
    assert capsys.readouterr().err == f"catheter-sim: error: {word}\n"
    assert [signal.getsignal(item) for item in NUMBERS] == before


@pytest.mark.parametrize("error", [ValueError("Invalid bounding box"), InputError("no such picture")])
def test_a_signal_that_compiled_code_made_an_error_of_its_own_is_no_error(
    error: Exception, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """matplotlib's converters make a `ValueError` of whatever is raised while they read a box."""

    def drawn(_: object) -> int:
        with suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
        raise error

    monkeypatch.setattr(VERBS["list"], "run", drawn)
    assert main(["list"]) == 128 + signal.SIGTERM
    assert capsys.readouterr().err == "catheter-sim: error: stopped by SIGTERM\n"


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="no such signal here")
def test_a_signal_that_was_ignored_stays_ignored() -> None:
    """`nohup catheter-sim …` goes on when the terminal is closed."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with unwound_by_signals():
            signal.raise_signal(signal.SIGHUP)
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


@pytest.mark.skipif(not hasattr(signal, "alarm"), reason="no such watch here")
def test_clean_up_that_hangs_is_ended_by_the_system() -> None:
    """A watch is set while things are taken away, and taken back afterwards."""

    def stopped() -> None:
        with unwound_by_signals():
            try:
                signal.raise_signal(signal.SIGTERM)
            finally:
                assert 0 < signal.getitimer(signal.ITIMER_REAL)[0] <= 30

    with pytest.raises(Stopped):
        stopped()
    assert signal.getitimer(signal.ITIMER_REAL)[0] == 0


def processes_of(session: int, folder: Path) -> list[str]:
    """Return the commands that run in a session, or that name a folder."""
    found = []
    for process in Path("/proc").iterdir():
        with suppress(OSError):
            words = (process / "stat").read_text().rpartition(")")[2].split()
            command = (process / "cmdline").read_text()
            if words[0] != "Z" and (words[3] == str(session) or str(folder) in command):
                found.append(command)
    return found


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="processes are looked for in /proc")
@pytest.mark.parametrize("number", [*NUMBERS, getattr(signal, "SIGKILL", None)])
def test_a_stopped_render_leaves_nothing(number: signal.Signals, tmp_path: Path) -> None:
    """No half video, no temporary file, no process; what SIGKILL leaves, the next run takes away."""
    rows = "".join(f"{row},{0.3 * (row % 2)}\n" for row in range(9))
    (tmp_path / "in.csv").write_text(f"time_s,tension_right_N\n{rows}")
    (tmp_path / "out.mp4").write_bytes(b"old")
    words = ["render", "neuroendoscope_section", "--inputs", "in.csv", "-o", "out.mp4"]
    words += ["--width", "160", "--height", "120"]
    with subprocess.Popen(
        [sys.executable, "-m", "catheter_sim", *words],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as program:
        end = time.monotonic() + 240
        while not any(path.stat().st_size for path in tmp_path.glob(".out.*.unfinished.mp4")):
            assert time.monotonic() < end
            assert program.poll() is None
            time.sleep(0.02)
        os.kill(program.pid, number)
        said = program.communicate()[1]
    killed = number == signal.SIGKILL
    assert program.returncode == (-number if killed else 128 + number), said
    lines = [line for line in said.splitlines() if not line.startswith("drawing: ")]  # how far it was
    assert len(lines) == (0 if killed else 1), said
    end = time.monotonic() + 30
    while processes_of(program.pid, tmp_path):
        assert time.monotonic() < end, processes_of(program.pid, tmp_path)
        time.sleep(0.05)
    if killed:
        assert len(os.listdir(tmp_path)) == 3
        picture = ["render", "neuroendoscope_section", "--inputs", "in.csv", "-o", "out.png"]
        subprocess.run([sys.executable, "-m", "catheter_sim", *picture], cwd=tmp_path, check=True)
        (tmp_path / "out.png").unlink()
    assert sorted(os.listdir(tmp_path)) == ["in.csv", "out.mp4"]
    assert (tmp_path / "out.mp4").read_bytes() == b"old"
