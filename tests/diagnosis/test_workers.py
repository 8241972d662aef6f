"""Claims about where fits run: the answer is the same everywhere, and nothing that was done is lost."""

from __future__ import annotations

import json
import os
import pickle
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import mujoco
import numba
import numpy as np
import pytest
from killed import always_die, die_once, square
from planted import small_data

from catheter_sim.diagnosis import workers as module
from catheter_sim.diagnosis.document import to_json
from catheter_sim.diagnosis.pipeline import diagnose_dataset
from catheter_sim.diagnosis.workers import SERIAL, OutOfTime, Workers, map_calls, packed, work_out, workers
from catheter_sim.errors import InputError

NUMBERS = [(float(number),) for number in range(5)]
SQUARES = [0.0, 1.0, 4.0, 9.0, 16.0]


@pytest.mark.slow
def test_results_come_in_order():
    """Here, and in two other processes."""
    for place in (SERIAL, Workers(2)):
        with workers(place) as pool:
            assert map_calls(pool, square, NUMBERS) == SQUARES


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_when_time_is_up_what_is_done_is_kept(jobs: int):
    """At least one call is, and none is begun after; the processes serve on."""
    kept: dict[str, float] = {"z": 0.5}
    with workers(Workers(jobs)) as pool:
        with pytest.raises(OutOfTime, match="time ran out after"):
            work_out(pool, time.monotonic(), kept, list("abcde"), square, NUMBERS)
        assert 2 <= len(kept) < 6
        assert kept.items() <= dict(zip("zabcde", [0.5, *SQUARES], strict=True)).items()
        assert map_calls(pool, square, NUMBERS[2:3], time.monotonic()) == [4.0]
        work_out(pool, time.monotonic() + 100.0, kept, list("abcde"), square, NUMBERS)
    assert list(kept.values())[-1] == 16.0
    assert len(kept) == 6


def test_what_was_finished_is_not_done_again(tmp_path):
    """Three of five results are there: two calls are made, with the same answer."""
    marks, kept = tmp_path / "marks", tmp_path / "kept"
    marks.mkdir()
    place = Workers(kept=kept)
    asked = [(float(number), marks) for number in range(5)]
    assert map_calls(place, square, asked[:3]) == SQUARES[:3]
    assert map_calls(place, square, asked) == SQUARES
    assert len(list(marks.iterdir())) == 5


def test_another_question_does_not_find_it(tmp_path, monkeypatch):
    """Another function, another argument or another source of the package: another file."""
    place = Workers(kept=tmp_path)
    map_calls(place, square, [(2.0,)])
    map_calls(place, square, [(3.0,)])
    map_calls(place, abs, [(2.0,)])
    assert len(list(tmp_path.iterdir())) == 3
    monkeypatch.setattr(module, "_source", lambda: "changed")
    map_calls(place, square, [(2.0,)])
    assert len(list(tmp_path.iterdir())) == 4


def test_half_a_file_is_no_result(tmp_path):
    """What a run left that was killed while it wrote has another name and is not read."""
    place = Workers(kept=tmp_path)
    map_calls(place, square, [(2.0,)])
    (whole,) = tmp_path.iterdir()
    whole.rename(tmp_path / f".{whole.stem}.0123456789abcdef.unfinished.npz")
    assert map_calls(place, square, [(2.0,)]) == [4.0]


class Trap:
    """What a pickle may do: it makes a folder when it is read."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda path, trap: path.write_bytes(pickle.dumps(trap)),
        lambda path, trap: np.savez(path, skeleton=np.array([trap], dtype=object)),
        lambda path, trap: path.write_bytes(path.read_bytes()[:-40]),
        lambda path, trap: path.write_bytes(b""),
        lambda path, trap: path.write_bytes(packed(5.0, "another.npz")),
        lambda path, trap: path.write_bytes(packed("four", path.name)),
        lambda path, trap: path.unlink() or path.mkdir(),
    ],
    ids=["pickle", "objects", "cut", "empty", "another's", "text", "folder"],
)
def test_a_bad_kept_file_is_said_and_made_again(tmp_path, capsys, spoil):
    """A folder of kept results from elsewhere runs nothing and ends nothing: a note, the same answer."""
    kept = tmp_path / "kept"
    map_calls(Workers(kept=kept), square, NUMBERS)
    assert capsys.readouterr().err == ""
    for path in sorted(kept.iterdir())[:3]:
        spoil(path, Trap(tmp_path / "ran"))
    assert map_calls(Workers(kept=kept), square, NUMBERS) == SQUARES
    said = capsys.readouterr().err
    assert said.count("\n") == 1, said
    assert said.startswith("note: ")
    assert str(kept) in said
    assert not (tmp_path / "ran").exists()
    if not any(path.is_dir() for path in kept.iterdir()):
        assert map_calls(Workers(kept=kept), square, NUMBERS) == SQUARES
        assert capsys.readouterr().err == ""


def test_files_of_others_among_the_kept_are_said_and_not_read(tmp_path, capsys):
    """A pickle of an earlier version, say."""
    (tmp_path / "0123.pickle").write_bytes(pickle.dumps(Trap(tmp_path / "ran")))
    with workers(Workers(kept=tmp_path)) as pool:
        assert map_calls(pool, square, NUMBERS) == SQUARES
    assert "1 of its files are no kept results and are not read, '0123.pickle'" in capsys.readouterr().err
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_where_nothing_can_be_kept_the_work_goes_on(tmp_path, capsys, jobs):
    """A file where the folder should be costs the resumption, not the answer."""
    (tmp_path / "kept").write_text("")
    with workers(Workers(jobs, kept=tmp_path / "kept")) as pool:
        assert map_calls(pool, square, NUMBERS) == SQUARES
    assert capsys.readouterr().err.startswith("note: a finished result cannot be kept: ")


PARENT = """
import sys, time
from catheter_sim.diagnosis.workers import Workers, map_calls, workers
from killed import say_and_sleep

