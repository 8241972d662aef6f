"""A system that lacks what Linux has does the same, and takes away no file of another process."""

from __future__ import annotations

import errno
import multiprocessing
import os
import platform
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from catheter_sim import platforms
from catheter_sim.errors import InputError
from catheter_sim.files import placed_when_whole, remove_abandoned, unwound_by_signals
from catheter_sim.tables import replaced_when_whole

# A program on a system without POSIX's modules and signals, as far as Python can be made to believe it.
BARE = """
import os, signal, sys
for name in ("fcntl", "resource", "termios", "pwd", "grp"):
    sys.modules[name] = None
for home, name in ((signal, "SIGHUP"), (signal, "alarm"), (os, "sched_getaffinity"), (os, "O_NOFOLLOW")):
    if hasattr(home, name):
        delattr(home, name)
from catheter_sim.cli.main import main
command = []
for word in [*sys.argv[1:], "then"]:
    if word != "then":
        command.append(word)
        continue
    if status := main(command):
        sys.exit(status)
    command = []
"""
HALF = ".out.0123456789abcdef.unfinished.csv"


def run_bare(folder: Path, *words: str) -> None:
    """Run commands, "then" between them, in a process without POSIX's modules and signals."""
    done = subprocess.run(
        [sys.executable, "-c", BARE, *words], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_simulate_and_statics_need_no_posix(tmp_path: Path) -> None:
    """The commands write what they write elsewhere."""
    (tmp_path / "in.csv").write_text("time_s,tension_right_N\n0,0\n1,0.2\n")
    same = ("neuroendoscope_section", "--inputs", "in.csv", "-o")
    statics = ("statics", "--model", "fkm_sliding", *same, "b.csv")
    run_bare(tmp_path, "simulate", *same, "a.csv", "then", *statics)
    for verb, name in (("simulate", "a.csv"), ("statics", "b.csv")):
        more = ("--model", "fkm_sliding") if verb == "statics" else ()
        own = [sys.executable, "-m", "catheter_sim", verb, *more, *same, f"own_{name}"]
        subprocess.run(own, cwd=tmp_path, check=True, capture_output=True)
        assert (tmp_path / name).read_text() == (tmp_path / f"own_{name}").read_text()
    assert len(os.listdir(tmp_path)) == 5


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_diagnose_needs_no_posix(tmp_path: Path, jobs: str) -> None:
    """In one process and in several."""
    files = [f"worn_catheter/take_{index}.csv" for index in (1, 2, 3)]
    start = ("import", *files, "--robot", "mitral_transseptal", "--spool-radius", "10", "-o", "data")
    last = ("diagnose", "data", "--jobs", jobs, "-o", "report")
    run_bare(tmp_path, "example", "worn_catheter", "then", *start, "then", *last)
    assert '"verdict": "cause_found"' in (tmp_path / "report" / "diagnosis.json").read_text()


@pytest.fixture
def windows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a file that is open be neither renamed nor removed, and let there be no other lock."""
    if not Path("/proc/self/fd").is_dir():
        pytest.skip("which files are open is not known here")

    def is_open(path: str | os.PathLike[str]) -> bool:
        return os.path.realpath(path) in {
            os.path.realpath(f"/proc/self/fd/{number}") for number in os.listdir("/proc/self/fd")
        }

    def refusing(call, path, *others):
        if is_open(path):
            raise PermissionError(errno.EACCES, "used by another process", os.fspath(path))
        return call(path, *others)

    unlink, replace = os.unlink, os.replace
    monkeypatch.setattr(os, "unlink", lambda path: refusing(unlink, path))
    monkeypatch.setattr(os, "replace", lambda path, target: refusing(replace, path, target))
    monkeypatch.setattr(Path, "unlink", lambda path: refusing(unlink, path))
    monkeypatch.setattr(platforms, "fcntl", None)
    monkeypatch.setattr(platforms, "WINDOWS", True)


@pytest.mark.usefixtures("windows")
def test_where_open_files_stay_a_file_still_appears_whole_or_not_at_all(tmp_path: Path) -> None:
    """It is let go before it is renamed or removed."""
    with replaced_when_whole(tmp_path / "out.csv") as file:
        file.write("whole")

    def broken_off() -> None:
        with replaced_when_whole(tmp_path / "out.csv") as file:
            file.write("half")
            raise InputError("no more")

    with pytest.raises(InputError, match="no more"):
        broken_off()
    assert os.listdir(tmp_path) == ["out.csv"]
    assert (tmp_path / "out.csv").read_text() == "whole"


@pytest.mark.usefixtures("windows")
def test_where_open_files_stay_only_what_nobody_holds_is_removed(tmp_path: Path) -> None:
    """A file that is being written stays however old it is, and one that is young: it may be on its way."""
    with placed_when_whole(tmp_path / "held.csv") as held:
        left, young = tmp_path / HALF, tmp_path / HALF.replace("out", "young")
        for path in (left, young):
            path.write_text("half")
        for path in (left, held):
            os.utime(path, (0.0, time.time() - 3600.0))
        remove_abandoned(tmp_path)
        assert sorted(os.listdir(tmp_path)) == sorted([held.name, young.name])
    assert sorted(os.listdir(tmp_path)) == sorted(["held.csv", young.name])


def test_without_any_lock_nothing_is_taken_for_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A system that holds no file at all: files are written, and halves are left alone."""
    monkeypatch.setattr(platforms, "fcntl", None)
    monkeypatch.setattr(platforms, "WINDOWS", False)
    (tmp_path / HALF).write_text("half")
    os.utime(tmp_path / HALF, (0.0, 0.0))
    with replaced_when_whole(tmp_path / "out.csv") as file:
        file.write("whole")
    assert sorted(os.listdir(tmp_path)) == sorted([HALF, "out.csv"])


def test_a_signal_that_the_system_lacks_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """No SIGHUP and no alarm: Ctrl-C still unwinds."""
    monkeypatch.delattr(signal, "SIGHUP", raising=False)
    monkeypatch.delattr(signal, "alarm", raising=False)
    assert platforms.ending_signals()[:2] == [signal.SIGINT, signal.SIGTERM]

    def stopped() -> None:
        with unwound_by_signals():
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt, match="interrupted"):
        stopped()


