"""Control a catheter's joints along a trajectory: feedforward by a model, PID, disturbance observer.

example:
  catheter-sim control mitral_4dof@elongation -o results/control
  catheter-sim control mitral_4dof@elongation --trajectory t.csv --model te+pid --pid 0.01,0.2,0.0001 -o out
  catheter-sim control mitral_transseptal --trajectory t.csv --model pk --motors observer -o out

trajectory: a CSV with time_s [s], any of angle_<joint>_deg, and advance_mm; values lie on lines from row to
row. Without it the 4-DoF catheter bends both joints through 10, 40, 10, 60, 10 deg in 75 s, the stand-in for
the trajectory of Nayar 2023, Section IV-A, which is not printed. The paper's errors
are then printed beside it.
models: pk (pure kinematics), te (with the tendons' elongation), mk (modified kinematics of 2022); +pid adds
feedback on a tracker's angles. Without --model: pk, te and te+pid, the paper's three comparisons.
The controller takes the robot for its nominal set (mitral_4dof of mitral_4dof@elongation), or for --believed.
outputs:
  summary.csv    of each run and joint the root mean square error [deg], the mean effort [mm], and the
                 controller's share of it
  ratios.csv     of the errors of the runs
  a CSV per run  over time: desired, reached, measured, error; effort of model and controller [mm]
  control.png
"""

from __future__ import annotations

import argparse

from catheter_sim.cli import arguments
from catheter_sim.errors import InputError, cut
from catheter_sim.files import check_output_folder


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    arguments.add_robot(parser)
    parser.add_argument("--trajectory", metavar="T.csv", help="desired joint values over time")
    parser.add_argument(
        "--model",
        metavar="NAME",
        dest="models",
        action="append",
        help="pk, te, mk, each with or without +pid (may be repeated); default pk, te, te+pid",
    )
    parser.add_argument(
        "--pid",
        metavar="KP,KI,KD",
        default="0.01,0.2,0.0001",
        help="[mm/deg], [mm/(deg s)], [mm s/deg]; default as printed",
    )
    parser.add_argument(
        "--noise",
        metavar="DEG",
        type=arguments.not_negative,
        default=0.5,
        help="standard deviation of measured angles; default 0.5 (assumed)",
    )
    parser.add_argument(
        "--frame-error",
        metavar="DEG",
        type=arguments.number,
        default=0.0,
        help="angles are measured too large by",
    )
    parser.add_argument("--believed", metavar="ROBOT", help="what the controller takes the robot for")
    parser.add_argument(
        "--motors",
        choices=("none", "pd", "observer"),
        default="none",
        help="what turns the pairs: nothing in between, PD, PD with disturbance observer",
    )
    parser.add_argument(
        "--motor-gain",
        metavar="G",
        type=arguments.positive,
        default=1.0,
        help="over the nominal one; default 1",
    )
    parser.add_argument(
        "--dead-band",
        metavar="PAIR=MM",
        action="append",
        default=[],
        help="dead-band of a torsion pair that the feedforward compensates",
    )
    parser.add_argument(
        "--rate", metavar="HZ", type=arguments.positive, default=40.0, help="ticks a second; default 40"
    )
    parser.add_argument(
        "--seed",
        metavar="N",
        type=arguments.whole_number(0, 10**9),
        default=0,
        help="of the noise; default 0",
    )
    arguments.add_output(parser, "DIR", "folder to write, made where it does not exist")


def run(options: argparse.Namespace) -> int:
    """Control, print summary and ratios, write everything."""
    folder = check_output_folder(options.output)
    from catheter_sim.catalogue import load_robot
    from catheter_sim.public.runs import PAPER, believed_robot, controlled, setting_of, table_text

    robot = load_robot(options.robot, options.settings, "--set")
    believed = believed_robot(robot) if options.believed is None else load_robot(options.believed)
    setting = setting_of(
        _gains(options.pid),
        options.noise,
        options.frame_error,
        options.motors,
        options.motor_gain,
        _dead_bands(options.dead_band),
        options.rate,
        options.seed,
    )
    models = options.models or PAPER
    found = controlled(robot, believed, options.trajectory, models, setting, progress=True)
    names = found.save(folder)
    print(table_text(found))
    print(f"wrote {folder}: {', '.join(names)}")
    return 0


def _gains(text: str) -> list[float]:
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise InputError(f"--pid {cut(text, 100)}: three numbers KP,KI,KD are needed") from None


def _dead_bands(texts: list[str]) -> dict[str, float]:
    found = {}
    for text in texts:
        pair, _, width = text.partition("=")
        try:
            found[pair.strip()] = float(width)
        except ValueError:
            raise InputError(f"--dead-band {cut(text, 100)}: PAIR=MM is needed") from None
    return found
