"""How often are hidden causes named on models that this package did not make?

    python scripts/foreign_models.py --draws 12 --seed 1 -o results/foreign_models

Each draw is a model of `assets/foreign` with one hidden cause, or every sixth with none, by laws that its
diagnosis does not share: three recordings in motion, one held out. Named: the diagnosis says `cause_found`
and names the hidden cause and no other, or cannot tell it from those that it lists beside it.

-o DIR gets draws/draw_NNN.json (seed, what was hidden, what was said, seconds), data/, table.txt and
table.json. A stopped run goes on where it was; a longer one adds to it. Exit status 1: a line is missed.
"""

from __future__ import annotations

import argparse
import sys
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))  # where the benches lie

from catheter_sim.cli.arguments import whole_number
from catheter_sim.errors import InputError
from hidden_effects.foreign_models import as_text, drawn_once, met, outcome, summary
from hidden_effects.running import keep_settings, read_json, run_all, show_table

MODELS = Path(__file__).parent.parent / "assets" / "foreign"


def main() -> int:
    """Run the bench; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--draws", type=whole_number(1, 10000), default=12, help="default 12")
    parser.add_argument("--seed", type=whole_number(0, 2**31), default=1, help="default 1")
    parser.add_argument("--jobs", type=whole_number(1, 256), default=1, help="draws at a time; default 1")
    parser.add_argument("-o", "--output", metavar="DIR", required=True, help="folder to write")
    options = parser.parse_args()
    root = Path(options.output)
    try:
        keep_settings(root, {"seed": options.seed})
    except InputError as error:
        print(f"foreign_models: error: {error}", file=sys.stderr)
        return 2
    print(f"seed {options.seed}, {options.draws} draws", flush=True)
    todo = [(k,) for k in range(options.draws)]
    run_all(partial(drawn_once, root, MODELS, options.seed), todo, options.jobs, _say)
    draws = [item for k in range(options.draws) if (item := read_json(root / "draws" / f"draw_{k:03d}.json"))]
    table = summary(draws)
    show_table(table, as_text(table, draws), root)
    return 0 if met(table) else 1


def _say(draw: dict) -> None:
    hidden = draw["hidden"]["cause"] if draw["hidden"] else "nothing"
    named = " + ".join(draw["named"]) or draw["verdict"]
    print(
        f"{draw['index']:3d} {draw['model']}, {hidden}: {named}, {outcome(draw)} [{draw['seconds']:.0f} s]",
        flush=True,
    )


if __name__ == "__main__":
    sys.exit(main())
