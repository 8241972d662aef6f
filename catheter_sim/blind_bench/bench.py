"""Runs the bench: draw, hide, diagnose in another process, score; resumable draw by draw."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context, parent_process
from pathlib import Path
from threading import Thread
from typing import Any

from catheter_sim.blind_bench.draw import robot_of, story_of
from catheter_sim.blind_bench.folders import ANSWER, Folders, read_json, write_draw, write_json
from catheter_sim.blind_bench.make import make
from catheter_sim.blind_bench.makers import CannotMake
from catheter_sim.blind_bench.robots import BENCH_ROBOTS
from catheter_sim.blind_bench.score import score
from catheter_sim.blind_bench.table import NOT_MADE
from catheter_sim.errors import InputError

RUN = "run.json"
SETTINGS = "bench.json"
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")

# (folder of the data set, folder to write, most seconds) -> why it failed, "" if it did not
Diagnose = Callable[[Path, Path, float], str]


def diagnose_elsewhere(dataset: Path, output: Path, limit_s: float) -> str:
    """Diagnose in another process, which is given the data set's folder and the output folder, no more.

    Raises:
        InterruptedError: the process was ended from outside.
    """
    command = [sys.executable, "-m", "catheter_sim", "diagnose", str(dataset), "-o", str(output)]
    environment = os.environ | dict.fromkeys(_THREADS, "1")
    try:
        done = subprocess.run(
            command,
            cwd=dataset,
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
        raise InterruptedError(f"{dataset.name}: the diagnosis was ended by signal {number}")
    lines = done.stderr.strip().splitlines()
    return "" if done.returncode == 0 else f"exit status {done.returncode}: {lines[-1] if lines else ''}"


def run_draw(
    seed: int,
    index: int,
    root: Path,
    robots: Sequence[str] = tuple(BENCH_ROBOTS),
    limit_s: float = 900.0,
    diagnose: Diagnose = diagnose_elsewhere,
) -> dict[str, Any]:
    """Return the score of one draw, made unless its file is there and whole.

    Data, once whole, and a diagnosis, once ended, are not made again either.
    """
    folders = Folders(root, index)
    known = read_json(folders.score)
    if known is not None:
        return dict(known)
    if read_json(folders.answer / ANSWER) is None:
        folders.clear()
        try:
            write_draw(make(seed, index, robots), folders)
        except CannotMake as error:
            result = _not_made(seed, index, robots, str(error))
            write_json(result, folders.score)
            return result
    run = read_json(folders.found / RUN)
    if run is None:
        shutil.rmtree(folders.found, ignore_errors=True)
        folders.found.mkdir(parents=True)
        run = _diagnosed(folders, limit_s, diagnose)
        write_json(run, folders.found / RUN)
    result = score(folders, run)
    write_json(result, folders.score)
    return result


def run_bench(
    seed: int,
    draws: int,
    root: Path,
    jobs: int = 1,
    robots: Sequence[str] = tuple(BENCH_ROBOTS),
    limit_s: float = 900.0,
    on_score: Callable[[dict[str, Any]], None] = lambda score: None,
) -> list[dict[str, Any]]:
    """Return the scores of the first `draws` draws of a seed, in order, `jobs` at a time.

    Raises:
        InputError: the folder holds the draws of another seed or other robots.
    """
    _check_folder(root, {"seed": seed, "robots": list(robots)})
    arguments = [(seed, index, root, robots, limit_s) for index in range(draws)]
    if jobs == 1:
        scores = []
        for item in arguments:
            scores.append(run_draw(*item))
            on_score(scores[-1])
        return scores
    # Read by the workers' libraries when they start: threads would only stand in one another's way.
    os.environ.update({name: os.environ.get(name, "1") for name in _THREADS})
    with ProcessPoolExecutor(jobs, get_context("spawn"), end_with_parent) as pool:
        futures = [pool.submit(run_draw, *item) for item in arguments]
        for future in as_completed(futures):
            if future.exception() is None:  # a fault of one draw is raised when the others are done
                on_score(future.result())
        return [future.result() for future in futures]


def end_with_parent() -> None:
    """Let this process end when the one that started it was killed: its work would go on unheard."""
    parent = parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    Thread(target=watch, daemon=True).start()


def _diagnosed(folders: Folders, limit_s: float, diagnose: Diagnose) -> dict[str, Any]:
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


def _check_folder(root: Path, settings: dict[str, Any]) -> None:
    known = read_json(root / SETTINGS)
    if known is not None and known != settings:
        raise InputError(f"{root}: holds draws of {known}, not of {settings}; give another folder")
    write_json(settings, root / SETTINGS)


def _not_made(seed: int, index: int, robots: Sequence[str], why: str) -> dict[str, Any]:
    return {
        "index": index,
        "story": story_of(seed, index),
        "robot": robot_of(seed, index, robots),
        "true": [],
        "size": 0.0,
        "rows": 0,
        "seconds": 0.0,
        "verdict": NOT_MADE,
        "failure": why,
        "named": [],
        "right": False,
    }
