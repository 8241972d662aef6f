"""What the commands of benches by nature's laws have in common: their options, and how they end.

Scores may be kept in one file, JSON lines, so that a bench goes on elsewhere without its folder.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from catheter_sim.cli.arguments import whole_number, whole_numbers
from catheter_sim.errors import InputError
from catheter_sim.lab.robots import BENCH_ROBOTS
from catheter_sim.tables import replaced_when_whole
from hidden_effects.natural import commit, scores_in
from hidden_effects.planting import PURPOSES
from hidden_effects.running import Folders, write_json


def parser_of(
    description: str | None, draws: int, purposes: Sequence[str] = PURPOSES
) -> argparse.ArgumentParser:
    """Return the options of a bench that makes `draws` draws by default, for one of `purposes`."""
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--draws", type=whole_number(1, 10000), default=draws, help=f"default {draws}")
    parser.add_argument(
        "--only", type=whole_numbers, help="numbers of draws, comma-separated, from 0; instead of --draws"
    )
    parser.add_argument("--seed", type=whole_number(0, 2**31), default=1, help="default 1")
    parser.add_argument("--purpose", choices=purposes, default="tune", help="default tune")
    cores = os.cpu_count() or 1
    parser.add_argument(
        "--jobs", type=whole_number(1, 256), default=cores, help="draws at a time; default all cores"
    )
    parser.add_argument("--robots", help=f"comma-separated, of {', '.join(BENCH_ROBOTS)}; default all")
    parser.add_argument("--limit", type=float, default=900.0, help="seconds for one diagnosis; default 900")
    parser.add_argument("-o", "--output", metavar="DIR", required=True, help="folder to write")
    parser.add_argument(
        "--scores",
        type=Path,
        metavar="FILE",
        help="a line of JSON for each scored draw: read first, written after each; with it a bench goes on "
        "without its folder",
    )
    return parser


def keeping(
    options: argparse.Namespace, root: Path, code: str, say: Callable[[dict[str, Any]], None]
) -> Callable[[dict[str, Any]], None]:
    """Return what to call with each score: it is said, and the scores of `code` go to the file `--scores`."""

    def on_score(score: dict[str, Any]) -> None:
        say(score)
        hand_on(options, root, code)

    return on_score


def take_up(options: argparse.Namespace, root: Path) -> None:
    """Put the scores of the file `--scores`, if there is one, into the bench's folder where it has none.

    Raises:
        InputError: a line of it is no score, or one of another purpose or seed.
    """
    file: Path | None = options.scores
    if file is None or not file.exists():
        return
    for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), start=1):
        try:
            score = json.loads(line)
            asked = score["purpose"], score["seed"]
            place = Folders(root, int(score["index"])).score
        except (ValueError, KeyError, TypeError):
            raise InputError(f"{file}: line {number}: not the score of a draw") from None
        if asked != (options.purpose, options.seed):
            raise InputError(
                f"{file}: line {number}: of {asked[0]}, seed {asked[1]}, not of {options.purpose}, "
                f"seed {options.seed}; give another file"
            )
        if not place.exists():
            write_json(score, place)


def hand_on(options: argparse.Namespace, root: Path, code: str) -> None:
    """Write the scores of a code, in the order of their draws, to the file `--scores` if one is given."""
    if options.scores is None:
        return
    options.scores.parent.mkdir(parents=True, exist_ok=True)
    with replaced_when_whole(options.scores) as file:
        for score in scores_in(root, code):
            file.write(json.dumps(score, sort_keys=True) + "\n")


def draws_of(options: argparse.Namespace, root: Path, code: str) -> Sequence[int]:
    """Return the numbers of the draws that are asked for, and say which code will score them.

    Scores of the file `--scores` are taken up before.

    Raises:
        InputError: as of `take_up`.
    """
    take_up(options, root)
    draws: Sequence[int] = options.only or range(options.draws)
    about = f"{options.purpose}, seed {options.seed}, {len(draws)} draws"
    print(f"{about}, commit {commit()}, code {code}", flush=True)
    return draws


def ended(
    root: Path,
    scores: Sequence[dict[str, Any]],
    summary: Callable[[Sequence[dict[str, Any]]], dict[str, Any]],
    as_text: Callable[[dict[str, Any]], str],
    code: str,
) -> int:
    """Write and print the table of the scores of this code; return 1 where a line is missed, else 0."""
    counted = scores_in(root, code)
    if len(counted) < len(scores):
        print(f"{len(scores) - len(counted)} draws do not count: the package's files have changed")
    table = summary(counted)
    with replaced_when_whole(root / "table.txt") as file:
        file.write(as_text(table) + "\n")
    write_json(table, root / "table.json")
    print(as_text(table))
    return 0 if all(line["met"] is not False for line in table["lines"]) else 1
