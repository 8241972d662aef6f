"""Measure this package beside other programs, where they are installed (extra peers).

    python scripts/peers.py
    python scripts/peers.py --json --turns 5

All bend one rod of 20 elements by a force at its tip: the error against an independent reference, and the
time of an equilibrium, of a step and of a fit. Then the static models of spacer_disk beside their authors'
program. The programs take turns, each figure is a median over the turns.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))  # where the programs' files lie

from catheter_sim.cli.arguments import whole_number
from catheter_sim.progress import EVERY_S, Stages
from peers import table, tdcr_modeling

PEER_TURNS = 3  # some take seconds for one equilibrium


def main() -> int:
    """Measure and print; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--json", action="store_true", help="for programs")
    parser.add_argument("--turns", metavar="N", type=whole_number(1, 1000), default=9, help="default 9")
    options = parser.parse_args()
    rows = []
    with Stages("peers", True, EVERY_S) as stages:
        for name in table.PROGRAMS:
            stages.say(name)
            rows.append(table.measure(name, min(options.turns, PEER_TURNS)))
        stages.say("static models of spacer_disk")
        authors = list(tdcr_modeling.measure(options.turns))
    if options.json:
        found = [{"peer": asdict(row)} for row in rows] + [{"static_model": asdict(row)} for row in authors]
        print(json.dumps(found, indent=2))
    else:
        print(table.text(rows), tdcr_modeling.text(authors), sep="\n\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
