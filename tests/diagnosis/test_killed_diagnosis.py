"""A diagnosis in several processes that is ended at any moment leaves nothing running and loses nothing.

The suite ends five runs; with CATHETER_SIM_KILL_SEEDS=4 in the environment it ends twenty.
"""

from __future__ import annotations

import os
import random
import re
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from planted import small_data

from catheter_sim.catalogue import robot_toml
from catheter_sim.channels import input_channels
from catheter_sim.tables import Table, write_table

pytestmark = pytest.mark.slow
KILLS = 5  # of one chain of runs
SEEDS = int(os.environ.get("CATHETER_SIM_KILL_SEEDS", "1"))
WHOLE = re.compile(r"\.unfinished|[0-9a-f]{40}\.npz|[^.]*\.[a-z]+")  # names of what a run leaves


@dataclass(frozen=True)
class Undisturbed:
    """A data set, and a run of it that nobody ended: its files, how many results it kept, its time [s]."""

    data: Path
    files: dict[str, bytes]
    kept: int
    seconds: float


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Undisturbed:
    folder = tmp_path_factory.mktemp("undisturbed")
    data, output = written_data(folder / "data"), folder / "out"
    start, kept = time.monotonic(), 0
    with started(data, output) as program:
        while program.poll() is None:
            kept = max(kept, kept_in(output))
            time.sleep(0.05)
    assert program.returncode == 0
    return Undisturbed(data, files_below(output), kept, time.monotonic() - start)


def written_data(folder: Path) -> Path:
    """Write a data set of the small robot with a backlash; return its folder."""
    made = small_data({"backlash": {"width_mm": 0.4}})
    folder.mkdir()
    (folder / "small.toml").write_text(robot_toml(made.robot))
    inputs = list(input_channels(made.robot))
    for trial in made.trials:
        columns = dict(zip(inputs, 1e3 * trial.inputs.tendon.T, strict=True)) | trial.outputs.columns
        write_table(Table(trial.inputs.time_s, columns), folder / trial.file)
    document = {
        "dataset": {"name": "small", "robot": "small.toml", "source": "made", "licence": "none"},
        "conditions": {"gravity_mps2": np.zeros(3).tolist()},
        "channels": {"inputs": inputs, "outputs": list(made.output_channels)},
        "trials": [{"file": trial.file, "role": trial.role} for trial in made.trials],
    }
    (folder / "dataset.toml").write_text(tomli_w.dumps(document))
    return folder


def started(data: Path, output: Path) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "catheter_sim", "diagnose", str(data), "-o", str(output), "--jobs", "2"]
    same_time = os.environ | {"SOURCE_DATE_EPOCH": "0"}  # reports say when they were made
    return subprocess.Popen(
        command, stdout=subprocess.DEVNULL, start_new_session=True, text=True, env=same_time
    )


def files_below(folder: Path) -> dict[str, bytes]:
    """Return the files of an output folder, but for its own path, which is in the command that they name."""
    own = os.fsencode(folder)
    found = [path for path in folder.rglob("*") if path.is_file()]
    return {str(path.relative_to(folder)): path.read_bytes().replace(own, b"OUT") for path in found}


def left_running(session: int) -> list[int]:
    """Return the ids of the processes of a session that run."""
    found = []
    for folder in Path("/proc").iterdir():
        with suppress(OSError):
            words = (folder / "stat").read_text().rpartition(")")[2].split()
            if words[3] == str(session) and words[0] != "Z":
                found.append(int(folder.name))
    return found


def temporary(output: Path, process: int) -> set[str]:
    """Return what is not whole in the output folder, and what a process has in shared memory."""
    found = {str(path) for path in output.rglob("*") if not WHOLE.fullmatch(path.name)}
    if Path("/dev/shm").is_dir():
        found |= {name for name in os.listdir("/dev/shm") if f"{process}" in name}
    return found


@pytest.mark.parametrize("seed", range(SEEDS))
def test_a_diagnosis_killed_again_and_again_ends_as_if_nothing_had_been(
    seed: int, undisturbed: Undisturbed, tmp_path: Path
) -> None:
    """Five times SIGTERM or SIGKILL at random; each run takes up what the last one had finished.

    Every file of a run that comes to its end is that of an undisturbed one, byte by byte, and there is no
    other. After SIGTERM nothing temporary is there at once, after SIGKILL once the next run has ended.
    """
    generator = random.Random(seed)
    moments = sorted(generator.randrange(undisturbed.kept + 1) for _ in range(KILLS))  # results kept
    ends = 0
    for turn, moment in enumerate([*moments, None]):
        output = tmp_path / f"out_{ends}"
        before = temporary(output, 0)  # of a run that was killed
        number = (signal.SIGTERM, signal.SIGKILL)[(seed + turn) % 2]
        with started(undisturbed.data, output) as program:
            while moment is not None and program.poll() is None and kept_in(output) < moment:
                time.sleep(0.01)
            with suppress(subprocess.TimeoutExpired):
                later = generator.uniform(0.0, 0.1 * undisturbed.seconds)
                program.wait(None if moment is None else later)
            if program.poll() is None:
                program.send_signal(number)
            status = program.wait(60.0)
        wait_until_none_runs(program.pid)
        print(f"seed {seed}: wanted {moment}, kept {kept_in(output)}, {number.name}, status {status}")
        if status == 0:  # not killed, or when it was just done
            ends += 1
            assert files_below(output) == undisturbed.files
        else:
            assert status in (-number, 128 + number)
            if number == signal.SIGTERM:
                assert temporary(output, program.pid) <= before
    assert status == 0


def kept_in(output: Path) -> int:
    """Return how many finished results a run has left."""
    return len(list((output / ".unfinished").glob("[0-9a-f]*.npz")))


def wait_until_none_runs(session: int) -> None:
    end = time.monotonic() + 30.0
    while left_running(session):
        assert time.monotonic() < end, left_running(session)
        time.sleep(0.05)
