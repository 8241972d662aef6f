"""Adds up the scores of many draws, against what is asked of a diagnosis, with every miss."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

# What is asked, as a share of the draws; of the errors, a ratio.
SINGLE, PAIR, FALSE_CAUSE, UNEXPLAINED, COVERAGE, GAIN, OVER_FLOOR = 0.95, 0.80, 0.02, 0.85, 0.85, 0.90, 1.3
NOT_MADE = "not made"
Score = dict[str, Any]


def summary(scores: Sequence[Score]) -> dict[str, Any]:
    """Return the table of many scores: lines with what was asked and reached, the misses, what was off."""
    made = [item for item in scores if item["verdict"] != NOT_MADE]
    by_story = {
        name: [item for item in made if item["story"] == name]
        for name in ("single", "pair", "none", "outside")
    }
    found = [item for item in made if item["story"] in ("single", "pair")]
    covered = [row for item in found for row in item.get("coverage", []) if row["comparable"]]
    other = [row for item in found for row in item.get("coverage", []) if not row["comparable"]]
    gains = [item["gain"] for item in made if "gain" in item]
    over_floor = [item.get("after_over_floor", math.nan) for item in found]
    over_noise = [item.get("after_over_noise", math.nan) for item in found]
    causes = [item["verdict"] == "cause_found" for item in by_story["none"]]
    alone = [sorted(item["named"]) == sorted(item["true"]) for item in found]
    seconds = [item["seconds"] for item in made]
    lines = [
        _share("single effect named first", by_story["single"], SINGLE),
        _share("both of two named", by_story["pair"], PAIR),
        _share("nothing hidden: no discrepancy", by_story["none"], None),
        _counted("nothing hidden: a cause named", causes, FALSE_CAUSE, most=True),
        _share("outside the list: unexplained", by_story["outside"], UNEXPLAINED),
        _counted("true parameter in its 95 % interval", [row["inside"] for row in covered], COVERAGE),
        _value("held-out error over the noise floor, median", over_floor, OVER_FLOOR),
        _value("held-out error over the true noise, median", over_noise, None),
        _counted("gain on a third set within the claimed interval", [item["inside"] for item in gains], GAIN),
        _counted("gain intervals of both sets overlap", [item["overlap"] for item in gains], None),
        _counted("the hidden effects named, and nothing else", alone, None),
        _value("seconds of a diagnosis, median", seconds, None),
        _value("seconds of a diagnosis, most", [max(seconds)] if seconds else [], None),
    ]
    return {
        "draws": len(scores),
        "made": len(made),
        "lines": lines,
        "parameters_not_comparable": len(other),
        "robots_refused": [
            {"index": item["index"], "why": item["robot_refused"]}
            for item in made
            if item.get("robot_refused")
        ],
        "misses": [item for item in scores if not item["right"]],
        "not_covered": [row | {"index": item["index"]} for item in found for row in _outside(item)],
        "gains_off": [item["gain"] | {"index": item["index"]} for item in made if _gain_off(item)],
    }


def as_text(table: dict[str, Any]) -> str:
    """Return the document of `summary` as text."""
    rows = [f"{table['made']} of {table['draws']} draws made"]
    for line in table["lines"]:
        asked = "" if line["asked"] is None else f"  asked {line['asked']:.2f}: {_verdict(line)}"
        count = "" if line["of"] is None else f" ({line['count']} of {line['of']})"
        rows.append(f"{line['what']:<50} {line['reached']:8.2f}{count}{asked}")
    rows.append(f"parameters fitted otherwise than hidden, not counted: {table['parameters_not_comparable']}")
    rows += ["", "misses:"]
    rows += [f"  {miss_text(item)}" for item in table["misses"]] or ["  none"]
    rows += ["", "parameters outside their intervals:"]
    rows += [
        f"  {row['index']:3d} {row['parameter']}: true {row['true']:.4g}, fitted {row['fitted']:.4g} "
        f"({row['low']:.4g} to {row['high']:.4g})"
        for row in table["not_covered"]
    ] or ["  none"]
    rows += ["", "gains on the third set outside the claimed interval [%]:"]
    rows += [
        f"  {row['index']:3d} claimed {row['claimed']:.1f} "
        f"({_number(row['low'])} to {_number(row['high'])}), "
        f"third {row['third']:.1f} ({row['third_low']:.1f} to {row['third_high']:.1f})"
        for row in table["gains_off"]
    ] or ["  none"]
    rows += ["", "robot.toml of the diagnosis that is no robot:"]
    rows += [f"  {row['index']:3d} {row['why']}" for row in table["robots_refused"]] or ["  none"]
    return "\n".join(rows)


def miss_text(item: Score) -> str:
    """Return one draw in a line: what was hidden, what was said instead, and whether it could be told."""
    said = item["verdict"]
    if item["named"]:
        said += f" {' + '.join(item['named'])}"
    if item.get("alike"):
        said += f", alike {' | '.join(' = '.join(group) for group in item['alike'])}"
    if item.get("failure"):
        said += f": {item['failure']}"
    text = f"{item['index']:3d} {item['robot']}, {item['story']}: {' + '.join(item['true']) or 'nothing'}"
    text += f" ({item['size']:.0f} x noise, {item['rows']} rows) -> {said}"
    if "distance" in item:
        text += f"; from the truth {item['distance']:.1f} ({item['distance_rms']:.2f} x noise a value)"
    if "truth_tried" in item and item["story"] in ("single", "pair") and not item["right"]:
        tried = item["truth_tried"]
        place = f"place {tried['place']}" if tried else "not"
        text += f"; the truth was {place} among those tried"
    if "after_over_noise" in item:
        text += f"; error {item['before_over_noise']:.2f} -> {item['after_over_noise']:.2f} x noise"
    return text


def _share(what: str, items: Sequence[Score], asked: float | None) -> dict[str, Any]:
    return _counted(what, [item["right"] for item in items], asked)


def _counted(what: str, hits: Iterable[bool], asked: float | None, most: bool = False) -> dict[str, Any]:
    values = list(hits)
    reached = sum(values) / len(values) if values else math.nan
    met = None
    if asked is not None:
        met = bool(reached <= asked if most else reached >= asked)  # NaN meets nothing
    return {
        "what": what,
        "reached": reached,
        "count": sum(values),
        "of": len(values),
        "asked": asked,
        "met": met,
    }


def _value(what: str, values: Sequence[float], asked: float | None) -> dict[str, Any]:
    finite = [value for value in values if math.isfinite(value)]
    reached = float(np.median(finite)) if finite else math.nan
    met = None if asked is None else bool(reached <= asked)
    return {"what": what, "reached": reached, "count": None, "of": None, "asked": asked, "met": met}


def _verdict(line: dict[str, Any]) -> str:
    if not math.isfinite(line["reached"]):
        return "not measured"
    return "met" if line["met"] else "MISSED"


def _outside(item: Score) -> list[dict[str, Any]]:
    return [row for row in item.get("coverage", []) if row["comparable"] and not row["inside"]]


def _gain_off(item: Score) -> bool:
    return "gain" in item and not item["gain"]["inside"]


def _number(value: float | None) -> str:
    return "none" if value is None else f"{value:.1f}"
