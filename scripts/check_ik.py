"""Count how many random targets of each robot `ik` reaches, in the simulation.

    python scripts/check_ik.py --targets 1000 -o results/check_ik
    python scripts/check_ik.py neuroendoscope chest_tube --targets 200 -o results/check_ik

Random inputs within each robot's ranges are simulated, some rows in a row from rest; the tips are the
targets, in the same order (a robot with hysteresis reaches some of them only by the way that it came). `ik`
finds inputs, once by the twin alone and once with corrections by simulation, and both are simulated anew.
Then as many targets out of reach: points beyond the robot's length, and each must be called unreachable.
Prints a row for each robot, and writes `check_ik.csv` and every round trip. Begun again with the same folder,
it goes on where it ended. `turned_deg` is how far the
tip's axis is from where it was, which was not asked: robots with inputs to spare come another way.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.files import placed_when_whole
from catheter_sim.planning.inverse import (
    CORRECTIONS,
    InputPlan,
    Targets,
    inverse_kinematics,
    random_levels,
    targets_of,
)
from catheter_sim.planning.models import inputs_at, plan_drives
from catheter_sim.public.data import Listing, listing_of
from catheter_sim.simulation.replay import simulate
from catheter_sim.tables import Table

ROBOTS = (
    "chest_tube",
    "chest_tube_section",
    "mitral_transseptal",
    "mitral_4dof",
    "neuroendoscope",
    "neuroendoscope_section",
    "notched_wrist",
    "spacer_disk",
)
ROWS = 10  # of a file of targets
STILL = np.zeros(3)  # no gravity
PERCENT, DEGREES = 0.1, 0.2  # of the length, and of the tip's direction: what is asked of a round trip
FAR = 1.3  # of the robot's length: how far away targets out of reach are
OUT_OF_REACH = 20  # of these
COLUMNS = (
    *("robot", "targets", "twin_percent", "twin_max_percent", "corrected_percent", "max_percent"),
    "turned_deg",
    *("corrections", "called_reachable", "unreachable_said", "s_per_target"),
)


def tips(robot_id: str, inputs_rows: object) -> tuple[Array, Array]:
    """Return the simulated tips [mm] and the directions of their axes, shape (r, 3) each."""
    run = simulate(load_robot(robot_id), inputs_rows, STILL)  # type: ignore[arg-type]
    return (
        1e3 * np.array([item.p_w[-1] for item in run.postures]),
        np.array([item.R_w[-1][:, 2] for item in run.postures]),
    )


def targets_at(robot_id: str, tip_mm: Array, length_m: float) -> Targets:
    """Return tips as targets, a second apart."""
    columns = {f"tip_{axis}_mm": tip_mm[:, k] for k, axis in enumerate("xyz")}
    return targets_of(load_robot(robot_id), Table(np.arange(float(len(tip_mm))), columns), length_m)


def round_trips(robot_id: str, count: int, seed: int, folder: Path) -> Listing:
    """Return a row for each target: what each way of solving misses of it, in a simulation of its own.

    Each file of targets is kept in `folder` when it is done, and not done again.
    """
    folder.mkdir(parents=True, exist_ok=True)
    rows: list[dict[str, object]] = []
    for number in range(math.ceil(count / ROWS)):
        path = folder / f"seed_{seed}_file_{number:03d}.json"
        if not path.exists():
            with placed_when_whole(path) as part:
                found = round_trips_of_a_file(robot_id, np.random.default_rng([seed, number]))
                part.write_text(json.dumps(found, indent=1))
            print(f"{robot_id}: file {number + 1} of {math.ceil(count / ROWS)}", file=sys.stderr, flush=True)
        rows += json.loads(path.read_text())
    columns = {name: [row[name] for row in rows[:count]] for name in rows[0]}
    return listing_of(f"Round trips of {robot_id}", columns)


def round_trips_of_a_file(robot_id: str, rng: np.random.Generator) -> list[dict[str, object]]:
    """Return a row for each of `ROWS` targets in a row from rest."""
    robot = load_robot(robot_id)
    drives = plan_drives(robot)
    levels = random_levels(drives, ROWS, rng)
    tip, axis = tips(robot_id, inputs_at(drives, levels, np.arange(float(ROWS))))
    targets = targets_at(robot_id, tip, drives.length_m)
    began = time.process_time()
    alone = inverse_kinematics(robot, targets, drives, STILL, None)
    plan = inverse_kinematics(robot, targets, drives, STILL, CORRECTIONS)
    spent = (time.process_time() - began) / ROWS
    for_twin, _ = tips(robot_id, alone.inputs)
    again, turned = tips(robot_id, plan.inputs)
    return [
        {
            "twin_percent": _percent(for_twin[row] - tip[row], targets),
            "percent": _percent(again[row] - tip[row], targets),
            "deg": float(np.degrees(np.arccos(np.clip(axis[row] @ turned[row], -1.0, 1.0)))),
            "corrections": plan.corrections,
            "reachable": bool(plan.reachable[row]),
            "limit": plan.limits[row],
            "s": spent,
        }
        for row in range(ROWS)
    ]


def said_unreachable(robot_id: str, count: int, seed: int) -> tuple[int, InputPlan]:
    """Return how many of so many points beyond the robot's length are called unreachable, and their plan."""
    robot = load_robot(robot_id)
    drives = plan_drives(robot)
    toward = np.random.default_rng(seed).standard_normal((count, 3))
    far = FAR * 1e3 * drives.length_m * toward / np.linalg.norm(toward, axis=1, keepdims=True)
    plan = inverse_kinematics(robot, targets_at(robot_id, far, drives.length_m), drives, STILL, 0)
    said = [not can and bool(limit) for can, limit in zip(plan.reachable, plan.limits, strict=True)]
    return sum(said), plan


