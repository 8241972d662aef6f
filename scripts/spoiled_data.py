"""Spoil sound measurements in every way that people do, let the diagnosis look at them, and score it.

    python scripts/spoiled_data.py --draws 2 --seed 1 -o results/spoiled
    python scripts/spoiled_data.py --draws 2 --seed 1 --only bumped_between,frozen -o results/spoiled

The recordings are those of the independent bench (`hidden_effects.natural`), of 220 to 420 rows;
every other one hides a cause of a form that the diagnosis knows. They are spoiled in the ways of
`hidden_effects.spoiled_kinds` and diagnosed in another process. Right is whatever names no cause
that is not there: data that are called suspect or refused, nothing named, or the causes that are truly there.
The kind `sound` spoils nothing; there it is wrong to suspect anything.

-o DIR gets clean/, data/, answers/, found/, scores/ (one JSON per draw), table.md and misses.txt. A stopped
run goes on where it was. A draw counts only where the package's files are those that scored it.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))  # where the benches lie

from catheter_sim.cli.arguments import whole_number
from catheter_sim.errors import InputError, unknown
from catheter_sim.tables import replaced_when_whole
from hidden_effects.natural import commit, judging_code, scores_in
from hidden_effects.spoiled import MOST_DRAWS, as_markdown, run_bench, score_text, summary_text
from hidden_effects.spoiled_kinds import BY_NAME


def main() -> int:
    """Run the bench; return the exit status: 1 where a cause is named that is not there."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--draws", type=whole_number(1, MOST_DRAWS), default=2, help="of each kind; default 2"
    )
    parser.add_argument("--seed", type=whole_number(0, 2**31), default=1, help="default 1")
    parser.add_argument("--only", help="kinds, comma-separated; default all")
    cores = os.cpu_count() or 1
    parser.add_argument(
        "--jobs", type=whole_number(1, 256), default=cores, help="draws at a time; default all"
    )
    parser.add_argument("--limit", type=float, default=600.0, help="seconds for one diagnosis; default 600")
    parser.add_argument("--make-only", action="store_true", help="make data and answers, diagnose nothing")
    parser.add_argument("-o", "--output", metavar="DIR", required=True, help="folder to write")
    options = parser.parse_args()
    root = Path(options.output)
    try:
        names = _kinds(options.only)
        print(
            f"seed {options.seed}, {options.draws} draws of {len(names)} kinds, commit {commit()}, code "
            f"{judging_code()}",
            flush=True,
        )
        say = _say_made if options.make_only else _say
        run_bench(
            options.seed,
            names,
            options.draws,
            root,
            options.jobs,
            options.limit,
            options.make_only,
            on_score=say,
        )
    except InputError as error:
        print(f"spoiled_data: error: {error}", file=sys.stderr)
        return 2
    if options.make_only:
        return 0
    counted = scores_in(root)
    for file, text in (("table.md", as_markdown(counted)), ("misses.txt", summary_text(counted) + "\n")):
        with replaced_when_whole(root / file) as whole:
            whole.write(text)
        print(text)
    return 0 if all(score["right"] for score in counted) else 1


def _kinds(text: str | None) -> tuple[str, ...]:
    names = tuple(text.split(",")) if text else tuple(BY_NAME)
    for name in names:
        if name not in BY_NAME:
            raise unknown("kind", name, BY_NAME, "--only")
    return names


def _say(score: dict) -> None:
    print(
        f"{'hit ' if score['right'] else 'MISS'} {score_text(score)} [{score['seconds']:.0f} s]", flush=True
    )


def _say_made(answer: dict) -> None:
    hidden = " + ".join(f"{item['cause']}.{item['form']}" for item in answer["hidden"])
    print(f"{answer['kind']} {answer['draw']}, {answer['robot']}: {hidden or 'nothing'} hidden", flush=True)


if __name__ == "__main__":
    sys.exit(main())