def test_where_an_orphan_keeps_its_parents_id_the_parents_handle_is_waited_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As on Windows, where `os.getppid` tells nothing."""
    ended = threading.Event()

    class Parent:
        def join(self) -> None:
            ended.wait()

    monkeypatch.setattr(platforms, "WINDOWS", True)
    monkeypatch.setattr(multiprocessing, "parent_process", Parent)
    waiting = threading.Thread(target=platforms.wait_for_parents_end, args=(os.getppid(),), daemon=True)
    waiting.start()
    waiting.join(0.1)
    assert waiting.is_alive()
    ended.set()
    waiting.join(10.0)
    assert not waiting.is_alive()


@pytest.mark.parametrize(
    ("system", "backend", "needed"),
    [("Linux", "egl", "libegl1"), ("Darwin", "cgl", "macOS"), ("Windows", "", "a graphics driver")],
)
def test_each_system_has_its_backend(
    system: str, backend: str, needed: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is what draws, and one line says what is needed where it is missing."""
    monkeypatch.setattr(platform, "system", lambda: system)
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    assert platforms.offscreen_backend() == backend
    said = str(platforms.no_context(RuntimeError("no display")))
    assert said.startswith("cannot draw: ")
    assert needed in said
    monkeypatch.setenv("MUJOCO_GL", "glfw")
    said = str(platforms.no_context(RuntimeError("no display")))
    assert said.startswith("cannot draw with MUJOCO_GL=glfw")
    assert ("(unset, it means" in said) == bool(backend)


def test_processors_are_counted_where_a_process_is_bound_to_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """All of the machine's where the system does not say which ones are ours."""
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    assert platforms.processors() == os.cpu_count()
