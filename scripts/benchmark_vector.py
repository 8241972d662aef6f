"""How many steps a second the vector environments make, against a loop over one environment in the same run.

    python scripts/benchmark_vector.py -o results/vector.csv
    python scripts/benchmark_vector.py --environment ChestTubeReach --sizes 64 --pixels -o results/chest.json

In every round the loop, the vector environments of every size, and those of the same size without tendon
friction take turns, all under random actions; what is written are medians over the rounds. -o FILE: CSV, or
JSON by its ending. Columns:

    num_envs         0: the loop over one environment
    observation      state or pixels (64x64, software rendering where there is no other)
    steps_per_s      environment steps in a second of the clock
    ratio            these over the loop's of the same round (pixels: over a loop that draws, too)
    ratio_processor  the same in time of the processors, times threads: what an idle machine could give
    python_percent   share of the processors' time that is neither MuJoCo's nor compiled loops'
    friction_cost    time of a step over that of one without friction, in time of the processors
    reset_ratio      time of the loop's resets, each drawing its target by simulation, over that of the first
                     reset here, for each environment; measured once
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from tqdm import tqdm

import catheter_sim  # noqa: F401 - registers the environments
from catheter_sim.cli.arguments import whole_number
from catheter_sim.envs import EPISODE_STEPS
from catheter_sim.errors import InputError, unknown
from catheter_sim.tables import replaced_when_whole

PREFIX, SUFFIX = "catheter_sim/", "-v0"
FRICTIONLESS = ("friction.mu=0",)
WARM_STEPS = 3
RESETS = 4  # of the loop's environment, to be timed
COLUMNS = (
    "num_envs",
    "observation",
    "steps_per_s",
    "ratio",
    "ratio_processor",
    "python_percent",
    "friction_cost",
    "reset_ratio",
)
PIXELS = {"observation": "pixels", "width": 64, "height": 64}


def main() -> int:
    """Measure, print and write the table; return the exit status."""
    known = [
        name[len(PREFIX) : -len(SUFFIX)]
        for name in gymnasium.registry
        if name.startswith(PREFIX) and name.endswith(SUFFIX)
    ]
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--environment", default="NeuroendoscopeReach", help=f"of {', '.join(known)}")
    parser.add_argument("--sizes", default="1,8,64", help="numbers of environments; default 1,8,64")
    parser.add_argument("--threads", type=whole_number(1, 256), default=2, help="default 2")
    parser.add_argument("--rounds", type=whole_number(1, 1000), default=5, help="default 5")
    parser.add_argument(
        "--steps", type=whole_number(1, 20), default=4, help="of a turn; default 4, the loop's 16"
    )
    parser.add_argument("--pixels", action="store_true", help="measure pictures as observations too")
    parser.add_argument("-o", "--output", metavar="FILE", required=True, help="CSV or JSON to write")
    options = parser.parse_args()
    try:
        if options.environment not in known:
            raise unknown("environment", options.environment, known, "--environment")
        if not all(text.isdecimal() and 0 < int(text) <= 100_000 for text in options.sizes.split(",")):
            raise InputError(f"--sizes {options.sizes}: whole numbers, 1 to 100000, with commas are needed")
        sizes = [int(text) for text in options.sizes.split(",")]
        rows = table(options, sizes)
        text = ",".join(COLUMNS) + "\n" + "".join(",".join(map(shown, row)) + "\n" for row in rows)
        with replaced_when_whole(options.output) as file:
            if Path(options.output).suffix == ".json":
                records = [
                    {name: value for name, value in zip(COLUMNS, row, strict=True) if value is not None}
                    for row in rows
                ]
                file.write(json.dumps(records, indent=1) + "\n")
            else:
                file.write(text)
    except InputError as error:
        print(f"benchmark_vector: error: {error}", file=sys.stderr)
        return 2
    print(text, end="")
    return 0


def shown(value: Any) -> str:
    """Return a cell's text."""
    if value is None:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


