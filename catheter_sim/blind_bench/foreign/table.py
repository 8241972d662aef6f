"""The table of the bench of foreign models: how many hidden causes are named, how many falsely."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

NAMED_SHARE = 0.8
Draw = Mapping[str, Any]


def outcome(draw: Draw) -> str:
    """Return "named", "in part" (with another cause), "false", "missed", or for nothing hidden "quiet"."""
    named, hidden = set(draw["named"]), draw["hidden"]
    if hidden is None:
        return "false" if named else "quiet"
    same = {hidden["cause"]}
    for group in draw["indistinguishable"]:
        same |= set(group) if hidden["cause"] in group else set()
    if not named:
        return "missed"
    if named <= same:
        return "named"
    return "in part" if named & same else "false"


def summary(draws: Sequence[Draw]) -> dict[str, int]:
    """Return counts of outcomes among draws with something hidden and with nothing."""
    found = {"hidden": sum(draw["hidden"] is not None for draw in draws)}
    found["nothing"] = len(draws) - found["hidden"]
    for words in ("named", "in part", "missed"):
        found[words] = sum(outcome(draw) == words for draw in draws)
    found["false"] = sum(outcome(draw) == "false" and draw["hidden"] is not None for draw in draws)
    found["false_of_nothing"] = sum(outcome(draw) == "false" and draw["hidden"] is None for draw in draws)
    return found


def met(found: Mapping[str, int]) -> bool:
    """Return whether eight of ten hidden causes are named, and nothing where nothing is hidden."""
    enough = found["named"] >= NAMED_SHARE * found["hidden"]
    return found["hidden"] > 0 and enough and not found["false_of_nothing"]


def as_text(found: Mapping[str, int], draws: Sequence[Draw]) -> str:
    """Return the table for a reader, with every draw that was not as it should be."""
    words = "met" if met(found) else "MISSED"
    lines = [
        f"{found['hidden']} hidden causes: {found['named']} named, {found['in part']} with another one, "
        f"{found['false']} falsely, {found['missed']} not at all",
        f"{found['nothing']} with nothing hidden: {found['false_of_nothing']} named something",
        f"{words}: at least {100 * NAMED_SHARE:.0f} % named, and nothing where nothing is hidden",
    ]
    for draw in draws:
        if outcome(draw) not in ("named", "quiet"):
            hidden = draw["hidden"]["cause"] if draw["hidden"] else "nothing"
            before, after = draw["times_noise"]
            lines.append(
                f"draw {draw['index']}, {draw['model']}, hidden {hidden}: {draw['verdict']} "
                f"{' + '.join(draw['named'])}, {before} -> {after} times the noise"
            )
    return "\n".join(lines)
