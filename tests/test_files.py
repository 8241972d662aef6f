"""Files written whole or not at all: what a killed process left goes, what others write or own stays."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from catheter_sim.errors import InputError
from catheter_sim.files import placed_when_whole, remove_abandoned
from catheter_sim.tables import replaced_when_whole

BEGUN = """
import os, signal, sys
from catheter_sim.tables import replaced_when_whole

with replaced_when_whole(sys.argv[1]) as file:
    file.write("half")
    file.flush()
    print("begun", flush=True)
    if sys.stdin.readline() == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    file.write(" and half")
"""


@pytest.fixture
def writer(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """Give another process that has begun to write `out.csv`."""
    with subprocess.Popen(
        [sys.executable, "-c", BEGUN, str(tmp_path / "out.csv")],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "begun\n"
        yield process
        process.kill()


@contextmanager
def room(size: int) -> Iterator[None]:
    """Let no file of this process and of those that it starts grow beyond `size` bytes."""
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.slow
def test_what_a_killed_process_left_goes_with_the_next_writing(
    tmp_path: Path, writer: subprocess.Popen[str]
) -> None:
    """Half a file stays under a name of its own; whoever writes into the folder next removes it."""
    (tmp_path / "out.csv").write_text("old")
    writer.communicate("die")
    assert writer.returncode == -signal.SIGKILL
    (half,) = set(os.listdir(tmp_path)) - {"out.csv"}
    assert half.startswith(".out.")
    assert (tmp_path / "out.csv").read_text() == "old"
    with replaced_when_whole(tmp_path / "other.csv") as file:
        file.write("x")
    assert sorted(os.listdir(tmp_path)) == ["other.csv", "out.csv"]


@pytest.mark.slow
def test_what_another_process_is_writing_stays(tmp_path: Path, writer: subprocess.Popen[str]) -> None:
    """Two processes write into one folder, even the same file: neither takes the other's half away."""
    with replaced_when_whole(tmp_path / "out.csv") as file:
        file.write("mine")
    assert len(os.listdir(tmp_path)) == 2
    writer.communicate("go on")
    assert writer.returncode == 0
    assert os.listdir(tmp_path) == ["out.csv"]
    assert (tmp_path / "out.csv").read_text() == "half and half"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with a name here")
def test_only_files_of_ours_are_removed(tmp_path: Path) -> None:
    """Of hidden files those alone go that bear our mark; links, folders and pipes stay."""
    stay = [
        ".out.csv",
        ".out.unfinished.csv",
        ".out.0123456789abcdef.csv",
        "out.0123456789abcdef.unfinished.csv",
    ]
    for name in [*stay, ".out.0123456789abcdef.unfinished.csv", ".x.ffffffffffffffff.unfinished"]:
        (tmp_path / name).write_text("")
    (tmp_path / ".link.0123456789abcdef.unfinished.csv").symlink_to(".out.csv")
    (tmp_path / ".folder.0123456789abcdef.unfinished").mkdir()
    os.mkfifo(tmp_path / ".pipe.0123456789abcdef.unfinished")
    remove_abandoned(tmp_path)
    stay += [
        ".folder.0123456789abcdef.unfinished",
        ".link.0123456789abcdef.unfinished.csv",
        ".pipe.0123456789abcdef.unfinished",
    ]
    assert sorted(os.listdir(tmp_path)) == sorted(stay)


def test_no_room_is_one_line_that_names_the_file(tmp_path: Path) -> None:
    """The old file stays as it was, and nothing beside it."""
    (tmp_path / "out.csv").write_text("old")
    with (
        pytest.raises(InputError, match=r"out\.csv: cannot be written: File too large"),
        room(1000),
        replaced_when_whole(tmp_path / "out.csv") as file,
    ):
        file.write("x" * 100_000)
    assert os.listdir(tmp_path) == ["out.csv"]
    assert (tmp_path / "out.csv").read_text() == "old"


def test_a_long_name_can_be_written(tmp_path: Path) -> None:
    """A name as long as the system allows leaves no room for a longer one beside it."""
    path = tmp_path / ("x" * 251 + ".csv")
    with replaced_when_whole(path) as file:
        file.write("x")
    assert os.listdir(tmp_path) == [path.name]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with a name here")
def test_a_pipe_gets_the_finished_file(tmp_path: Path) -> None:
    """What is no regular file is not replaced by one, also where the writer needs a file to seek in."""
    pipe = tmp_path / "pipe.mp4"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        with placed_when_whole(pipe) as place:
            place.write_bytes(b"whole")
            assert place.suffix == ".mp4"
        assert os.read(reader, 100) == b"whole"
    finally:
        os.close(reader)
    assert pipe.is_fifo()
