"""Tell a robot's posture, and how sure it is, from what its actuators measured.

example:
  catheter-sim sense chest_tube_section --readings r.csv -o shape.csv --noise-tension 0.1
  catheter-sim sense mitral_transseptal --readings r.csv -o shape.csv --noise-displacement 0.02
  catheter-sim sense neuroendoscope_section --readings r.csv -o shape.csv --uncertain friction.mu=0.05

readings: a CSV with time_s [s] and the robot's input columns as they were measured (tension_active_N,
displacement_bending_mm). Add any output in mm, deg or N that was measured too (tension_bending_N of a
catheter that is driven by displacements, angle_bending_deg of a tracker). These make the regions
narrower, and an empty cell of theirs was not measured. Friction's history is followed row after row.
noise: standard deviations of the readings, white. --step-tension is the step in which tensions are read or
set, as by a motor's current: 0.938 N of the measured chest_tube_section, whose printed tensions are its
multiples.
uncertain: numbers of the robot that are known only within a range, KEY=HALF, in the key's unit. By default
those that differ between specimens of a published robot (elastic constant 3 %, friction 20 %, moment arm
1 % of a neuroendoscope_section); --uncertain none: the robot is as specified.
outputs: each column with the ends of the region that holds the true value in 95 % of cases: tip_x_mm,
tip_x_mm_low, tip_x_mm_high. Regions are those of each column and row by itself, to first order in noise and
ranges.
"""

from __future__ import annotations

import argparse

from catheter_sim.cli import arguments
from catheter_sim.errors import InputError, cut
from catheter_sim.files import check_output_file


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    arguments.add_robot(parser)
    parser.add_argument("--readings", metavar="R.csv", required=True, help="what was measured over time")
    arguments.add_gravity(parser)
    arguments.add_output(parser, "SHAPE.csv", "file to write")
    for name, unit, what in (
        ("tension", "N", "measured tensions"),
        ("displacement", "MM", "measured inputs in mm"),
        ("position", "MM", "measured outputs in mm"),
        ("angle", "DEG", "measured angles"),
    ):
        parser.add_argument(
            f"--noise-{name}",
            metavar=unit,
            type=arguments.not_negative,
            default=0.0,
            help=f"standard deviation of {what}; default 0",
        )
    parser.add_argument(
        "--step-tension",
        metavar="N",
        type=arguments.not_negative,
        default=0.0,
        help="step in which tensions are read or set; default 0",
    )
    parser.add_argument(
        "--uncertain",
        metavar="KEY=HALF",
        action="append",
        help="half the range of a number of the robot, or `none`; may be repeated",
    )
    arguments.add_columns(parser)
    arguments.add_plot(parser)


def run(options: argparse.Namespace) -> int:
    """Sense every row and write it with its region."""
    check_output_file(options.output)
    arguments.check_plot(options.plot)
    from catheter_sim.catalogue import load_robot
    from catheter_sim.channels import check_output_channels
    from catheter_sim.cli.driven import lines_named
    from catheter_sim.public.planning import sense, sensed_columns
    from catheter_sim.tables import read_table, write_table

    robot = load_robot(options.robot, options.settings, "--set")
    names = arguments.columns(options.columns)
    check_output_channels(robot, names or (), "--columns")
    table = read_table(options.readings, spacing_s=1.0)
    with lines_named(table):
        found = sense(
            robot,
            table,
            options.noise_tension,
            options.noise_displacement,
            options.noise_position,
            options.noise_angle,
            _uncertain(options.uncertain),
            names or sensed_columns(robot),
            arguments.gravity(options.gravity),
            step_tension_N=options.step_tension,
        )
    write_table(found.to_table(), options.output)
    half = 0.5 * (found.sensed.high - found.sensed.low).max(axis=0)
    for name, size in zip(found.sensed.columns, half, strict=True):
        parts = ", ".join(f"{cause} {part[name]:.3g}" for cause, part in found.causes().items())
        print(f"{name}: 95 % within +-{size:.3g} at the least sure row (standard deviations: {parts})")
    print(f"wrote {options.output}: {len(found)} rows")
    arguments.write_plot(found, options.plot)
    return 0


def _uncertain(texts: list[str] | None) -> dict[str, float] | None:
    if texts is None:
        return None
    found = {}
    for text in texts:
        if text == "none" and len(texts) == 1:
            return {}
        key, _, half = text.partition("=")
        try:
            found[key.strip()] = float(half)
        except ValueError:
            raise InputError(f"--uncertain {cut(text, 100)}: KEY=HALF, or none alone, is needed") from None
    return found
