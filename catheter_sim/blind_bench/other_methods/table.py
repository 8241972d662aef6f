"""One row per method: how often it is right, by what was hidden."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

Score = Mapping[str, Any]
COLUMNS = ("known", "foreign", "pair", "false alarm", "outside", "names too many", "seconds")


def rows(scores: Mapping[str, Sequence[Score]]) -> list[dict[str, Any]]:
    """Return a row per method: shares of right answers, by its own name, and the median of seconds."""
    return [{"method": name} | _row(own) for name, own in scores.items()]


def as_text(table: Sequence[Mapping[str, Any]]) -> str:
    """Return the rows as a table in Markdown."""
    lines = ["| method | " + " | ".join(COLUMNS) + " |", "|" + "---|" * (len(COLUMNS) + 1)]
    lines += [f"| {row['method']} | " + " | ".join(row[name] for name in COLUMNS) + " |" for row in table]
    return "\n".join(lines)


def _row(scores: Sequence[Score]) -> dict[str, str]:
    stories = {
        name: [item for item in scores if item["story"] == name]
        for name in ("single", "pair", "none", "outside")
    }
    singles = stories["single"]
    seconds = [item["seconds"] for item in scores if math.isfinite(item["seconds"])]
    return {
        "known": _share(item["exact"] for item in singles if item["known"]),
        "foreign": _share(item["exact"] or _outside(item) for item in singles if not item["known"]),
        "pair": _share(item["exact"] for item in stories["pair"]),
        "false alarm": _share(item["false_alarm"] for item in stories["none"]),
        "outside": _share(item["right"] for item in stories["outside"]),
        "names too many": _share(
            bool(set(item["named"]) - set(item["true"])) for item in (*singles, *stories["pair"])
        ),
        "seconds": f"{np.median(seconds):.0f}" if seconds else "-",
    }


def _outside(item: Score) -> bool:
    return bool(item["right"]) and not item["named"]


def _share(hits: Iterable[bool]) -> str:
    values = [bool(hit) for hit in hits]
    return f"{sum(values)} of {len(values)}" if values else "-"
