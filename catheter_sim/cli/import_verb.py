"""Propose a data set's folder for files as a tracker or a logger wrote them.

examples:
  catheter-sim import take.csv --robot mitral_transseptal --spool-radius 10 -o my_data
  catheter-sim import take_001.csv take_002.csv --inputs motors.csv --robot my_robot.toml -o my_data
  catheter-sim import take.csv --robot my_robot.toml --unit counts --counts-per-turn 4096 -o my_data

FILE.csv is a table with one row of names (commas, semicolons or tabs), an export of OptiTrack Motive, or one
of Vicon Nexus. Nothing is asked: names, units in the head, the size of the numbers and the robot's own motion
tell which column is which channel, units, the clock, the tracker's axes, the signs of motors. Positions have
three coordinates, or two: of a plane, or of a camera's picture. What was taken is printed and stands in
DIR/dataset.toml beside its reason, with UNSURE where the file does not say it, to be changed there. DOUBT
says that numbers, read so, are far beyond the robot. The files are copied into DIR. Several files are several
trials.
"""

from __future__ import annotations

import argparse

from catheter_sim.cli import arguments
from catheter_sim.diagnosis.mapping import ANGLES, COUNTS, UNITS
from catheter_sim.errors import InputError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    parser.add_argument("files", metavar="FILE.csv", nargs="+", help="the trials' files, laid out alike")
    parser.add_argument(
        "--robot", metavar="ROBOT", required=True, help="robot id (see `list`) or path of a .toml"
    )
    arguments.add_output(parser, "DIR", "folder to write; it has no dataset.toml yet")
    parser.add_argument(
        "--inputs", metavar="LOG.csv", help="file of the inputs, where they are not in FILE.csv"
    )
    parser.add_argument(
        "--spool-radius",
        metavar="MM",
        type=arguments.number,
        help="of the motors' spools [mm]; else it is guessed",
    )
    parser.add_argument(
        "--unit",
        choices=ANGLES,
        default="",
        help="of motors' angles (counts are an encoder's); else by their names, or guessed",
    )
    parser.add_argument(
        "--counts-per-turn",
        metavar="N",
        type=arguments.number,
        help="of the motors' encoders, 4096 say; else it is guessed",
    )
    parser.add_argument(
        "--input-unit",
        choices=sorted({*UNITS["mm"], *UNITS["N"]}),
        default="",
        help="of displacements or tensions whose names state none; else it is guessed",
    )
    parser.add_argument(
        "--point-unit",
        choices=sorted(UNITS["mm"]),
        default="",
        help="of positions whose names state none; else it is guessed",
    )
    parser.add_argument(
        "--rate", metavar="HZ", type=arguments.number, help="of a file that counts frames alone"
    )
    parser.add_argument(
        "--gravity", metavar="GX,GY,GZ", help="in the base frame [m/s^2]; default not stated, 0,0,0"
    )
    parser.add_argument(
        "--motion",
        choices=("held", "dynamic"),
        help="whether each row was held until at rest; default held, as a guess",
    )


def run(options: argparse.Namespace) -> int:
    """Write the folder; print what was taken, and how sure it is."""
    above_zero = (
        ("--spool-radius", options.spool_radius),
        ("--counts-per-turn", options.counts_per_turn),
        ("--rate", options.rate),
    )
    for name, value in above_zero:
        if value is not None and not value > 0.0:
            raise InputError(f"{name} {value:g}: must be above 0")
    if options.counts_per_turn and options.unit not in ("", COUNTS):
        raise InputError(f"--counts-per-turn: goes with --unit {COUNTS}, not with {options.unit}")
    from catheter_sim.diagnosis.faults_of_columns import beyond_robot
    from catheter_sim.importing.propose import Asked, import_files

    asked = Asked(
        spool_radius_mm=options.spool_radius,
        rate_Hz=options.rate,
        gravity_mps2=None if options.gravity is None else arguments.gravity(options.gravity),
        motion=options.motion or "",
        log=options.inputs,
        input_unit=options.input_unit,
        motor_unit=options.unit,
        counts_per_turn=options.counts_per_turn,
        point_unit=options.point_unit,
    )
    proposal, dataset = import_files(options.files, options.robot, options.output, asked)
    for guess in proposal.lines:
        print(guess)
    for item in beyond_robot(dataset.robot, dataset.trials):
        entry = proposal.table.get(item.column) or proposal.table.get(item.column.rsplit("_", 2)[0]) or {}
        print(f"DOUBT   {item.words(entry.get('unit', ''), entry.get('spool_radius_mm', 0.0))}")
    if proposal.ignored:
        print(f"not used: {', '.join(proposal.ignored)}")
    rows = sum(len(trial.inputs) for trial in dataset.trials)
    unsure = sum(not guess.sure for guess in proposal.lines)
    print(
        f"wrote {options.output}: {len(dataset.trials)} trials, {rows} rows; "
        f"{unsure} of {len(proposal.lines)} things are UNSURE, see dataset.toml"
    )
    print(f"next: catheter-sim diagnose {options.output} -o {options.output}_report")
    return 0
