"""The table of a bench of spoiled data: one row a kind, and every miss."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from catheter_sim.blind_bench.spoiled.kinds import KINDS
from catheter_sim.blind_bench.spoiled.score import ALIKE, NONE_NAMED, REFUSED, SUSPECT, TRUE_CAUSE

Score = Mapping[str, Any]
_ENDS = (SUSPECT, REFUSED, NONE_NAMED, TRUE_CAUSE, ALIKE)
_HEAD = (
    "kind",
    "what happened",
    "draws",
    "suspect",
    "refused",
    "no cause",
    "true cause",
    "says the same",
    "wrong",
)


def as_markdown(scores: Sequence[Score]) -> str:
    """Return one row for each kind: how its diagnoses ended."""
    lines = [f"| {' | '.join(_HEAD)} |", "|" + "---|" * len(_HEAD)]
    for kind in KINDS:
        own = [score for score in scores if score["kind"] == kind.name]
        if not own:
            continue
        ends = Counter(score["end"] for score in own)
        wrong = sum(not score["right"] for score in own)
        counts = [len(own), *(ends[end] for end in _ENDS), wrong]
        cells = (f"`{kind.name}`", kind.words, *(str(count or "") for count in counts))
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def summary_text(scores: Sequence[Score]) -> str:
    """Return what the draws say together, and every miss."""
    spoiled = [score for score in scores if score["kind"] != "sound"]
    sound = [score for score in scores if score["kind"] == "sound"]
    kinds = {score["kind"] for score in spoiled}
    right = [kind for kind in kinds if all(item["right"] for item in spoiled if item["kind"] == kind)]
    lines = [
        f"spoiled: {sum(score['right'] for score in spoiled)} of {len(spoiled)} draws, "
        f"{len(right)} of {len(kinds)} kinds without a cause that is not there",
        f"sound: {sum(score['right'] for score in sound)} of {len(sound)} draws neither suspected nor given "
        f"a wrong cause; the hidden cause named in {sum(score['end'] == TRUE_CAUSE for score in sound)} of "
        f"{sum(bool(score['true']) for score in sound)}",
    ]
    lines += [f"MISS {score_text(score)}" for score in scores if not score["right"]]
    return "\n".join(lines)


def score_text(score: Score) -> str:
    """Return a draw and how its diagnosis ended, in one line."""
    hidden = " + ".join(f"{cause}.{form}" for cause, form in zip(score["true"], score["forms"], strict=True))
    named = f": {', '.join(score['named'])}" if score["named"] else ""
    said = "; ".join(
        f"{item['where']}: {item['what']}" if item.get("where") else item["what"]
        for item in score["suspicions"]
    )
    why = score["failure"] or said
    return (
        f"{score['kind']} {score['draw']}, {score['robot']}, {hidden or 'nothing'} hidden: "
        f"{score['end']}{named}{f' ({why})' if why else ''}"
    )