with workers(Workers(2)) as pool:
    map_calls(pool, say_and_sleep, [(float(number), sys.argv[1]) for number in range(5)])
"""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="processes are looked for in /proc")
@pytest.mark.parametrize("name", ["SIGKILL", "SIGTERM"])
def test_a_killed_parent_leaves_no_process(tmp_path, name):
    """Busy or not, workers and their trackers end by themselves, however their parent was ended."""
    with subprocess.Popen(
        [sys.executable, "-c", PARENT, str(tmp_path)], cwd=Path(__file__).parent, start_new_session=True
    ) as parent:
        wait_for(lambda: len(list(tmp_path.iterdir())) == 2, 120.0)
        assert len(processes_of(parent.pid)) >= 3
        os.kill(parent.pid, getattr(signal, name))
    wait_for(lambda: not processes_of(parent.pid), 30.0)


def processes_of(session):
    """Return the ids of the processes of a session that run."""
    found = []
    for folder in Path("/proc").iterdir():
        with suppress(OSError):
            words = (folder / "stat").read_text().rpartition(")")[2].split()
            if words[3] == str(session) and words[0] != "Z":
                found.append(int(folder.name))
    return found


def wait_for(happened, seconds):
    """Wait until something has happened."""
    end = time.monotonic() + seconds
    while not happened():
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.mark.slow
def test_killed_process_is_replaced(tmp_path):
    """One process dies in the middle of a call: the results are as if nothing had happened."""
    with workers(Workers(2)) as pool:
        asked = [(float(number), tmp_path / "mark") for number in range(5)]
        assert map_calls(pool, die_once, asked) == SQUARES
    assert (tmp_path / "mark").exists()


@pytest.mark.slow
def test_processes_that_always_die_get_one_line():
    """The line names the number of jobs."""
    with workers(Workers(2)) as pool, pytest.raises(InputError, match=r"--jobs 2: .* killed 3 times"):
        map_calls(pool, always_die, NUMBERS)


@pytest.mark.slow
def test_no_scheduler_gets_one_line(monkeypatch):
    """Nobody listens at the address, or it is none."""
    monkeypatch.setattr(module, "_LONGEST_WAIT_S", 0.5)
    for address in ("tcp://127.0.0.1:9", "nonsense://x"):
        with pytest.raises(InputError, match="no scheduler answers"), workers(Workers(dask=address)):
            pass


@pytest.mark.slow
def test_a_cluster_that_loses_a_worker_gives_the_same_results(tmp_path):
    """Dask starts another one."""
    from distributed import LocalCluster

    asked = [(float(number), tmp_path / "mark") for number in range(5)]
    with (
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        workers(Workers(dask=cluster.scheduler_address)) as pool,
    ):
        assert map_calls(pool, die_once, asked) == SQUARES


@pytest.mark.long
def test_diagnosis_does_not_depend_on_where_it_is_made(tmp_path):
    """Here, in two processes, on a cluster, and taken up again half-way: the same JSON."""
    from distributed import LocalCluster

    data = small_data({"backlash": {"width_mm": 0.4}})

    def found(place):
        return json.dumps(to_json(diagnose_dataset(data, place, simulation=False)))

    here = found(SERIAL)
    assert json.loads(here)["verdict"] == "cause_found"
    assert found(Workers(2, kept=tmp_path)) == here
    kept = sorted(tmp_path.iterdir(), key=lambda path: path.stat().st_mtime)
    for path in kept[len(kept) // 2 :]:
        path.unlink()
    assert found(Workers(1, kept=tmp_path)) == here
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        assert found(Workers(dask=cluster.scheduler_address)) == here


@pytest.mark.parametrize("library", [numba, mujoco])
def test_results_of_another_library_are_not_taken_over(library, monkeypatch):
    """Another version of the compiler or of the engine is another question."""
    before = module._source()
    monkeypatch.setattr(library, "__version__", "0.0")
    module._source.cache_clear()
    after = module._source()
    module._source.cache_clear()
    assert after != before
