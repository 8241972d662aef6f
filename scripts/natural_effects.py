"""Let nature make data by laws of its own, let the diagnosis look at them, and score it.

    python scripts/natural_effects.py --draws 450 --seed 1 --purpose judge -o results/nature

The data come of the MuJoCo simulation and of physics that is written a second time
(`catheter_sim.blind_bench.nature`, docs/truth/independent_bench.md); no cause's own code makes them. Of every
cause there are forms that the diagnosis knows and forms that it does not (foreign). Half of the foreign ones
are drawn with --purpose tune, the other half with --purpose judge: tune with the first, judge with the other.

-o DIR gets data/, answers/, found/, scores/ (one JSON per draw, with seed, commit, code, answer and
seconds), table.txt and table.json. A stopped run goes on where it was. A draw counts only where the package's
files are those that scored it: after a change it is diagnosed again, and its data are made again where the
change concerns what makes them.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from catheter_sim.blind_bench.nature.code import commit, whole_code
from catheter_sim.blind_bench.nature.forms import PURPOSES
from catheter_sim.blind_bench.nature.run import CHANGED, run_bench, scores_in
from catheter_sim.blind_bench.nature.table import NOT_MADE, as_text, miss_text, summary
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
    parser.add_argument("--draws", type=whole_number(1, 10000), default=45, help="default 45")
    parser.add_argument(
        "--only", type=whole_numbers, help="numbers of draws, comma-separated, from 0; instead of --draws"
    )
    parser.add_argument("--seed", type=whole_number(0, 2**31), default=1, help="default 1")
    parser.add_argument("--purpose", choices=PURPOSES, default="tune", help="default tune")
    cores = os.cpu_count() or 1
    parser.add_argument(
        "--jobs", type=whole_number(1, 256), default=cores, help="draws at a time; default all"
    )
    parser.add_argument("--robots", help=f"comma-separated, of {', '.join(BENCH_ROBOTS)}; default all")
    parser.add_argument("--limit", type=float, default=900.0, help="seconds for one diagnosis; default 900")
    parser.add_argument("--make-only", action="store_true", help="make data and answers, diagnose nothing")
    parser.add_argument("-o", "--output", metavar="DIR", required=True, help="folder to write")
    options = parser.parse_args()
    root = Path(options.output)
    try:
        robots = named_robots(options.robots, "--robots")
        draws = options.only or range(options.draws)
        about = f"{options.purpose}, seed {options.seed}, {len(draws)} draws"
        print(f"{about}, commit {commit()}, code {whole_code()}", flush=True)
        scores = run_bench(
            options.purpose,
            options.seed,
            draws,
            root,
            options.jobs,
            robots,
            options.limit,
            options.make_only,
            on_score=_say_made if options.make_only else _say,
        )
    except InputError as error:
        print(f"natural_effects: error: {error}", file=sys.stderr)
        return 2
    if options.make_only:
        return 0
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
    mark = "hit " if score["right"] else "MISS"
    changed = f" ({CHANGED})" if score["code"] == CHANGED else ""
    print(f"{mark} {miss_text(score)} [{score['seconds']:.0f} s]{changed}", flush=True)


def _say_made(answer: dict) -> None:
    if answer.get("verdict") == NOT_MADE:
        print(f"{answer['index']:3d} {answer['robot']}, {answer['story']}: not made: {answer['failure']}")
        return
    hidden = [f"{item['cause']}.{item['form']} {item['over_noise']:.1f} x noise" for item in answer["hidden"]]
    print(
        f"{answer['index']:3d} {answer['robot']}, {answer['story']}: {' + '.join(hidden) or 'nothing'} "
        f"({answer['rows']} rows, {answer['noise_kind']}) [{answer.get('seconds_to_make', 0.0):.0f} s]",
        flush=True,
    )


if __name__ == "__main__":
    sys.exit(main())
