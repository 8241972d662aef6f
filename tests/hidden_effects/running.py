"""Where a bench's draws lie, and how they are diagnosed in another process, many at a time."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context, parent_process
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
import tomli_w

from catheter_sim.arrays import Array
from catheter_sim.catalogue import robot_toml
from catheter_sim.channels import input_channels
from catheter_sim.errors import InputError
from catheter_sim.lab.robots import BenchRobot
from catheter_sim.tables import Table, replaced_when_whole, write_table

# ----------------------------------------------------------------------------------------------------
# Where a draw of a bench lies: the data set in one folder, the answer in another, each whole or not there.
#
# Nothing here knows what makes a draw's data or what is hidden in them.

ANSWER = "answer.json"
SETTINGS = "bench.json"


@dataclass(frozen=True)
class Folders:
    """The places of one draw below the bench's folder.

    Attributes:
        root: the bench's folder.
        index: of the draw.
    """

    root: Path
    index: int

    @property
    def name(self) -> str:
        """The draw's name, which says nothing about it."""
        return f"draw_{self.index:03d}"

    @property
    def data(self) -> Path:
        """The data set: all that the diagnosis is given."""
        return self.root / "data" / self.name

    @property
    def answer(self) -> Path:
        """The answer and the third set of trials."""
        return self.root / "answers" / self.name

    @property
    def found(self) -> Path:
        """What the diagnosis wrote."""
        return self.root / "found" / self.name

    @property
    def score(self) -> Path:
        """The score, written last."""
        return self.root / "scores" / f"{self.name}.json"

    def clear(self) -> None:
        """Remove whatever an interrupted run left of this draw."""
        for folder in (self.data, self.answer, self.found):
            shutil.rmtree(folder, ignore_errors=True)
        self.score.unlink(missing_ok=True)


def keep_settings(root: Path, settings: dict[str, Any]) -> None:
    """Write what a bench's folder holds.

    Raises:
        InputError: it holds other draws.
    """
    known = read_json(root / SETTINGS)
    if known is not None and known != settings:
        raise InputError(f"{root}: holds draws of {known}, not of {settings}; give another folder")
    write_json(settings, root / SETTINGS)


def write_json(document: Any, path: Path) -> None:
    """Write a JSON file whole or not at all, its folder made if need be."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with replaced_when_whole(path) as file:
        file.write(json.dumps(document, indent=1, default=_plain) + "\n")


def show_table(table: Any, text: str, root: Path) -> None:
    """Write a bench's table into its folder, as `table.txt` and `table.json`, and print it."""
    with replaced_when_whole(root / "table.txt") as file:
        file.write(text + "\n")
    write_json(table, root / "table.json")
    print(text)


def read_json(path: Path) -> Any:
    """Return a JSON file's document; None where there is none, or half of one."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def write_tables(
    folder: Path,
    name: str,
    bench: BenchRobot,
    columns: Sequence[str],
    gravity_mps2: Array,
    trials: Sequence[tuple[Table, str]],
) -> None:
    """Write a data set of made trials.

    Args:
        folder: to write.
        name: of the data set.
        bench: the robot as specified.
        columns: of the outputs.
        gravity_mps2: as the data set states it, shape (3,).
        trials: inputs and outputs in file units, and role, "" for none.
    """
    folder.mkdir(parents=True, exist_ok=True)
    entries = []
    for number, (table, role) in enumerate(trials, start=1):
        file = f"trial_{number:02d}.csv"
        write_table(table, folder / file)
        entries.append({"file": file, "role": role} if role else {"file": file})
    document = {
        "dataset": {
            "name": name,
            "robot": bench.reference,
            "source": "made for the hidden-effect bench",
            "licence": "CC0-1.0",
        },
        "conditions": {"gravity_mps2": gravity_mps2.tolist()},
        "channels": {"inputs": input_channels(bench.robot), "outputs": list(columns)},
        "trials": entries,
    }
    (folder / "dataset.toml").write_text(tomli_w.dumps(document), encoding="utf-8")
    if bench.reference.endswith(".toml"):
        (folder / bench.reference).write_text(robot_toml(bench.robot), encoding="utf-8")


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{value!r} has no place in a JSON file")


# ----------------------------------------------------------------------------------------------------
# Diagnoses in another process, on a copy of the data set that lies apart; and runs many draws at a time.

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