def summary(robot_id: str, trips: Listing, out_of_reach: int, said: int) -> dict[str, object]:
    """Return a robot's row of the table."""
    twin, percent = (np.array(trips.column(name)) for name in ("twin_percent", "percent"))
    deg = np.array(trips.column("deg"))
    good = percent <= PERCENT
    return {
        "robot": robot_id,
        "targets": len(trips),
        "twin_percent": 100.0 * float(np.mean(twin <= PERCENT)),
        "twin_max_percent": float(twin.max()),
        "corrected_percent": 100.0 * float(good.mean()),
        "max_percent": float(percent.max()),
        "turned_deg": float(deg[good].max(initial=0.0)),
        "corrections": max(trips.column("corrections")),
        "called_reachable": 100.0 * float(np.mean(trips.column("reachable"))),
        "unreachable_said": f"{said} of {out_of_reach}",
        "s_per_target": float(np.mean(trips.column("s"))),
    }


def main(argv: Sequence[str] | None = None) -> int:
    """Check; 1 where a round trip misses too much, or a point out of reach is called reachable."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("robots", nargs="*", metavar="ROBOT", default=list(ROBOTS))
    parser.add_argument("--targets", type=int, default=1000, metavar="N", help="of each robot")
    parser.add_argument("--seed", type=int, default=1, help="of all draws (default 1)")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="DIR")
    options = parser.parse_args(argv)
    options.output.mkdir(parents=True, exist_ok=True)
    rows, good = [], True
    for robot_id in options.robots:
        trips = round_trips(robot_id, options.targets, options.seed, options.output / robot_id)
        trips.save(options.output / f"{robot_id}.csv")
        said, _ = said_unreachable(robot_id, OUT_OF_REACH, options.seed)
        rows.append(summary(robot_id, trips, OUT_OF_REACH, said))
        good = good and rows[-1]["corrected_percent"] == 100.0 and said == OUT_OF_REACH
        table = Listing("Round trips", COLUMNS, tuple(rows))
        table.save(options.output / "check_ik.csv")
        print(table, flush=True)
    return 0 if good else 1


def _percent(missed: Array, targets: Targets) -> float:
    return 100.0 * float(np.linalg.norm(missed)) / targets.length_mm


if __name__ == "__main__":
    sys.exit(main())
