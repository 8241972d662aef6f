"""Drive the MuJoCo robot with the inputs of a CSV file and write its outputs row by row.

example:
  catheter-sim simulate neuroendoscope_section --inputs in.csv -o out.csv --columns tip_x_mm,tip_z_mm
  catheter-sim simulate neuroendoscope --inputs in.csv -o out.csv --gravity 0,0,-9.81 --set friction.mu=0

inputs: a CSV with a header: time_s [s] and the robot's channels, each with its unit in its name
(tension_right_N, displacement_3_mm). Forces are force_tip_x_N ..., moment_tip_x_Nm ..., and on the far face
of body k force_body_<k>_x_N ..., moment_body_<k>_x_Nm ... A channel that is left out is zero. The robot
starts at rest, without history; inputs move linearly from row to row. At most 100000 rows; time_s may
start anywhere (epoch seconds, say): the robot's clock starts at the first row.
A row is held until the robot has come to rest. With --dynamic only the first one is. From there the robot
moves by its masses' inertia and its own damping (dynamics.damping_time_s = eta / E of its material,
dynamics.tendon_damping_N_s_per_m, dynamics.servo_lag_s), and time_s is the motion's time. Two rows that are
a microsecond apart are a jump.
outputs: time_s and tip [mm], tip_qw.. (quaternion), body_<k> [mm], marker_<name> [mm], joint_<name> [deg],
tension_<tendon> [N]; `catheter-sim list ROBOT` shows the inputs and outputs of a robot.
settings: --set KEY=VALUE with the dotted keys of the robot's .toml form, or of an effect:
effects.tendon_friction.mu=0.1. A simulation that diverges leaves the rows before it. An input beyond what
the robot can follow gets a warning on standard error.
measured trials: --inputs takes a trial's own file, or a data set's folder with --trial NAME. Columns, gravity
and motion are those of the dataset.toml that lists it. What was measured is written as measured_<column>, the
computed value minus it as error_<column>. So are output columns of a file that belongs to no data set.
"""

from __future__ import annotations

import argparse

from catheter_sim.cli import arguments
from catheter_sim.files import check_output_file


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    arguments.add_robot(parser)
    arguments.add_inputs(parser)
    arguments.add_output(parser, "OUT.csv", "file to write")
    arguments.add_columns(parser)
    parser.add_argument(
        "--dynamic",
        action="store_true",
        help="wait for rest at the first row alone: time_s is the motion's time",
    )
    parser.add_argument(
        "--most-steps",
        metavar="N",
        type=arguments.whole_number(1, 10**12),
        help="steps that --dynamic may take; default 10000000, an hour of computing",
    )


def run(options: argparse.Namespace) -> int:
    """Simulate; write every row that was reached."""
    check_output_file(options.output)
    from catheter_sim.cli.driven import drive, lines_named, warn_of_limits, with_lines, write_outputs
    from catheter_sim.core.motion import MOST_STEPS, require_steps
    from catheter_sim.core.posture import finite_rows
    from catheter_sim.errors import SimulationDiverged
    from catheter_sim.simulation.replay import simulate

    driven = drive(options)
    dynamic = options.dynamic or driven.moved
    if dynamic:
        clock, most = driven.table.time_s, options.most_steps or MOST_STEPS
        said = "with --dynamic" if options.dynamic else "in motion"
        require_steps(driven.robot, clock, most, driven.table.where, said, "--most-steps")
    with lines_named(driven.table):
        result = simulate(
            driven.specified,
            driven.commanded,
            driven.gravity_mps2,
            dynamic=dynamic,
            progress=True,
        )
    warn_of_limits(driven)
    rows = finite_rows(result.postures)
    write_outputs(driven, result.postures[:rows], options.output)
    if rows < len(result.postures) or result.failure is not None:
        kept = f"rows before it in {options.output}: {rows}"
        what = result.failure or "the simulation diverged: no finite posture"
        failure = with_lines(what, driven.table).removeprefix(f"{driven.table.where}: ")
        raise SimulationDiverged(f"{driven.table.row(rows)}: {failure}; {kept}")
    print(f"wrote {options.output}: {len(result.postures)} rows")
    return 0
