"""Print env-steps per second of a robot on MuJoCo Warp, by batch size.

    python scripts/benchmark_gpu.py
    python scripts/benchmark_gpu.py --robot chest_tube --sizes 256,4096 --device cuda:0

Friction is on, with the specified coefficient or 0.3. Each copy has inputs of its own, all different. The
first steps compile and are not counted; on a GPU the steps are captured in a graph once and replayed. A
ratio against one copy of the simulator on this machine's processor stands beside.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
import time

import numpy as np

from catheter_sim.catalogue import load_robot
from catheter_sim.core.robot import Friction
from catheter_sim.envs.robots import quick_model
from catheter_sim.errors import InputError
from catheter_sim.gpu.batch import WarpBatch
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.speed.benchmark import FRICTION_MU

STEPS = 20  # in one replay


def main() -> int:
    """Measure and print; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robot", default="neuroendoscope_section")
    parser.add_argument("--sizes", default="1,16,256,1024,4096", help="batch sizes, with commas between")
    parser.add_argument("--device", help="Warp's name of it; default: a GPU where there is one")
    parser.add_argument("--repeats", type=int, default=5, help="of which the median counts; default 5")
    options = parser.parse_args()
    try:
        return _run(options)
    except InputError as error:
        print(f"benchmark_gpu: error: {error}", file=sys.stderr)
        return 2


def _run(options: argparse.Namespace) -> int:
    robot = load_robot(options.robot)
    robot = dataclasses.replace(robot, friction=Friction(robot.friction.mu or FRICTION_MU))
    full = quick_model(robot, robot.actuation).drives.tendon.T
    rng = np.random.default_rng(0)
    simulator = Simulator(robot)
    simulator.set_inputs(rng.uniform(0.0, 0.5, len(full)) @ full)
    simulator.step(STEPS)
    start = time.perf_counter()
    simulator.step(10 * STEPS)
    alone = 10 * STEPS / (time.perf_counter() - start)
    print(f"{options.robot}, friction {robot.friction.mu:g}: simulator, one copy: {alone:.0f} steps/s")
    print(f"{'device':<10} {'copies':>7} {'env-steps/s':>12} {'of simulator':>13}")
    for size in (int(text) for text in options.sizes.split(",")):
        batch = WarpBatch(robot, size, options.device)
        batch.set_inputs(rng.uniform(0.0, 0.5, (size, len(full))) @ full)
        replay = batch.repeated(STEPS)
        seconds = []
        for _ in range(options.repeats):
            batch.synchronise()
            start = time.perf_counter()
            replay()
            batch.synchronise()
            seconds.append(time.perf_counter() - start)
        batch.qpos()  # raises where a copy diverged
        rate = size * STEPS / float(np.median(seconds))
        print(f"{batch.device:<10} {size:>7} {rate:>12.0f} {rate / alone:>12.2f}x", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
