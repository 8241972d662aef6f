"""Diagnoses in another process, on a copy of the data set that lies apart; and runs many draws at a time."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from pathlib import Path
from threading import Thread
from typing import Any

from catheter_sim.blind_bench.places import Folders

_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")

# (folder of the data set, folder to write, most seconds) -> why it failed, "" if it did not
Diagnose = Callable[[Path, Path, float], str]


def diagnose_elsewhere(dataset: Path, output: Path, limit_s: float) -> str:
    """Diagnose in another process, which is given the data set's folder and the output folder, no more.

    After a third of the time the search for causes ends with the best so far (`--budget`), as whoever has so
    much time would ask.

    Raises:
        InterruptedError: the process was ended from outside.
    """
    verb = ("diagnose", str(dataset), "-o", str(output), "--budget", f"{limit_s / 3.0:g}")
    return elsewhere(verb, dataset, limit_s)


def elsewhere(verb: Sequence[str], folder: Path, limit_s: float) -> str:
    """Run a verb of the command line in another process; return why it failed, "" if it did not.

    Args:
        verb: its name and arguments.
        folder: to run in, of the data set.
        limit_s: seconds after which it is ended.

    Raises:
        InterruptedError: the process was ended from outside.
    """
    command = [sys.executable, "-m", "catheter_sim", *verb]
    environment = os.environ | dict.fromkeys(_THREADS, "1")
    try:
        done = subprocess.run(
            command,
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=limit_s,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"out of time, {limit_s:g} s"
    # Somebody ended it, which it says with 128 + n where it could: that tells nothing about the diagnosis.
    number = -done.returncode if done.returncode < 0 else done.returncode - 128
    if number > 0:
        raise InterruptedError(f"{folder.name}: the diagnosis was ended by signal {number}")
    lines = done.stderr.strip().splitlines()
    return "" if done.returncode == 0 else f"exit status {done.returncode}: {lines[-1] if lines else ''}"


def diagnosed(folders: Folders, limit_s: float, diagnose: Diagnose) -> dict[str, Any]:
    """Diagnose a copy of the data set that lies apart from everything else; keep what was written."""
    with tempfile.TemporaryDirectory() as place:
        dataset, output = Path(place) / "dataset", Path(place) / "diagnosis"
        shutil.copytree(folders.data, dataset)
        start = time.monotonic()
        failure = diagnose(dataset, output, limit_s)
        seconds = time.monotonic() - start
        for name in ("diagnosis.json", "robot.toml", "report.html"):
            if (output / name).is_file():
                shutil.copy(output / name, folders.found / name)
    return {"seconds": seconds, "failure": failure}


def run_all(
    one: Callable[..., dict[str, Any]],
    arguments: Sequence[tuple[Any, ...]],
    jobs: int,
    on_score: Callable[[dict[str, Any]], None],
) -> list[dict[str, Any]]:
    """Return `one` of each set of arguments, in order, `jobs` at a time; told one by one as they are done."""
    if jobs == 1:
        scores = []
        for item in arguments:
            scores.append(one(*item))
            on_score(scores[-1])
        return scores
    with _few_threads(), ProcessPoolExecutor(jobs, get_context("spawn"), end_with_parent) as pool:
        futures = [pool.submit(one, *item) for item in arguments]
        for future in as_completed(futures):
            if future.exception() is None:  # a fault of one draw is raised when the others are done
                on_score(future.result())
        return [future.result() for future in futures]


@contextmanager
def _few_threads() -> Iterator[None]:
    """Let processes that start in the meantime use one thread each, unless the environment says how many.

    Their libraries read it as they start: threads would only stand in one another's way.
    """
    added = [name for name in _THREADS if name not in os.environ]
    os.environ.update(dict.fromkeys(added, "1"))
    try:
        yield
    finally:
        for name in added:
            os.environ.pop(name, None)


def end_with_parent() -> None:
    """Let this process end when the one that started it was killed: its work would go on unheard."""
    parent = parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    Thread(target=watch, daemon=True).start()
