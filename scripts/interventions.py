"""Let nature make two recordings of a robot between which one thing changed, two or none, ask, and score.

    python scripts/interventions.py --draws 200 --seed 1 --purpose judge -o results/interventions

Of 200 draws one thing changes in 100, two in 20, nothing in 80. The recordings share the specimen's own
errors and in half of the draws something that no diagnosis knows; the later one has the earlier one's
commands, some of them, or others (docs/truth/interventions.md). The data come of the same laws as those of
scripts/natural_effects.py; `catheter-sim diagnose NEW --since OLD` is asked in another process.

-o DIR gets data/, answers/, found/, scores/ (one JSON per draw), table.txt and table.json. A stopped run goes
on where it was. A draw counts only where the package's files are those that scored it.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from catheter_sim.blind_bench.interventions.run import run_bench
from catheter_sim.blind_bench.interventions.table import as_text, draw_text, is_miss, summary
from catheter_sim.blind_bench.nature.code import commit, whole_code
from catheter_sim.blind_bench.nature.forms import PURPOSES
from catheter_sim.blind_bench.nature.run import CHANGED, scores_in
from catheter_sim.blind_bench.places import write_json
from catheter_sim.blind_bench.robots import BENCH_ROBOTS, named_robots
from catheter_sim.cli.arguments import whole_number, whole_numbers
from catheter_sim.errors import InputError
from catheter_sim.tables import replaced_when_whole


def main() -> int:
    """Run the bench; return the exit status: 1 where a line of the table is missed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--draws", type=whole_number(1, 10000), default=20, help="default 20")
    parser.add_argument("--only", type=whole_numbers, help="numbers of draws, comma-separated, from 0")
    parser.add_argument("--seed", type=whole_number(0, 2**31), default=1, help="default 1")
    parser.add_argument("--purpose", choices=PURPOSES, default="tune", help="default tune")
    parser.add_argument(
        "--jobs", type=whole_number(1, 256), default=os.cpu_count() or 1, help="at a time; default all cores"
    )
    parser.add_argument("--robots", help=f"comma-separated, of {', '.join(BENCH_ROBOTS)}; default all")
    parser.add_argument("--limit", type=float, default=900.0, help="seconds for one comparison; default 900")
    parser.add_argument("-o", "--output", metavar="DIR", required=True, help="folder to write")
    options = parser.parse_args()
    root = Path(options.output)
    try:
        robots = named_robots(options.robots, "--robots")
        draws = options.only or range(options.draws)
        about = f"{options.purpose}, seed {options.seed}, {len(draws)} draws"
        print(f"{about}, commit {commit()}, code {whole_code()}", flush=True)
        scores = run_bench(
            options.purpose, options.seed, draws, root, options.jobs, robots, options.limit, on_score=_say
        )
    except InputError as error:
        print(f"interventions: error: {error}", file=sys.stderr)
        return 2
    counted = scores_in(root)
    if len(counted) < len(scores):
        print(f"{len(scores) - len(counted)} draws do not count: the package's files have changed")
    table = summary(counted)
    with replaced_when_whole(root / "table.txt") as file:
        file.write(as_text(table) + "\n")
    write_json(table, root / "table.json")
    print(as_text(table))
    return 0 if all(line["met"] is not False for line in table["lines"]) else 1


def _say(score: dict) -> None:
    mark = "MISS" if is_miss(score) else "hit "
    changed = f" ({CHANGED})" if score["code"] == CHANGED else ""
    print(f"{mark} {draw_text(score)} [{score['seconds']:.0f} s]{changed}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
