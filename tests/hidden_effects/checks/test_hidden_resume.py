"""The bench goes on where it was, and half a draw counts for nothing."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import hidden_effects
from catheter_sim.errors import InputError
from hidden_effects import first_bench, running
from hidden_effects.first_draws import CannotMake
from hidden_effects.running import ANSWER, Folders, read_json, write_json


class Steps:
    """Stands in for what is slow, and counts how often each is done."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.made = self.diagnosed = self.scored = 0
        self.killed_in = ""
        monkeypatch.setattr(first_bench, "make", self.make)
        monkeypatch.setattr(first_bench, "write_draw", self.write)
        monkeypatch.setattr(first_bench, "score", self.score)

    def make(self, seed, index, robots):
        self.made += 1
        return seed, index

    def write(self, made, folders: Folders) -> None:
        folders.data.mkdir(parents=True, exist_ok=True)
        (folders.data / "dataset.toml").write_text("")
        self._killed("data")
        write_json({"seed": made[0]}, folders.answer / ANSWER)

    def diagnose(self, dataset: Path, output: Path, limit_s: float) -> str:
        self.diagnosed += 1
        assert (dataset / "dataset.toml").is_file()
        assert not list(dataset.parent.rglob(ANSWER))
        output.mkdir()
        (output / "diagnosis.json").write_text("{}")
        self._killed("diagnosis")
        return ""

    def score(self, folders: Folders, run) -> dict:
        self.scored += 1
        self._killed("score")
        return {"index": folders.index, "right": True, "seconds": run["seconds"]}

    def _killed(self, where: str) -> None:
        if self.killed_in == where:
            raise KeyboardInterrupt

    def run(self, root: Path) -> dict:
        return first_bench.run_draw(1, 3, root, diagnose=self.diagnose)

    @property
    def counts(self) -> tuple[int, int, int]:
        return self.made, self.diagnosed, self.scored


@pytest.fixture
def steps(monkeypatch) -> Steps:
    return Steps(monkeypatch)


def test_scored_draw_is_not_run_again(steps, tmp_path):
    """A second run reads the score of the first."""
    first = steps.run(tmp_path)
    assert steps.run(tmp_path) == first
    assert steps.counts == (1, 1, 1)


def test_a_draw_of_other_code_is_made_again(steps, tmp_path, monkeypatch):
    """Whole, from its data on; also where that code was stopped on its way."""
    steps.run(tmp_path)
    monkeypatch.setattr(first_bench, "judging_code", lambda: "other")
    assert steps.run(tmp_path)["code"] == "other"
    assert steps.counts == (2, 2, 2)
    steps.killed_in = "score"
    monkeypatch.setattr(first_bench, "judging_code", lambda: "third")
    with pytest.raises(KeyboardInterrupt):
        steps.run(tmp_path)
    steps.killed_in = ""
    monkeypatch.setattr(first_bench, "judging_code", lambda: "fourth")
    steps.run(tmp_path)
    assert steps.counts == (4, 4, 4)


def threads() -> dict[str, str | None]:
    return {name: os.environ.get(name) for name in running._THREADS}


def threads_of_draw(index: int) -> dict[str, str | None]:
    return threads()


@pytest.mark.slow
def test_workers_alone_are_told_to_use_one_thread(monkeypatch):
    """What the environment says of its own stays, there and here."""
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "3")
    before, told = threads(), []
    (found,) = running.run_all(threads_of_draw, [(0,)], 2, told.append)
    assert found == {"OPENBLAS_NUM_THREADS": "3", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    assert threads() == before


@pytest.mark.parametrize(
    ("killed_in", "counts"), [("data", (2, 1, 1)), ("diagnosis", (1, 2, 1)), ("score", (1, 1, 2))]
)
def test_killed_draw_leaves_nothing_that_counts(steps, tmp_path, killed_in, counts):
    """Killed anywhere, a draw has no score; the next run does again what was not whole, and no more."""
    steps.killed_in = killed_in
    with pytest.raises(KeyboardInterrupt):
        steps.run(tmp_path)
    assert read_json(Folders(tmp_path, 3).score) is None
    steps.killed_in = ""
    assert steps.run(tmp_path)["right"]
    assert steps.counts == counts


def test_half_a_score_is_none(steps, tmp_path):
    """A score file that ends in its middle is made again."""
    steps.run(tmp_path)
    path = Folders(tmp_path, 3).score
    path.write_text(path.read_text()[:20])
    assert steps.run(tmp_path)["index"] == 3
    assert steps.scored == 2
    assert json.loads(path.read_text())["index"] == 3


def test_draw_that_cannot_be_made_is_said_and_missed(steps, tmp_path, monkeypatch):
    """A draw without data is written down with the reason, and does not count as right."""

    def refuse(seed, index, robots):
        raise CannotMake("no size fits")

    monkeypatch.setattr(first_bench, "make", refuse)
    found = steps.run(tmp_path)
    assert (found["verdict"], found["failure"], found["right"]) == ("not made", "no size fits", False)


def test_folder_of_another_seed_is_refused(tmp_path):
    """Draws of two seeds do not mix in one folder."""
    first_bench.run_bench(1, 0, tmp_path)
    first_bench.run_bench(1, 0, tmp_path)
    with pytest.raises(InputError, match="another folder"):
        first_bench.run_bench(2, 0, tmp_path)


def test_diagnosis_out_of_time_is_a_failure(tmp_path):
    """A diagnosis that takes longer than allowed is ended, and said to have been."""
    assert "out of time" in running.diagnose_elsewhere(tmp_path, tmp_path / "out", 0.05)


@pytest.mark.parametrize("status", [-signal.SIGTERM, 128 + signal.SIGTERM])
def test_diagnosis_that_somebody_ended_is_none(tmp_path, monkeypatch, status):
    """Whether the signal ended it or it ended itself at a signal: that is no answer, and is asked again."""
    ended = subprocess.CompletedProcess([], status, "", "catheter-sim: error: stopped by SIGTERM\n")
    monkeypatch.setattr(running.subprocess, "run", lambda *_, **__: ended)
    with pytest.raises(InterruptedError, match="ended by signal 15"):
        running.diagnose_elsewhere(tmp_path, tmp_path / "out", 60.0)


@pytest.mark.slow
def test_bad_data_set_is_a_failure(tmp_path):
    """What the command line refuses is a failure with its line."""
    assert "dataset.toml" in running.diagnose_elsewhere(tmp_path, tmp_path / "out", 60.0)


TESTS = str(Path(hidden_effects.__file__).parents[1])
POOL = f"""
import os, sys, time
sys.path.insert(0, {TESTS!r})
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from hidden_effects.running import end_with_parent

if __name__ == "__main__":
    with ProcessPoolExecutor(1, get_context("spawn"), end_with_parent) as pool:
        print(pool.submit(os.getpid).result(), flush=True)
        pool.submit(time.sleep, 600)
        time.sleep(600)
"""


def alive(process: int) -> bool:
    """Return whether a process runs; one that has ended and was not asked for how does not."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.slow
def test_killed_bench_leaves_no_worker(tmp_path):
    """A worker ends by itself when the process that started it is gone, whatever it is doing."""
    script = tmp_path / "pool.py"
    script.write_text(POOL)
    with subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, text=True) as started:
        worker = int(started.stdout.readline())
        assert alive(worker)
        started.kill()
    for _ in range(100):
        if not alive(worker):
            return
        time.sleep(0.1)
    os.kill(worker, signal.SIGKILL)
    pytest.fail("the worker lives")
