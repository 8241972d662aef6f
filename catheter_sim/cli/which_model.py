"""Say which static model is accurate enough for given inputs, and fastest.

example:
  catheter-sim which-model spacer_disk --inputs in.csv
  catheter-sim which-model neuroendoscope --inputs in.csv --tolerance-percent 0.5 -o models.csv

Every static model that knows the robot goes through the file, row after row as `catheter-sim statics`, and
its tip is compared with the reference's: the simulation, or --reference, a static model. Inputs, units and
settings are those of `catheter-sim simulate`.
outputs: for each model the largest and mean distance of the tip [% of the robot's length], the largest angle
between the tips' frames [deg], and processor time of a row [ms]. The time is that of the solvers alone where
all models have one, else of the models as called from Python. The answer is the fastest model within the
tolerance; of those within half as long again the most accurate.
Exit status 1 where no model is within the tolerance.
"""

from __future__ import annotations

import argparse
import math

from catheter_sim.cli import arguments
from catheter_sim.files import check_output_file


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    arguments.add_robot(parser)
    arguments.add_inputs(parser)
    parser.add_argument("-o", "--output", metavar="MODELS.csv", help="file to write besides")
    parser.add_argument(
        "--tolerance-percent",
        metavar="P",
        type=arguments.positive,
        default=1.0,
        help="of the tip's place [%% of length]; default 1",
    )
    parser.add_argument(
        "--tolerance-deg",
        metavar="DEG",
        type=arguments.positive,
        default=math.inf,
        help="of the tip's frame; default any",
    )
    parser.add_argument(
        "--reference", metavar="NAME", default="simulation", help="with what all are compared"
    )
    arguments.add_plot(parser)


def run(options: argparse.Namespace) -> int:
    """Compare, print the table and the answer; 1 where no model is accurate enough."""
    if options.output is not None:
        check_output_file(options.output)
    arguments.check_plot(options.plot)
    from catheter_sim.cli.driven import drive, lines_named
    from catheter_sim.planning.models import compare_models
    from catheter_sim.public.planning import ModelChoice

    driven = drive(options)
    with lines_named(driven.table):
        result = compare_models(
            driven.specified,
            driven.commanded,
            driven.gravity_mps2,
            options.tolerance_percent,
            options.tolerance_deg,
            options.reference,
            progress=True,
        )
    found = ModelChoice(driven.specified, result, options.tolerance_percent, options.tolerance_deg)
    print(found.to_table())
    for item in result.errors:
        if item.why:
            print(f"{item.model} solves no row: {item.why}")
    if found.model is None:
        print(f"no model is within {options.tolerance_percent:g} % of {options.reference}")
    else:
        print(f"fastest within {options.tolerance_percent:g} % of {options.reference}: {found.model}")
    if options.output is not None:
        found.to_table().save(options.output)
        print(f"wrote {options.output}: {len(result.errors)} models")
    arguments.write_plot(found, options.plot)
    return 0 if found.model is not None else 1
