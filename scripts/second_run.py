"""Run every verb twice with an empty store of compiled kernels: what the first run compiles, the second has.

    python scripts/second_run.py [VERB ...]

Each verb is a process of its own, and so is its second run. For both the table has the time, the kernels that
the run says that it compiled, and how many files of the store it wrote; then what the first `simulate` says.
Then, five times each, the processor's time of `import catheter_sim` (less an empty interpreter's) and of
`catheter-sim --help`, medians. Exit status 1 where a second run compiled or wrote anything, the import took
0.5 s or more, or the help 0.3 s or more.
"""

from __future__ import annotations

import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

TURNS = 5
IMPORT_S, HELP_S = 0.5, 0.3
ROWS = 12
_COMPILED = re.compile(r"compiled (\d+) kernel")
_ROBOT = "neuroendoscope_section"
SPATIAL = "time_s,tension_1_N\n" + "".join(f"{k},{k % 4}\n" for k in range(ROWS))


def inputs(most_N: float) -> str:
    """Return inputs that pull to and fro, as CSV."""
    pulls = (most_N * abs((k % 8) / 4 - 1) for k in range(ROWS))
    return "time_s,tension_right_N,tension_left_N\n" + "".join(
        f"{k},{pull:.3f},0\n" for k, pull in enumerate(pulls)
    )


DATASET = f"""[dataset]
name = "two runs"
robot = "{_ROBOT}"
source = "simulated"
licence = "MIT"
[conditions]
gravity_mps2 = [0.0, 0.0, 0.0]
[channels]
inputs = ["tension_right_N", "tension_left_N"]
outputs = ["tip_x_mm", "tip_z_mm"]
[[trials]]
file = "trial_01.csv"
[[trials]]
file = "trial_02.csv"
"""
RUNS = {
    "list": ("list",),
    "build": ("build", _ROBOT, "-o", "model.xml"),
    "simulate": ("simulate", _ROBOT, "--inputs", "in.csv", "-o", "out.csv"),
    "statics": ("statics", "spacer_disk", "--model", "VC", "--inputs", "spatial.csv", "-o", "out.csv"),
    "render": ("render", _ROBOT, "--inputs", "in.csv", "--width", "96", "--height", "72", "-o", "out.png"),
    "diagnose": ("diagnose", "data", "-o", "report"),
    "validate": ("validate", _ROBOT, "-o", "validated"),
    "bench": ("bench", "--json", "--turns", "1"),
}


def prepare(folder: Path) -> None:
    """Write the inputs and the data that the verbs read; the data are the robot's own simulation."""
    (folder / "spatial.csv").write_text(SPATIAL)
    data = folder / "data"
    data.mkdir()
    (data / "dataset.toml").write_text(DATASET)
    for name, most_N in (("trial_01", 0.3), ("trial_02", 0.4)):
        given = inputs(most_N)
        (folder / "in.csv").write_text(given)
        run((*RUNS["simulate"], "--columns", "tip_x_mm,tip_z_mm"), folder, None)
        found = [line.split(",") for line in (folder / "out.csv").read_text().splitlines()]
        places = [",".join(line[-2:]) for line in found]
        lines = [f"{row},{place}" for row, place in zip(given.splitlines(), places, strict=True)]
        (data / f"{name}.csv").write_text("\n".join(lines) + "\n")


def run(words: tuple[str, ...], folder: Path, store: Path | None) -> tuple[float, str]:
    """Run a verb; return its time by the clock [s] and what it says on standard error."""
    environment = os.environ.copy()
    if store is not None:
        environment["NUMBA_CACHE_DIR"] = str(store)
    began = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-m", "catheter_sim", *words],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
    )
    if done.returncode not in (0, 1):
        raise SystemExit(f"second_run: {' '.join(words)}: {done.stderr}")
    return time.perf_counter() - began, done.stderr


def written(store: Path) -> dict[Path, int]:
    """Return the files of the store and when each was written [ns]."""
    return {path: path.stat().st_mtime_ns for path in store.rglob("*") if path.is_file()}


def duration(*words: str) -> float:
    """Return the median of the processor's time of a process [s]; the clock's is no less."""
    times = []
    for _ in range(TURNS):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, *words], check=True, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return median(times)


def main() -> int:
    """Print the table; return the exit status."""
    verbs = sys.argv[1:] or list(RUNS)
    for verb in verbs:
        if verb not in RUNS:
            print(f"second_run: {verb}: not one of {', '.join(RUNS)}", file=sys.stderr)
            return 2
    failed, said = False, ""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        prepare(folder)
        print(
            f"{'':10}{'first: s':>10}{'compiled':>10}{'files':>7}"
            f"{'second: s':>11}{'compiled':>10}{'files':>7}"
        )
        for verb in verbs:
            store = folder / f"store_{verb}"
            cells = []
            for turn in range(2):
                before = written(store)
                seconds, errors = run(RUNS[verb], folder, store)
                kernels = sum(int(count) for count in _COMPILED.findall(errors))
                files = sum(1 for path, when in written(store).items() if before.get(path) != when)
                cells.append(f"{seconds:>{10 + turn}.1f}{kernels:>10}{files:>7}")
                failed = failed or (turn == 1 and (kernels > 0 or files > 0))
                if verb == "simulate" and turn == 0:
                    said = errors
            print(f"{verb:10}{''.join(cells)}", flush=True)
    if said:
        print("the first simulate said:\n" + said.rstrip())
    imported = duration("-c", "import catheter_sim") - duration("-c", "pass")
    helped = duration("-m", "catheter_sim", "--help")
    print(
        f"import catheter_sim: {imported:.2f} s (below {IMPORT_S}); --help: {helped:.2f} s (below {HELP_S})"
    )
    return int(failed or imported >= IMPORT_S or helped >= HELP_S)


if __name__ == "__main__":
    sys.exit(main())
