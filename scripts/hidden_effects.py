"""Hide effects in made data, let the diagnosis look for them, and score it.

    python scripts/hidden_effects.py --draws 100 --seed 7 --jobs 2 -o results/hidden

Every draw takes a robot, a story (one effect, two, none, or a cause outside the list), a size of 5 to 30
times the noise, inputs, noise and errors of calibration. The simulation makes the data; the diagnosis, in
another process that is given only the data set's folder, fits the analytic twin. A draw takes one or two
minutes of one core, of the two-section neuroendoscope far more. A stopped run goes on where it was; a draw
that is scored is not run again.

-o DIR gets data/, answers/, found/, scores/ (one JSON per draw), table.txt and table.json. Times per draw
are those of one process beside the other jobs.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))  # where the benches lie

from catheter_sim.cli.arguments import whole_number
from catheter_sim.errors import InputError
from catheter_sim.lab.robots import BENCH_ROBOTS
from hidden_effects.first_bench import as_text, miss_text, run_bench, summary
from hidden_effects.planting import named_robots
from hidden_effects.running import show_table


def main() -> int:
    """Run the bench; return the exit status: 1 where a line of the table is missed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--draws", type=whole_number(1, 10000), default=20, help="default 20")
    parser.add_argument("--seed", type=whole_number(0, 2**31), default=1, help="default 1")
    parser.add_argument("--jobs", type=whole_number(1, 256), default=1, help="draws at a time; default 1")
    parser.add_argument("--robots", help=f"comma-separated, of {', '.join(BENCH_ROBOTS)}; default all")
    parser.add_argument("--limit", type=float, default=900.0, help="seconds for one diagnosis; default 900")
    parser.add_argument("-o", "--output", metavar="DIR", required=True, help="folder to write")
    options = parser.parse_args()
    try:
        robots = named_robots(options.robots, "--robots")
        root = Path(options.output)
        print(f"seed {options.seed}, {options.draws} draws of {', '.join(robots)}", flush=True)
        scores = run_bench(
            options.seed, options.draws, root, options.jobs, robots, options.limit, on_score=_say
        )
    except InputError as error:
        print(f"hidden_effects: error: {error}", file=sys.stderr)
        return 2
    table = summary(scores)
    show_table(table, as_text(table), root)
    return 0 if all(line["met"] is not False for line in table["lines"]) else 1


def _say(score: dict) -> None:
    print(f"{'hit ' if score['right'] else 'MISS'} {miss_text(score)} [{score['seconds']:.0f} s]", flush=True)


if __name__ == "__main__":
    sys.exit(main())
