"""Find inputs that bring a robot to targets, or as near as its limits let it.

example:
  catheter-sim ik mitral_transseptal --targets targets.csv -o inputs.csv
  catheter-sim ik neuroendoscope --targets t.csv -o inputs.csv --limit tension_distal_right_N=0,0.5

targets: a CSV with any of tip_x_mm, tip_y_mm, tip_z_mm [mm], the direction of the tip's axis as
tip_direction_x, _y, _z, and every other output in mm or deg (angle_bending_deg, body_15_x_mm); an empty
cell asks nothing. A column time_s [s] may be there; without it rows are a second apart.
Each target is solved on the robot's fast model by bounded least squares, after the rows before it, so that
the hysteresis of a robot that rubs is compensated. Then the rows are simulated, and what the
simulation misses is corrected (--corrections, 0: simulated and not corrected; --twin-only: not simulated).
limits: a catheter's joints have their own; tendons are pulled up to what bends a segment by 90 deg
without friction (assumed), unless --limit says otherwise, in the unit of the column.
outputs: OUT.csv holds time_s and the inputs, as `simulate --inputs` takes them. OUT_report.csv beside it has
the targets, what is reached of them, ik_error_mm, ik_error_deg, ik_reachable and ik_limit. ik_reachable is 1
within --tolerance-mm (default 0.1 % of the length) and --tolerance-deg (default 0.2), else 0. For a target
out of reach, ik_limit has the limits that bind at the nearest posture found, or `workspace` where none
does.
"""

from __future__ import annotations

import argparse

from catheter_sim.cli import arguments
from catheter_sim.files import check_output_file


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    arguments.add_robot(parser)
    parser.add_argument("--targets", metavar="T.csv", required=True, help="targets, one a row")
    arguments.add_gravity(parser)
    arguments.add_output(parser, "OUT.csv", "file of inputs to write; its report goes beside it")
    arguments.add_limits(parser)
    parser.add_argument(
        "--tolerance-mm", metavar="MM", type=arguments.positive, help="a reached target is missed by less"
    )
    parser.add_argument(
        "--tolerance-deg", metavar="DEG", type=arguments.positive, help="the same of angles; default 0.2"
    )
    how = parser.add_mutually_exclusive_group()
    how.add_argument(
        "--corrections",
        metavar="N",
        type=arguments.whole_number(0, 20),
        default=3,
        help="corrections by simulation, at most; default 3",
    )
    how.add_argument(
        "--twin-only", action="store_true", help="do not simulate: faster, errors are the fast model's"
    )
    arguments.add_plot(parser)


def run(options: argparse.Namespace) -> int:
    """Solve, write inputs and report, say how many targets are reached."""
    from catheter_sim.public.planning import InverseKinematics, report_path

    check_output_file(options.output)
    check_output_file(report_path(options.output))
    arguments.check_plot(options.plot)
    import numpy as np

    from catheter_sim.catalogue import load_robot
    from catheter_sim.planning.inverse import (
        TOLERANCE_DEG,
        TOLERANCE_SHARE,
        Tolerance,
        inverse_kinematics,
        targets_of,
    )
    from catheter_sim.planning.models import plan_drives, with_limits
    from catheter_sim.tables import read_table

    robot = load_robot(options.robot, options.settings, "--set")
    gravity = np.array(arguments.gravity(options.gravity))
    drives = with_limits(plan_drives(robot), arguments.limits(options.limits), "--limit")
    targets = targets_of(robot, read_table(options.targets, spacing_s=1.0), drives.length_m)
    within = Tolerance(
        options.tolerance_mm or TOLERANCE_SHARE * targets.length_mm, options.tolerance_deg or TOLERANCE_DEG
    )
    corrections = None if options.twin_only else options.corrections
    plan = inverse_kinematics(robot, targets, drives, gravity, corrections, within, progress=True)
    found = InverseKinematics(robot, plan)
    report = found.save(options.output)
    reached = int(plan.reachable.sum())
    by = "twin" if plan.simulated is None else "simulation"
    worst = plan.error_mm[plan.reachable].max(initial=0.0)
    print(f"reached: {reached} of {len(found)} targets, to within {worst:.3g} mm by the {by}")
    for limit in sorted({item for item in plan.limits if item}):
        rows = [row for row, item in enumerate(plan.limits) if item == limit]
        nearest = min(plan.error_mm[row] for row in rows)
        print(f"out of reach: {len(rows)}, {limit} binds; the nearest is missed by {nearest:.3g} mm")
    print(f"wrote {options.output}: {len(found)} rows of inputs; {report}")
    arguments.write_plot(found, options.plot)
    return 0
