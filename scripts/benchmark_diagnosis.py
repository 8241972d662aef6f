"""Time a whole diagnosis, MuJoCo's replay and the next experiment included, on data of a given size.

    python scripts/benchmark_diagnosis.py --rows 900 --trials 8 --jobs 2
    python scripts/benchmark_diagnosis.py --rows 2000 --robots neuroendoscope_section,spacer_disk

For each robot of the hidden-effect bench the simulation makes trials of rich histories, two effects hidden
(a wrong scale of the inputs, and inputs that come late) and white noise of 0.1 mm; a quarter of the trials is
held out. Printed: the rows, the seconds of the clock, those of the processor, and what was named.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from catheter_sim.cli.arguments import whole_number
from catheter_sim.diagnosis.pipeline import diagnose
from catheter_sim.effects.apply import with_effects
from catheter_sim.errors import InputError
from catheter_sim.hidden.folders import write_dataset
from catheter_sim.hidden.histories import history
from catheter_sim.hidden.makers import CannotMake, simulated
from catheter_sim.hidden.robots import BENCH_ROBOTS, BenchRobot, bench_robot

NOISE_MM = 0.1
HIDDEN = {"actuation_gain": {"scale": 0.85}, "rate": {"lag_s": 0.6}}


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
    parser.add_argument("--robots", help=f"comma-separated, of {', '.join(BENCH_ROBOTS)}; default all")
    options = parser.parse_args()
    names = options.robots.split(",") if options.robots else list(BENCH_ROBOTS)
    try:
        for name in names:
            generator = np.random.default_rng(options.seed)
            bench = bench_robot(name, generator)
            with tempfile.TemporaryDirectory() as folder:
                data, found = Path(folder, "data"), Path(folder, "found")
                rows = _make(data, bench, options.rows, options.trials, generator)
                clock, before = time.perf_counter(), os.times()
                diagnosis = diagnose(data, found, jobs=options.jobs)
                seconds, after = time.perf_counter() - clock, os.times()
            own = sum(after[:4]) - sum(before[:4])
            named = " + ".join(cause.name for cause in diagnosis.causes) or diagnosis.verdict
            print(f"{name}: {rows} rows, {seconds:.0f} s, processor {own:.0f} s: {named}", flush=True)
    except (InputError, CannotMake) as error:
        print(f"benchmark_diagnosis: error: {error}", file=sys.stderr)
        return 2
    return 0


def _make(folder: Path, bench: BenchRobot, rows: int, trials: int, generator: np.random.Generator) -> int:
    """Write a data set and return its rows."""
    robot = with_effects(bench.robot, HIDDEN)
    columns = [f"tip_{axis}_mm" for axis in bench.axes]
    longer = replace(bench, rows=round(rows / trials))
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