class Runner:
    """An environment, or many, under random actions, and the times of its last turn.

    Attributes:
        wall_s, processor_s, native_s: of one environment's step, and of these what is native; reset_s: of a
            reset.
    """

    def __init__(self, name: str, num_envs: int, threads: int, **arguments: Any) -> None:
        """Make and warm up; 0: one environment in a loop."""
        self._single = num_envs == 0
        self._env: Any
        if self._single:
            self._env = gymnasium.make(name, **arguments)
        else:
            self._env = gymnasium.make_vec(name, num_envs, "vector_entry_point", threads=threads, **arguments)
        self._of = max(num_envs, 1)
        self._rng = np.random.default_rng(0)
        first = np.arange(self._of) == 0  # compiles what is not yet compiled
        self._env.reset(seed=0) if self._single else self._env.reset(seed=0, options={"reset_mask": first})
        self._reset()
        self._walk(WARM_STEPS)

    def turn(self, steps: int) -> None:
        """Take so many steps."""
        if self._taken + steps > EPISODE_STEPS:
            self._reset()
        native = self._native()
        wall, processor = time.perf_counter(), time.process_time()
        self._walk(steps)
        taken = steps * self._of
        self.wall_s = (time.perf_counter() - wall) / taken
        self.processor_s = (time.process_time() - processor) / taken
        self.native_s = (self._native() - native) / taken

    def close(self) -> None:
        self._env.close()

    def _native(self) -> float:
        return float(getattr(self._env.unwrapped, "native_s", np.nan))

    def _reset(self) -> None:
        resets = RESETS if self._single else 1
        start = time.perf_counter()
        for _ in range(resets):
            self._env.reset()
        self.reset_s = (time.perf_counter() - start) / self._of / resets
        self._taken = 0

    def _walk(self, steps: int) -> None:
        self._taken += steps
        shape = self._env.action_space.shape
        for _ in range(steps):
            self._env.step(self._rng.uniform(-1.0, 1.0, shape).astype(np.float32))


def table(options: argparse.Namespace, sizes: list[int]) -> list[tuple[Any, ...]]:
    """Return the rows, in the order of `COLUMNS`."""
    name = f"{PREFIX}{options.environment}{SUFFIX}"
    frictionless = {"settings": FRICTIONLESS}
    runners = {(0, "state"): Runner(name, 0, 1)}
    for size in sizes:
        runners[size, "state"] = Runner(name, size, options.threads)
        runners[size, "free"] = Runner(name, size, options.threads, **frictionless)
    if options.pixels:
        runners[0, "pixels"] = Runner(name, 0, 1, **PIXELS)
        runners[sizes[-1], "pixels"] = Runner(name, sizes[-1], options.threads, **PIXELS)
    found: dict[tuple[int, str], list[list[float]]] = {key: [] for key in runners}
    for _ in tqdm(range(options.rounds), disable=None, leave=False):
        for (size, kind), runner in runners.items():
            runner.turn(options.steps if size else 4 * options.steps)
            found[size, kind].append([runner.wall_s, runner.processor_s, runner.native_s, runner.reset_s])
    for runner in runners.values():
        runner.close()
    times = {key: np.array(values) for key, values in found.items()}  # (rounds, 3) each

    rows: list[tuple[Any, ...]] = []
    for (size, kind), own in times.items():
        if kind == "free":
            continue
        loop, free = times[0, kind], times.get((size, "free") if kind == "state" else (-1, ""))
        rate = float(np.median(1.0 / own[:, 0]))
        if size == 0:
            rows.append((0, kind, rate, *[None] * 5))
            continue
        gain = loop / own
        rows.append(
            (
                size,
                kind,
                rate,
                float(np.median(gain[:, 0])),
                float(np.median(gain[:, 1])) * min(options.threads, size),
                100.0 * float(np.median(1.0 - own[:, 2] / own[:, 1])),
                None if free is None else float(np.median(own[:, 1] / free[:, 1])),
                runners[0, kind].reset_s / runners[size, kind].reset_s,
            )
        )
    return rows


if __name__ == "__main__":
    sys.exit(main())
