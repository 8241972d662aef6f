"""Sample the points that a robot's tip can reach.

example:
  catheter-sim workspace neuroendoscope -o points.csv --plot points.png
  catheter-sim workspace chest_tube -o points.csv --samples 500 --limit tension_base_right_N=0,40

Inputs are drawn evenly within their ranges, every second draw with tendons left slack at random. Each is
solved on the robot's fast model from rest, with causes and gravity. It is left out where nothing balances.
Ranges and --limit are those of `catheter-sim ik`.
outputs: a row for each point: the inputs' columns in their units, tip_x_mm, tip_y_mm, tip_z_mm [mm],
and the direction of the tip's axis (tip_direction_x, _y, _z). Same seed, same points.
"""

from __future__ import annotations

import argparse

from catheter_sim.cli import arguments
from catheter_sim.files import check_output_file


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    arguments.add_robot(parser)
    arguments.add_gravity(parser)
    arguments.add_output(parser, "POINTS.csv", "file to write")
    parser.add_argument(
        "--samples",
        metavar="N",
        type=arguments.whole_number(1, 100_000),
        default=2000,
        help="draws; default 2000",
    )
    parser.add_argument(
        "--seed",
        metavar="N",
        type=arguments.whole_number(0, 10**9),
        default=0,
        help="of the draws; default 0",
    )
    arguments.add_limits(parser)
    arguments.add_plot(parser)


def run(options: argparse.Namespace) -> int:
    """Draw, solve, write and say how far the tip comes."""
    check_output_file(options.output)
    arguments.check_plot(options.plot)
    import numpy as np

    from catheter_sim.catalogue import load_robot
    from catheter_sim.planning.inverse import workspace
    from catheter_sim.planning.models import plan_drives, with_limits
    from catheter_sim.public.planning import Workspace

    robot = load_robot(options.robot, options.settings, "--set")
    drives = with_limits(plan_drives(robot), arguments.limits(options.limits), "--limit")
    gravity = np.array(arguments.gravity(options.gravity))
    cloud = workspace(robot, drives, gravity, options.samples, options.seed, progress=True)
    found = Workspace(robot, cloud)
    found.to_table().save(options.output)
    for name, (low, high) in found.extent().items():
        print(f"{name}: {low:.4g} to {high:.4g}")
    rejected = f"; {cloud.rejected} draws without a balance" if cloud.rejected else ""
    print(f"wrote {options.output}: {len(found)} points{rejected}")
    arguments.write_plot(found, options.plot)
    return 0
