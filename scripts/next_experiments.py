"""How often does one more experiment settle what first data could not?

    python scripts/next_experiments.py --draws 60 --seed 1 -o results/next_experiments

Each draw is a simulated robot with one hidden cause, by laws that the diagnosis does not share, whose first
data, five single pulls, leave two causes or more above 0.2. One experiment follows, which takes as long each
time: the one that is expected to tell most, a fixed one (the loops of each channel), and one drawn at random
of what the bench can play. It decides where one cause stands at 0.95. Causes that a diagnosis cannot
tell apart share their probability alike.

Stand-ins whose hidden cause not even rich data would tell from an open one, by nature's own arithmetic, are
no draws; the proposed experiment is made there too and stands in a line of its own.

-o DIR gets draws/draw_NNN.json (seed, what was hidden, what each experiment brought, seconds, code),
table.txt and table.json. A stopped run goes on where it was; a longer one adds to it. Exit status 1: a line
of the acceptance is missed.
"""

from __future__ import annotations

import argparse
import sys
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))  # where the benches lie

from catheter_sim.cli.arguments import whole_number, whole_numbers
from catheter_sim.errors import InputError
from hidden_effects.next_experiments import (
    ASKED_DRAWS,
    as_text,
    drawn_once,
    met_lines,
    results_in,
    settles,
    summary,
)
from hidden_effects.planting import named_robots
from hidden_effects.running import keep_settings, run_all, show_table

ROBOTS = "mitral_4dof,mitral_transseptal,file_displacement"  # a diagnosis of them takes seconds


def main() -> int:
    """Run the bench; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--draws", type=whole_number(1, 10000), default=60, help="default 60")
    parser.add_argument("--only", type=whole_numbers, help="numbers of draws, comma-separated, from 0")
    parser.add_argument("--seed", type=whole_number(0, 2**31), default=1, help="default 1")
    parser.add_argument("--robots", default=ROBOTS, help=f"comma-separated; default {ROBOTS}")
    parser.add_argument("--jobs", type=whole_number(1, 256), default=1, help="draws at a time; default 1")
    parser.add_argument("-o", "--output", metavar="DIR", required=True, help="folder to write")
    options = parser.parse_args()
    root = Path(options.output)
    try:
        robots = named_robots(options.robots, "--robots")
        keep_settings(root, {"seed": options.seed, "robots": list(robots)})
    except InputError as error:
        print(f"next_experiments: error: {error}", file=sys.stderr)
        return 2
    todo = options.only or range(options.draws)
    print(f"seed {options.seed}, {len(todo)} draws", flush=True)
    run_all(partial(drawn_once, root, options.seed, robots), [(k,) for k in todo], options.jobs, _say)
    draws = results_in(root)
    table = summary(draws)
    show_table(table, as_text(table, draws), root)
    decided = table["draws"] >= ASKED_DRAWS
    return 0 if decided and all(met_lines(table).values()) else 1


def _say(draw: dict) -> None:
    if "arms" not in draw:
        print(f"{draw['index']:3d} {draw['robot']}: no first data that cannot tell [{draw['seconds']:.0f} s]")
        return
    hidden = draw["hidden"]
    arms = ", ".join(
        f"{arm} {'settled' if settles(draw, arm) else '/'.join(item['sure']) or 'open'}"
        for arm, item in draw["arms"].items()
    )
    print(
        f"{draw['index']:3d} {draw['robot']}, {hidden['cause']}.{hidden['form']}: {arms} "
        f"[{draw['seconds']:.0f} s]",
        flush=True,
    )


if __name__ == "__main__":
    sys.exit(main())
