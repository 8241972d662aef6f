"""Time the static models of the spacer-disk robot, one configuration by itself and a batch of 1000.

    python scripts/benchmark_statics.py [THREADS]

One by one: from a straight start under each of the sixteen sets of tensions {0, T_M}^4 (Rao 2021, Eq. 55),
the best of several runs each, the median of the sixteen. Batch: 1000 rows of random tensions up to T_M, the
best of three runs; once on one thread and, with THREADS, once more on so many. "Solver" takes arrays to
arrays, "model" is the function of the model, inputs to postures. On one thread the processor's time is
counted, which other programs disturb less; on several the clock's.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.robots.continuum.published import spacer_disk
from catheter_sim.robots.continuum.solvers import LUMPED, MODAL, RODS, solver_call
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.validation.lines import given

FULL_PULL_N = 5.55329741  # Rao 2021, Eq. 55
ROWS = 1000
SERIAL = ("CC", "four_bar")  # whose rows no threads share


def best_s(call: Callable[[], object], runs: int, clock: Callable[[], float] = time.process_time) -> float:
    """Return the shortest time of a call [s]; the first call, which compiles, does not count."""
    call()
    times = []
    for _ in range(runs):
        began = clock()
        call()
        times.append(clock() - began)
    return min(times)


def main() -> int:
    """Print the table; return the exit status."""
    asked = sys.argv[1] if len(sys.argv) > 1 else "1"
    if not asked.isdigit() or int(asked) < 1:
        print(f"benchmark_statics: THREADS = {asked}: must be a whole number, 1 or more", file=sys.stderr)
        return 2
    threads = int(asked)
    robot = spacer_disk()
    sets = [given(FULL_PULL_N * np.array([[case >> k & 1 for k in range(4)]], float)) for case in range(16)]
    batch = given(np.random.default_rng(0).uniform(0.0, FULL_PULL_N, (ROWS, 4)))
    no_gravity: Array = np.zeros(3)
    print(f"{robot.name}, {robot.disks_per_segment} disks a segment; us per configuration, 1 thread")
    more = f"  batch, {threads} threads" if threads > 1 else ""
    print(
        f"{'':14}{'solver: one':>12}{'batch':>8}{'ratio':>7}{'model: one':>13}{'batch':>8}{'ratio':>7}{more}"
    )
    for name in (*SERIAL, *LUMPED, *MODAL, *RODS):
        model = STATIC_MODELS[name].solve
        one = np.median([best_s(solver_call(name, robot, item, no_gravity), 30) for item in sets]) * 1e6
        many = best_s(solver_call(name, robot, batch, no_gravity), 5) / ROWS * 1e6
        whole_one = (
            np.median([best_s(lambda item=item, f=model: f(robot, item, no_gravity), 10) for item in sets])
            * 1e6
        )
        whole_many = best_s(lambda f=model: f(robot, batch, no_gravity), 5) / ROWS * 1e6
        line = f"{name:14}{one:12.1f}{many:8.2f}{one / many:7.1f}"
        line += f"{whole_one:13.0f}{whole_many:8.1f}{whole_one / whole_many:7.1f}"
        if threads > 1 and name not in SERIAL:
            call = solver_call(name, robot, batch, no_gravity, threads)
            line += f"{best_s(call, 5, time.perf_counter) / ROWS * 1e6:18.2f}"
        print(line)
    return 0


if __name__ == "__main__":
    sys.exit(main())
