"""Put the inputs of a CSV file through an analytic model and write its outputs row by row.

example:
  catheter-sim statics neuroendoscope_section --model fkm_exact_arm --inputs in.csv -o out.csv
  catheter-sim statics spacer_disk --model PRB --inputs in.csv -o out.csv --gravity 0,0,-9.81

Inputs, outputs, units and settings are those of `catheter-sim simulate`, so that one file serves
both. History counts where the model has one (friction). `catheter-sim list` shows the models of
each robot.
"""

from __future__ import annotations

import argparse

from catheter_sim.cli import arguments
from catheter_sim.files import check_output_file


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    arguments.add_robot(parser)
    parser.add_argument("--model", metavar="NAME", required=True, help="static model, see `list`")
    arguments.add_inputs(parser)
    arguments.add_output(parser, "OUT.csv", "file to write")
    arguments.add_columns(parser)


def run(options: argparse.Namespace) -> int:
    """Solve every row and write them."""
    check_output_file(options.output)
    from catheter_sim.cli.driven import drive, lines_named, warn_of_limits, write_outputs
    from catheter_sim.core.posture import finite_rows
    from catheter_sim.errors import InputError
    from catheter_sim.theory.static_models import static_model

    driven = drive(options)
    model = static_model(options.model, driven.specified, options.robot)
    with lines_named(driven.table, always=True):
        result = model.solve(driven.specified, driven.commanded, driven.gravity_mps2)
    row = finite_rows(result.postures)
    if row < len(result.postures):
        raise InputError(f"{driven.table.row(row)}: static model {options.model!r} gives no finite posture")
    warn_of_limits(driven)
    write_outputs(driven, result.postures, options.output)
    print(f"wrote {options.output}: {len(result.postures)} rows")
    return 0
