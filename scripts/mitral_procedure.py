"""Implants a clip on the mitral valve of random hearts, through the septum, and says how well.

    python scripts/mitral_procedure.py -o results/procedure [--anatomies 100] [--seed 0] [--jobs 2] [--video]
    python scripts/mitral_procedure.py -o results/procedure_tube --robot mitral_transseptal@tube
    python scripts/mitral_procedure.py -o results/procedure_path --robot mitral_transseptal@tube --path

Nayar 2022, Section IV-E, simulated: introduce, align, bend, advance, orient, open, clip, close. Prints how
many implants end within 1 mm and 3 deg of their target, and the force on the atrium's wall; writes
procedure.csv, procedure.json and, with --video, procedure.mp4 of the first anatomy. The controller knows
pure kinematics only, with --calibrated also the slack, play and stretch of the robot's drives; where they
are not ideal it is corrected by a tracker at the implant. With --path the tendons run through the rigid
curved phantom of Section IV-D first (180 deg of turn at mu 0.2, assumed), of which the controller knows
nothing. Exit status 0; 1 where fewer than 95 in 100 succeed; 2 for bad input.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from catheter_sim.catalogue import load_robot
from catheter_sim.errors import InputError
from catheter_sim.procedure.heart import random_anatomy
from catheter_sim.procedure.plan import plan
from catheter_sim.procedure.series import film, run_series, summary_text, write_series
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.validation.mitral import tortuous

TRANSSEPTAL_ROBOTS = ("mitral_transseptal", "mitral_transseptal@tube")
NEEDED = 0.95  # share of anatomies


def main() -> int:
    """Run the series; return the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder to write")
    parser.add_argument("--anatomies", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--robot", default="mitral_transseptal", help="id, or path of a .toml")
    parser.add_argument("--jobs", type=int, default=1, help="processes to work with")
    parser.add_argument("--calibrated", action="store_true", help="the controller knows the drives' losses")
    parser.add_argument("--path", action="store_true", help="through the curved path of Section IV-D")
    parser.add_argument("--video", action="store_true", help="write procedure.mp4 of the first anatomy")
    options = parser.parse_args()
    try:
        return run(options)
    except InputError as error:
        print(f"mitral_procedure: {error}", file=sys.stderr)
        return 2


def run(options: argparse.Namespace) -> int:
    """Run the series as asked; return 0 or 1.

    Raises:
        InputError: bad input.
    """
    for name in ("anatomies", "jobs"):
        if getattr(options, name) < 1:
            raise InputError(f"--{name} {getattr(options, name)}: must be at least 1")
    if options.seed < 0:
        raise InputError(f"--seed {options.seed}: must not be negative")
    robot = load_robot(options.robot)
    if not isinstance(robot, CatheterRobot):
        raise InputError(
            f"{options.robot}: not a catheter; choices: mitral_transseptal, mitral_transseptal@tube"
        )
    known = robot if options.calibrated else None
    if options.path:
        robot = tortuous(robot)
    first = np.random.default_rng([options.seed, 0])
    way = plan(robot, random_anatomy(first))  # refuses a robot of another design before the series
    try:
        options.output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{options.output}: cannot be made: {error.strerror or error}") from None
    attempts = run_series(robot, options.anatomies, options.seed, known, options.jobs)
    write_series(attempts, options.output)
    print(summary_text(robot, attempts))
    if options.video:
        film(robot, way, first, options.output / "procedure.mp4", known, progress=True)
    good = sum(item.succeeded for item in attempts)
    return 0 if good >= NEEDED * len(attempts) else 1


if __name__ == "__main__":
    sys.exit(main())
