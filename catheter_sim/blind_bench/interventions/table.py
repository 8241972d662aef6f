"""Adds up the scores of many draws: shares against what is asked, and every miss."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from catheter_sim.blind_bench.interventions.deal import COMMANDS
from catheter_sim.blind_bench.nature.table import (
    NOT_MADE,
    Score,
    line_texts,
    median_line,
    miss_text,
    outside_texts,
    share_line,
)

# What is asked.
SINGLE, PAIR, FALSE_ALARM, INTERVALS = 0.89, 0.55, 1.0 / 80.0, (0.90, 0.98)
SECONDS = 60.0


def summary(scores: Sequence[Score]) -> dict[str, Any]:
    """Return the table of many scores: lines with what is asked and reached, and the misses."""
    made = [item for item in scores if item["verdict"] != NOT_MADE]
    singles, pairs, nothing = (
        [item for item in made if item["story"] == story] for story in ("single", "pair", "none")
    )
    inside = [row["inside"] for item in made for row in item["intervals"]]
    lines = [
        share_line("one changed: told first", (item["right"] for item in singles), SINGLE),
        share_line("one changed: by its own name", (item["exact"] for item in singles)),
        share_line(
            "one changed, known form: told first", (item["right"] for item in singles if item["known"])
        ),
        share_line(
            "one changed, foreign form: first or outside",
            (item["right"] for item in singles if not item["known"]),
        ),
        *(
            share_line(
                f"one changed, {commands} commands: told first",
                (item["right"] for item in singles if item["commands"] == commands),
            )
            for commands in dict.fromkeys(COMMANDS)
        ),
        share_line("two changed: both told", (item["right"] for item in pairs), PAIR),
        share_line("two changed: by their own names", (item["exact"] for item in pairs)),
        share_line(
            "nothing changed: called changed", (item["false_alarm"] for item in nothing), at_most=FALSE_ALARM
        ),
        share_line("nothing changed: called unchanged", (item["exact"] for item in nothing)),
        share_line("true change in its 95 % interval", inside, INTERVALS[0], INTERVALS[1]),
        median_line("seconds of a comparison, median", [item["seconds"] for item in made], SECONDS),
        median_line("seconds of a comparison, longest", _longest(made)),
    ]
    return {
        "draws": len(scores),
        "made": len(made),
        "lines": lines,
        "misses": [item for item in scores if is_miss(item)],
        "outside_intervals": [
            row | {"index": item["index"]} for item in made for row in item["intervals"] if not row["inside"]
        ],
    }


def as_text(table: dict[str, Any]) -> str:
    """Return the document of `summary` as text."""
    rows = [*line_texts(table), "", "misses:"]
    rows += [f"  {draw_text(item)}" for item in table["misses"]] or ["  none"]
    return "\n".join([*rows, *outside_texts(table)])


def draw_text(item: Score) -> str:
    """Return one draw in a line: what changed, what both hide, and what was said."""
    about = f"{item['commands']} commands"
    if item["shared"]:
        about += f", both hide {' + '.join(item['shared'])}"
    return f"{miss_text(item)} ({about})"


def is_miss(item: Score) -> bool:
    """Return whether a draw is listed: not right, or nothing changed and not told so."""
    return not item["right"] or (item["story"] == "none" and not item["exact"])


def _longest(made: Sequence[Score]) -> list[float]:
    return [max((item["seconds"] for item in made), default=float("nan"))]
