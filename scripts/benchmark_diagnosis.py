"""Time a whole diagnosis, MuJoCo's replay and the next experiment included, on data of a given size.

    python scripts/benchmark_diagnosis.py --rows 900 --trials 8 --jobs 2
    python scripts/benchmark_diagnosis.py --rows 2000 --robots neuroendoscope_section,spacer_disk

For each robot of the hidden-effect bench the simulation makes trials of rich histories, two effects hidden
(a wrong scale of the inputs, and inputs that come late) and white noise of 0.1 mm; a quarter of the trials is
held out. Printed: the rows, the seconds of the clock, those of the processor, and what was named.

    python scripts/benchmark_diagnosis.py --rows 400 --trials 4 --frames --robots file_displacement

With --frames each data set is diagnosed again as a tracker would have it that stands a metre away, is turned
by 90 deg, writes metres, or stamps epoch seconds: the processor's time over that of the data as they are, and
what was named, with its numbers.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))  # where the benches lie

from catheter_sim.arrays import Array
from catheter_sim.cli.arguments import whole_number
from catheter_sim.diagnosis.pipeline import diagnose
from catheter_sim.effects.apply import with_effects
from catheter_sim.errors import InputError
from catheter_sim.lab.robots import BENCH_ROBOTS, BenchRobot, bench_robot
from catheter_sim.tables import read_table, write_table
from hidden_effects.first_draws import CannotMake, history, simulated, write_dataset

NOISE_MM = 0.1
HIDDEN = {"actuation_gain": {"scale": 0.85}, "rate": {"lag_s": 0.6}}
EPOCH_S = 1.7e9
Rows = dict[str, Array]


def main() -> int:
    """Print a line for each robot; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--rows", type=whole_number(100, 100000), default=900, help="of all trials; default 900"
    )
    parser.add_argument("--trials", type=whole_number(4, 100), default=8, help="default 8")
    parser.add_argument("--jobs", type=whole_number(1, 256), default=2, help="processes; default 2")
    parser.add_argument(
        "--seed", type=whole_number(0, 2**31), default=1, help="of inputs and noise; default 1"
    )
    parser.add_argument("--frames", action="store_true", help="diagnose the data in other frames too")
    parser.add_argument("--robots", help=f"comma-separated, of {', '.join(BENCH_ROBOTS)}; default all")
    options = parser.parse_args()
    names = options.robots.split(",") if options.robots else list(BENCH_ROBOTS)
    try:
        for name in names:
            generator = np.random.default_rng(options.seed)
            bench = bench_robot(name, generator)
            with tempfile.TemporaryDirectory() as folder:
                data = Path(folder, "data")
                rows = _make(data, bench, options.rows, options.trials, generator)
                clock, own, named = _timed(data, Path(folder, "found"), options.jobs)
                print(f"{name}: {rows} rows, {clock:.0f} s, processor {own:.0f} s: {named}", flush=True)
                for frame, change in (FRAMES if options.frames else {}).items():
                    elsewhere = Path(folder, frame)
                    _copy(data, elsewhere, change)
                    _, there, named = _timed(elsewhere, Path(folder, f"found {frame}"), options.jobs)
                    print(f"  {frame}: {there / own:.2f} times the processor's time: {named}", flush=True)
    except (InputError, CannotMake) as error:
        print(f"benchmark_diagnosis: error: {error}", file=sys.stderr)
        return 2
    return 0


def _timed(data: Path, found: Path, jobs: int) -> tuple[float, float, str]:
    """Return the seconds of the clock and of the processor that a diagnosis takes, and what it names."""
    clock, before = time.perf_counter(), os.times()
    diagnosis = diagnose(data, found, jobs=jobs)
    seconds, after = time.perf_counter() - clock, os.times()
    causes = [
        f"{cause.name} ({', '.join(f'{key} {item.value:.4g}' for key, item in cause.parameters.items())})"
        for cause in diagnosis.causes
    ]
    return seconds, sum(after[:4]) - sum(before[:4]), " + ".join(causes) or diagnosis.verdict


def _metre_away(rows: Rows) -> Rows:
    return {name: values + 1e3 * (name == "tip_x_mm") for name, values in rows.items()}


def _turned(rows: Rows) -> Rows:
    """Turn by 90 deg about y: z comes where x was."""
    return rows | {"tip_x_mm": rows["tip_z_mm"], "tip_z_mm": -rows["tip_x_mm"]}


def _in_metres(rows: Rows) -> Rows:
    return {name: values * (1e-3 if name.startswith("tip_") else 1.0) for name, values in rows.items()}


def _same(rows: Rows) -> Rows:
    return rows


FRAMES: dict[str, Callable[[Rows], Rows]] = {
    "a metre away": _metre_away,
    "turned by 90 deg": _turned,
    "in metres": _in_metres,
    "in epoch seconds": _same,
}


def _copy(data: Path, elsewhere: Path, change: Callable[[Rows], Rows]) -> None:
    """Write a data set again with its columns changed; one whose columns stay has another clock."""
    shutil.copytree(data, elsewhere)
    for path in elsewhere.glob("trial_*.csv"):
        table = read_table(path)
        time_s = table.time_s + (EPOCH_S if change is _same else 0.0)
        write_table(replace(table, time_s=time_s, columns=change(table.columns)), path)


def _make(folder: Path, bench: BenchRobot, rows: int, trials: int, generator: np.random.Generator) -> int:
    """Write a data set and return its rows."""
    robot = with_effects(bench.robot, HIDDEN)
    columns = [f"tip_{axis}_mm" for axis in bench.trials.axes]
    longer = replace(bench, trials=replace(bench.trials, rows=round(rows / trials)))
    made = []
    for number in range(trials):
        inputs = history(longer, generator, rich=True)
        clean = simulated(bench, robot, inputs, np.zeros(3)).columns(columns)
        outputs = clean + NOISE_MM * generator.normal(size=clean.shape)
        made.append((inputs, outputs, "heldout" if number >= trials - trials // 4 else "train"))
    write_dataset(folder, "benchmark", bench, columns, np.zeros(3), made)
    return sum(len(inputs) for inputs, _, _ in made)


if __name__ == "__main__":
    sys.exit(main())
