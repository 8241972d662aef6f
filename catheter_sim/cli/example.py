"""Copy an example that comes with the package, or list them.

examples:
  catheter-sim example
  catheter-sim example worn_catheter
  catheter-sim example opencr_v4 -o my_copy

The names, units and files are those that the other verbs take; what to try with a copy is printed.
"""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments."""
    parser.add_argument("name", metavar="NAME", nargs="?", help="which; without a name they are listed")
    parser.add_argument("-o", "--output", metavar="PATH", help="where to; default NAME, here")


def run(options: argparse.Namespace) -> int:
    """List the examples, or copy one and say what to try with it."""
    from catheter_sim.errors import InputError
    from catheter_sim.examples import copy_example, examples

    if options.name is None:
        if options.output is not None:
            raise InputError(f"-o: a name is needed; choices: {', '.join(examples())}")
        for name, item in examples().items():
            print(f"{name:26} {item.says}")
        return 0
    target = Path(options.output or options.name)
    copied = copy_example(options.name, target)
    print(f"wrote {target}: {copied.says}")
    print(f"next: {copied.next_command.replace('{}', str(target))}")
    return 0
