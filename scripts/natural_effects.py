"""Let nature make data by laws of its own, let the diagnosis look at them, and score it.

    python scripts/natural_effects.py --draws 450 --seed 1 --purpose judge -o results/nature

The data come of the MuJoCo simulation and of physics that is written a second time
(`hidden_effects.natural`, docs/truth/independent_bench.md); no cause's own code makes them. Of every
cause there are forms that the diagnosis knows and forms that it does not (foreign). Half of the foreign ones
are drawn with --purpose tune, the other half with --purpose judge: tune with the first, judge with the other.
With --purpose tune_in_part or judge_in_part a single cause acts in part of the robot, the time, the level or
the past (`hidden_effects.in_part`), in one draw of ten none does.

-o DIR gets data/, answers/, found/, scores/ (one JSON per draw, with seed, commit, code, answer and
seconds), table.txt and table.json. A stopped run goes on where it was, and with --scores FILE in a new
folder, too. A draw counts only where the files that a diagnosis and its score import are those that scored
it: after a change there it is diagnosed again, and its data are made again where the change concerns what
makes them.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))  # where the benches lie

from catheter_sim.errors import InputError
from hidden_effects.natural import CHANGED, NOT_MADE, as_text, judging_code, miss_text, run_bench, summary
from hidden_effects.options import draws_of, ended, keeping, parser_of
from hidden_effects.planting import IN_PART, PURPOSES, named_robots


def main() -> int:
    """Run the bench; return the exit status: 1 where a line of the table is missed."""
    parser = parser_of(__doc__, draws=45, purposes=(*PURPOSES, *IN_PART))
    parser.add_argument("--make-only", action="store_true", help="make data and answers, diagnose nothing")
    options = parser.parse_args()
    root = Path(options.output)
    try:
        robots = named_robots(options.robots, "--robots")
        draws = draws_of(options, root, judging_code())
        scores = run_bench(
            options.purpose,
            options.seed,
            draws,
            root,
            options.jobs,
            robots,
            options.limit,
            options.make_only,
            on_score=_say_made if options.make_only else keeping(options, root, judging_code(), _say),
        )
    except InputError as error:
        print(f"natural_effects: error: {error}", file=sys.stderr)
        return 2
    if options.make_only:
        return 0
    return ended(root, scores, summary, as_text, judging_code())


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
