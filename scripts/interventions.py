"""Let nature make two recordings of a robot between which one thing changed, two or none, ask, and score.

    python scripts/interventions.py --draws 200 --seed 3 --purpose judge -o results/interventions

Of 200 draws one thing changes in 100, two in 20, nothing in 80. The recordings share the specimen's own
errors and in half of the draws something that no diagnosis knows; the later one has the earlier one's
commands, some of them, or others (docs/truth/interventions.md). The data come of the same laws as those of
scripts/natural_effects.py; `catheter-sim diagnose NEW --since OLD` is asked in another process.

-o DIR gets data/, answers/, found/, scores/ (one JSON per draw), table.txt and table.json. A stopped run goes
on where it was, and with --scores FILE in a new folder, too. A draw counts only where the package's files are
those that scored it.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))  # where the benches lie

from catheter_sim.errors import InputError
from hidden_effects.interventions import as_text, draw_text, is_miss, run_bench, scoring_code, summary
from hidden_effects.natural import CHANGED
from hidden_effects.options import draws_of, ended, keeping, parser_of
from hidden_effects.planting import named_robots


def main() -> int:
    """Run the bench; return the exit status: 1 where a line of the table is missed."""
    parser = parser_of(__doc__, draws=20)
    parser.add_argument(
        "--bare",
        action="store_true",
        help="a control: without what both recordings hide, all else as it is",
    )
    options = parser.parse_args()
    if options.bare and options.scores:
        parser.error("--bare: its scores are not those of the bench, leave out --scores")
    root = Path(options.output)
    try:
        robots = named_robots(options.robots, "--robots")
        draws = draws_of(options, root, scoring_code())
        scores = run_bench(
            options.purpose,
            options.seed,
            draws,
            root,
            options.jobs,
            robots,
            options.limit,
            on_score=keeping(options, root, scoring_code(), _say),
            bare=options.bare,
        )
    except InputError as error:
        print(f"interventions: error: {error}", file=sys.stderr)
        return 2
    return ended(root, scores, summary, as_text, scoring_code())


def _say(score: dict) -> None:
    mark = "MISS" if is_miss(score) else "hit "
    changed = f" ({CHANGED})" if score["code"] == CHANGED else ""
    print(f"{mark} {draw_text(score)} [{score['seconds']:.0f} s]{changed}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
