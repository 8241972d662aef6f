"""Let scores of an earlier version count for the present one, if it gives the same answers.

    python scripts/carry_scores.py docs/truth/judged_seed_3.jsonl [--draws 24] [--jobs 2]

FILE is a `--scores` file of scripts/natural_effects.py. A score counts for the very code that diagnosed its
draw, and any change of a diagnosis makes another code, whatever it changes. Here so many of the draws, spread
evenly over the stories, are made and diagnosed again by the present code. If every answer is the same, to the
last digit of each probability and interval, all scores are marked as this code's, with the code that gave
them in `carried_from`. If one differs it is shown, the file stays as it is, and the exit status is 1.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))  # where the benches lie

from catheter_sim.cli.arguments import whole_number
from catheter_sim.errors import InputError
from catheter_sim.tables import replaced_when_whole
from hidden_effects.natural import NOT_MADE, commit, judging_code, run_bench

OF_A_RUN = ("seconds", "seconds_to_make", "commit", "code", "carried_from", "made_by")


def main(arguments: list[str] | None = None) -> int:
    """Try a sample again, and mark all scores if it gives the same; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("file", type=Path, metavar="FILE")
    parser.add_argument("--draws", type=whole_number(1, 10000), default=24, help="tried again; default 24")
    parser.add_argument("--jobs", type=whole_number(1, 256), default=os.cpu_count() or 1, help="at a time")
    options = parser.parse_args(arguments)
    try:
        scores = scores_of(options.file)
        chosen = sample_of(scores, options.draws)
        with tempfile.TemporaryDirectory() as folder:
            again = run_bench(
                scores[0]["purpose"],
                scores[0]["seed"],
                [item["index"] for item in chosen],
                Path(folder),
                options.jobs,
                on_score=lambda score: print(f"tried draw {score['index']} again", flush=True),
            )
    except InputError as error:
        print(f"carry_scores: error: {error}", file=sys.stderr)
        return 2
    differing = [told for pair in zip(chosen, again, strict=True) for told in differences(*pair)]
    for line in differing:
        print(line)
    if differing:
        print(f"{options.file}: not changed; the draws have to be run again")
        return 1
    write(options.file, [carried(item) for item in scores])
    print(f"{len(chosen)} of {len(chosen)} give the same: {len(scores)} scores count for {judging_code()}")
    return 0


def scores_of(file: Path) -> list[dict[str, Any]]:
    """Return the scores in a file.

    Raises:
        InputError: it cannot be read, holds none, or not those of one code.
    """
    try:
        scores = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
        codes = {item["code"] for item in scores}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{file}: cannot be read: {error}") from None
    if len(codes) != 1:
        raise InputError(f"{file}: holds scores of {len(codes)} codes, where those of one are needed")
    return scores


def sample_of(scores: list[dict[str, Any]], most: int) -> list[dict[str, Any]]:
    """Return some scores, spread evenly over the stories and over each one's draws."""
    made = [item for item in scores if item["verdict"] != NOT_MADE]
    ordered = sorted(made, key=lambda item: (item["story"], item["index"]))
    step = max(1.0, len(ordered) / most)
    return [ordered[int(step * k)] for k in range(min(most, len(ordered)))]


def differences(before: dict[str, Any], after: dict[str, Any]) -> list[str]:
    """Return a line for each thing that a draw's two scores say differently, apart from the run itself."""
    told = [json.loads(json.dumps(item)) for item in (before, after)]
    keys = sorted({*before, *after} - set(OF_A_RUN))
    return [
        f"draw {before['index']}: {key}: {told[0].get(key)} before, {told[1].get(key)} now"
        for key in keys
        if told[0].get(key) != told[1].get(key)
    ]


def carried(score: dict[str, Any]) -> dict[str, Any]:
    """Return a score as one of the present code; by which it was given stays in it."""
    given = f"{score['code']} (commit {score['commit']})"
    return score | {
        "code": judging_code(),
        "commit": commit(),
        "carried_from": score.get("carried_from", given),
    }


def write(file: Path, scores: list[dict[str, Any]]) -> None:
    """Write scores, a line each."""
    with replaced_when_whole(file) as text:
        for score in scores:
            text.write(json.dumps(score, sort_keys=True) + "\n")


if __name__ == "__main__":
    sys.exit(main())
