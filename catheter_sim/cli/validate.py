"""Check the simulation against analytic models and published values.

example:
  catheter-sim validate -o results/validation
  catheter-sim validate neuroendoscope_section -o results/validation
  catheter-sim validate --paper neuroendoscope_2016 -o results/paper

Prints one line per check (ours, analytic, published, error, tolerance, source; units in the line)
and leaves report.html, the table as text and JSON, and plots in the output folder. Without ROBOT:
every robot that has checks. With --paper the report begins with what that paper prints, item by item: the
printed figure, ours, and what ours is worth. The pictures are those of the checks of its robots. Exit
status 1 where a line is out of its tolerance.
"""

from __future__ import annotations

import argparse

from catheter_sim.cli import arguments
from catheter_sim.errors import InputError
from catheter_sim.files import check_output_folder


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    parser.add_argument("robots", metavar="ROBOT", nargs="*", help="robot id (see `list`); default all")
    parser.add_argument("--paper", metavar="NAME", default="", help="what one paper prints, and its robots")
    arguments.add_output(parser, "DIR", "folder to write, made where it does not exist")


def run(options: argparse.Namespace) -> int:
    """Validate, print the table; 1 where a line is out of tolerance."""
    folder = check_output_folder(options.output)
    if options.paper and options.robots:
        raise InputError(f"{options.robots[0]}: --paper has robots of its own")
    from catheter_sim.validation.report import validate

    validation = validate(list(options.robots), folder, progress=True, paper=options.paper)
    print(validation.table_text())
    return 0 if validation.passed else 1
