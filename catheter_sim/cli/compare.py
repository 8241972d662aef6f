"""Compare two CSV files column by column: rows matched by time, a table, a picture.

examples:
  catheter-sim compare simulated.csv statics.csv
  catheter-sim compare simulated.csv measured.csv --columns tip_x_mm,tip_z_mm -o apart.png

Both files have time_s [s] and columns whose names end in their unit; each clock starts at its own first row.
The second file is taken linearly between two of its rows. Differences are the second's minus the first's.
Of a trial's own file, which a dataset.toml beside it lists, the measured columns are taken, as that says.
"""

from __future__ import annotations

import argparse

from catheter_sim.cli import arguments
from catheter_sim.errors import InputError
from catheter_sim.files import check_output_file


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    parser.add_argument("first", metavar="A.csv", help="with whose rows the other's are matched")
    parser.add_argument("second", metavar="B.csv", help="what is compared with it")
    parser.add_argument("--columns", metavar="A,B,...", help="which; default all that both have")
    parser.add_argument("-o", "--output", metavar="OUT.png", help="picture of both and their difference")


def run(options: argparse.Namespace) -> int:
    """Print the table; write the picture where one is wanted."""
    if options.output is not None:
        check_output_file(options.output)
        if not options.output.endswith((".png", ".pdf", ".svg")):
            raise InputError(f"{options.output}: choices: .png, .pdf, .svg")
    from catheter_sim.diagnosis.recording import table_to_compare
    from catheter_sim.files import placed_when_whole
    from catheter_sim.tables import compare_tables

    (first, said), (second, also_said) = map(table_to_compare, (options.first, options.second))
    for line in filter(None, (said, also_said)):
        print(line)
    comparison = compare_tables(first, second, arguments.columns(options.columns))
    print(comparison.text())
    if options.output is not None:
        with placed_when_whole(options.output) as path:
            comparison.figure().savefig(path, dpi=150)
        print(f"wrote {options.output}")
    return 0
