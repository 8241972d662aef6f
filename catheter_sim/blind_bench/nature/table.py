"""Adds up the scores of many draws: shares against what is asked, Brier score, reliability, every miss.

A share is one of few draws: a line is met where its 95 % interval (Wilson 1927) holds what is asked.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.stats import binomtest

from catheter_sim.blind_bench.nature.forms import CAUSES
from catheter_sim.blind_bench.nature.score import NONE, OUTSIDE

Score = dict[str, Any]
NOT_MADE = "not made"
BINS = (0.0, 0.1, 0.2, 0.5, 0.8, 1.0)  # of probabilities; the promise of those from 0.2 on is judged
JUDGED_FROM = 0.2
FILLED = 20  # answers that a bin needs to be judged
# What is asked.
KNOWN, FOREIGN_NAMED, FOREIGN, ANOTHER, PAIR = 0.97, 0.50, 0.92, 0.03, 0.90
FALSE_ALARM, SAID_OUTSIDE, GROUPED = 0.01, 0.90, 0.15
INTERVALS = (0.90, 0.98)
SECONDS = 30.0


def summary(scores: Sequence[Score]) -> dict[str, Any]:
    """Return the table of many scores: lines with what is asked and reached, reliability, and the misses."""
    made = [item for item in scores if item["verdict"] != NOT_MADE]
    singles = [item for item in made if item["story"] == "single"]
    known = [item for item in singles if item["known"]]
    foreign = [item for item in singles if not item["known"]]
    pairs = [item for item in made if item["story"] == "pair"]
    nothing = [item for item in made if item["story"] == "none"]
    outside = [item for item in made if item["story"] == "outside"]
    inside = [row["inside"] for item in made for row in item["intervals"]]
    answers = answers_of(made)
    lines = [
        share_line("single, known form: named first", (item["right"] for item in known), KNOWN),
        share_line("single, known form: by its own name", (item["exact"] for item in known)),
        share_line(
            "single, known form: answered by a group", (item["grouped"] for item in known), at_most=GROUPED
        ),
        share_line("single, foreign form: named", (item["named_right"] for item in foreign), FOREIGN_NAMED),
        share_line(
            "single, foreign form: named, outside or improved", (item["right"] for item in foreign), FOREIGN
        ),
        share_line(
            "single: another cause named", (item["another_named"] for item in singles), at_most=ANOTHER
        ),
        share_line(
            "both of two named, known forms", (item["right"] for item in pairs if item["known"]), PAIR
        ),
        share_line("both of two named, one foreign", (item["right"] for item in pairs if not item["known"])),
        share_line("both of two, by their own names", (item["exact"] for item in pairs)),
        share_line(
            "nothing hidden: a cause named", (item["false_alarm"] for item in nothing), at_most=FALSE_ALARM
        ),
        share_line("nothing hidden: no discrepancy", (item["exact"] for item in nothing)),
        share_line("outside the list: said so", (item["right"] for item in outside), SAID_OUTSIDE),
        share_line("true parameter in its 95 % interval", inside, INTERVALS[0], INTERVALS[1]),
        share_line(
            "named cause at a bound or implausible",
            (bool(item.get("implausible")) for item in made),
            at_most=0.0,
        ),
        median_line("seconds of a diagnosis, median", [item["seconds"] for item in made], SECONDS),
        median_line("held-out error over the noise, median", [item.get("after_over_noise") for item in made]),
    ]
    return {
        "draws": len(scores),
        "made": len(made),
        "lines": lines,
        "brier": _brier(answers),
        "reliability": reliability(answers),
        "misses": [item for item in scores if not item["right"]],
        "outside_intervals": [
            row | {"index": item["index"]} for item in made for row in item["intervals"] if not row["inside"]
        ],
    }


def answers_of(scores: Iterable[Score]) -> list[tuple[float, bool]]:
    """Return every (draw, cause) pair that was given a probability, with whether the cause is at work.

    A group counts beside its members: it holds where one of them is at work. A cause whose form says the same
    as the hidden one is neither right nor wrong, and left out; so is "outside" where a foreign form of a
    listed cause is hidden.
    """
    found = []
    for item in scores:
        if item["probabilities"] is None:
            continue
        listed = item["story"] in ("single", "pair")
        either, true = set(item.get("either", [])), set(item["true"])
        for chance, group in item.get("groups", []):
            if not set(group) & either:
                found.append((chance, listed and bool(set(group) & true)))
        for name, chance in item["probabilities"].items():
            if name in item.get("either", []):
                continue
            if name == NONE:
                found.append((chance, item["story"] == "none"))
            elif name == OUTSIDE:
                if item["known"] or not listed:
                    found.append((chance, item["story"] == "outside"))
            elif name in CAUSES:
                found.append((chance, listed and name in item["true"]))
    return found


def reliability(answers: Sequence[tuple[float, bool]]) -> list[dict[str, Any]]:
    """Return a row for each bin of probability: how many answers, their mean promise, how many held.

    The promise of a bin is kept where it lies in the 95 % interval of the share that held.
    """
    rows = []
    for low, high in pairwise(BINS):
        own = [(chance, held) for chance, held in answers if low <= chance < high or (high == 1.0 == chance)]
        promised = float(np.mean([chance for chance, _ in own])) if own else math.nan
        held = sum(held for _, held in own)
        met = None
        if low >= JUDGED_FROM and len(own) >= FILLED:
            ends = interval_of(held, len(own))
            met = bool(ends[0] <= promised <= ends[1])
        share = held / len(own) if own else math.nan
        rows.append(
            {"from": low, "to": high, "count": len(own), "promised": promised, "held": share, "met": met}
        )
    return rows


def interval_of(hits: int, of: int) -> tuple[float, float]:
    """Return the 95 % interval of a share (Wilson 1927); 0 to 1 where nothing was counted."""
    if not of:
        return 0.0, 1.0
    found = binomtest(hits, of).proportion_ci(method="wilson")
    return float(found.low), float(found.high)


def as_text(table: dict[str, Any]) -> str:
    """Return the document of `summary` as text."""
    rows = [
        *line_texts(table),
        "",
        "Brier score over all (draw, cause) pairs: " + number_text(table["brier"]),
    ]
    rows += ["reliability:   promised    held   answers"]
    for row in table["reliability"]:
        judged = "" if row["met"] is None else ("  met" if row["met"] else "  MISSED")
        share = f"{row['promised']:10.3f} {row['held']:7.3f}" if row["count"] else " " * 18
        rows.append(f"  {row['from']:.1f} to {row['to']:.1f} {share} {row['count']:9d}{judged}")
    rows += ["", "misses:"]
    rows += [f"  {miss_text(item)}" for item in table["misses"]] or ["  none"]
    return "\n".join([*rows, *outside_texts(table)])


def line_texts(table: dict[str, Any]) -> list[str]:
    """Return how many draws were made, and each line of a table with what is asked of it."""
    rows = [f"{table['made']} of {table['draws']} draws made"]
    for line in table["lines"]:
        if not line["of"]:
            rows.append(f"{line['what']:<44}  not given")
            continue
        count = "" if line["count"] is None else f" ({line['count']} of {line['of']}; {_ends(line)})"
        asked = "" if line["met"] is None else f"  asked {_asked(line)}: {'met' if line['met'] else 'MISSED'}"
        rows.append(f"{line['what']:<44} {line['reached']:8.3f}{count}{asked}")
    return rows


def outside_texts(table: dict[str, Any]) -> list[str]:
    """Return a heading, and each parameter that lies outside its interval."""
    rows = [
        f"  {row['index']:3d} {row['parameter']}: true {row['true']:.4g}, "
        f"fitted {number_text(row['fitted'])} ({row['low']:.4g} to {row['high']:.4g})"
        for row in table["outside_intervals"]
    ]
    return ["", "parameters outside their intervals:", *(rows or ["  none"])]


def miss_text(item: Score) -> str:
    """Return one draw in a line: what was hidden, and what was said."""
    true = " + ".join(f"{cause}.{form}" for cause, form in zip(item["true"], item["forms"], strict=True))
    said = item["verdict"]
    if item["named"]:
        said += f" {' + '.join(item['named'])}"
    if item["failure"]:
        said += f": {item['failure']}"
    sizes = "/".join(f"{size:.0f}" for size in item["sizes"])
    about = f"{sizes} x noise, " if sizes else ""
    about += f"{item['noise_kind']}, {item['rows']} rows"
    text = f"{item['index']:3d} {item['robot']}, {item['story']}: {true or 'nothing'} ({about}) -> {said}"
    chances = sorted((item["probabilities"] or {}).items(), key=lambda pair: -pair[1])[:3]
    if chances:
        text += f" [{', '.join(f'{name} {chance:.2f}' for name, chance in chances)}]"
    if item.get("distance") is not None:
        text += f"; from the truth {item['distance']:.1f}"
    if item.get("after_over_noise") is not None:
        text += f"; error {item['after_over_noise']:.2f} x noise"
    return text


def share_line(
    what: str, hits: Iterable[bool], at_least: float | None = None, at_most: float | None = None
) -> dict[str, Any]:
    values = [bool(hit) for hit in hits]
    reached = sum(values) / len(values) if values else math.nan
    low, high = interval_of(sum(values), len(values))
    asked = at_least is not None or at_most is not None
    met = None
    if asked and values:
        met = (at_least is None or high >= at_least) and (at_most is None or low <= at_most)
    return {
        "what": what,
        "reached": reached,
        "count": sum(values),
        "of": len(values),
        "interval": [low, high],
        "at_least": at_least,
        "at_most": at_most,
        "met": met,
    }


def median_line(what: str, values: Sequence[float | None], at_most: float | None = None) -> dict[str, Any]:
    finite = [value for value in values if value is not None and math.isfinite(value)]
    reached = float(np.median(finite)) if finite else math.nan
    met = None if at_most is None or not finite else bool(reached <= at_most)
    return {
        "what": what,
        "reached": reached,
        "count": None,
        "of": len(finite),
        "at_least": None,
        "at_most": at_most,
        "met": met,
    }


def _brier(answers: Sequence[tuple[float, bool]]) -> float | None:
    return float(np.mean([(chance - held) ** 2 for chance, held in answers])) if answers else None


def _ends(line: dict[str, Any]) -> str:
    low, high = line["interval"]
    return f"{low:.3f} to {high:.3f}"


def _asked(line: dict[str, Any]) -> str:
    ends = [line["at_least"], line["at_most"]]
    if None not in ends:
        return f"{ends[0]:g} to {ends[1]:g}"
    return f"at least {ends[0]:g}" if ends[1] is None else f"at most {ends[1]:g}"


def number_text(value: float | None) -> str:
    return "not given" if value is None else f"{value:.4g}"
