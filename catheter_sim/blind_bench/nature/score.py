"""Scores one diagnosis against the answer: by what its file says, and nothing else."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from catheter_sim.blind_bench.places import ANSWER, Folders, read_json

SURE = 0.5  # probability beyond which something outside the list is claimed
NONE, OUTSIDE = "none", "outside"  # keys of `probabilities` besides the causes
Document = Mapping[str, Any]


def score(folders: Folders, run: Document) -> dict[str, Any]:
    """Return the score of one draw.

    Args:
        folders: with the answer and what the diagnosis wrote.
        run: how the diagnosis went: `seconds`, and `failure`, "" if it ended well.
    """
    answer = read_json(folders.answer / ANSWER)
    found = read_json(folders.found / "diagnosis.json")
    return scored(answer, None if run["failure"] else found, run)


def scored(answer: Document, found: Document | None, run: Document) -> dict[str, Any]:
    """Return the score of a diagnosis, None where there is none."""
    hidden = answer["hidden"]
    result: dict[str, Any] = {
        "index": answer["index"],
        "story": answer["story"],
        "robot": answer["robot"],
        "true": [item["cause"] for item in hidden],
        "forms": [item["form"] for item in hidden],
        "known": all(item["known"] for item in hidden),
        "sizes": [item["over_noise"] for item in hidden],
        "noise_kind": answer["noise_kind"],
        "rows": answer["rows"],
        "seconds": run["seconds"],
        "failure": run["failure"],
        "verdict": "failed",
        "named": [],
        "right": False,
        "exact": False,
        "false_alarm": False,
        "grouped": False,
        "groups": [],
        "another_named": False,
        "named_right": False,
        "probabilities": None,
        "intervals": [],
    }
    if found is None:
        return result
    named = [cause["name"] for cause in found["causes"]]
    groups = [set(cause.get("one_of") or [cause["name"]]) for cause in found["causes"]]
    chances = probabilities_of(found)
    result |= {
        "verdict": found["verdict"],
        "named": named,
        "grouped": any(len(group) > 1 for group in groups[:1]),
        "groups": [[cause["probability"], sorted(cause["one_of"])] for cause in _grouped(found)],
        "alike": found.get("indistinguishable", []),
        "forms_named": [cause.get("form", "") for cause in found["causes"]],
        "implausible": [cause["name"] for cause in found["causes"] if cause.get("plausible") is False],
        "probabilities": chances,
        "intervals": _intervals(hidden, found["causes"]) if answer["story"] in ("single", "pair") else [],
        "after_over_noise": _after(answer, found),
    }
    result |= _judged(answer, found, named, groups, chances)
    return result


def _grouped(found: Document) -> list[Document]:
    """Return the causes and corrections that are groups."""
    every = (*found["causes"], *found.get("corrections", ()))
    return [cause for cause in every if len(cause.get("one_of") or ()) > 1]


def probabilities_of(found: Document) -> dict[str, float] | None:
    """Return the probability of every cause, of none and of outside; None where none is given."""
    given = found.get("probabilities")
    if isinstance(given, Mapping) and given:
        return {str(name): float(value) for name, value in given.items()}
    single = {
        cause["name"]: float(cause["probability"])
        for cause in found["causes"]
        if cause.get("probability") is not None
    }
    return single or None


def accepted(item: Document) -> set[str]:
    """Return the names that are right for one hidden cause."""
    return {item["cause"], *item["also"], *item.get("alike", [])}


def called_outside(found: Document, chances: Mapping[str, float] | None) -> bool:
    """Return whether a diagnosis says that something is at work that is not on its list."""
    return found["verdict"] in ("unexplained", "improved") or (chances or {}).get(OUTSIDE, 0.0) > SURE


def named_beside(answer: Document, groups: Sequence[set[str]]) -> list[set[str]]:
    """Return the named causes, or groups, of which nothing is at work, nor says the same."""
    right = set().union(*(accepted(item) for item in answer["hidden"]))
    return [group for group in groups if not group & right]


def _judged(
    answer: Document,
    found: Document,
    named: Sequence[str],
    groups: Sequence[set[str]],
    chances: Mapping[str, float] | None,
) -> dict[str, bool]:
    hidden = answer["hidden"]
    beside = bool(named_beside(answer, groups))
    if answer["story"] == "none":
        alarm = found["verdict"] == "cause_found"
        return {"right": not alarm, "exact": found["verdict"] == "no_discrepancy", "false_alarm": alarm}
    if answer["story"] == "outside":
        right = called_outside(found, chances)
        return {"right": right, "exact": right, "another_named": beside}
    if answer["story"] == "single":
        (item,) = hidden
        exact = named[:1] == [item["cause"]]
        right = bool(groups) and bool(groups[0] & accepted(item))
        result = {"named_right": right, "exact": exact, "another_named": beside}
        if not item["known"]:
            right = right or (not beside and called_outside(found, chances))
        return result | {"right": right}
    exact = all(item["cause"] in named for item in hidden)
    first, second = (accepted(item) for item in hidden)
    pairs = ((one, other) for one in groups for other in groups if one is not other)
    both = any(one & first and other & second for one, other in pairs)
    return {"right": both, "named_right": both, "exact": exact, "another_named": beside}


def _intervals(hidden: Sequence[Document], causes: Sequence[Document]) -> list[dict[str, Any]]:
    """Return whether each true parameter lies in its interval, where its form fits one to one."""
    rows = []
    for item in hidden:
        for cause in causes:
            fitted = cause["parameters"]
            if cause["name"] != item["cause"] or not item["known"] or set(fitted) != set(item["parameters"]):
                continue
            for name, value in item["parameters"].items():
                low, high = fitted[name].get("ci95") or (None, None)
                low = -math.inf if low is None else low
                high = math.inf if high is None else high
                rows.append(
                    {
                        "parameter": f"{cause['name']}.{name}",
                        "true": value,
                        "fitted": fitted[name]["value"],
                        "low": low,
                        "high": high,
                        "inside": low <= value <= high,
                    }
                )
    return rows


def _after(answer: Document, found: Document) -> float | None:
    noise = answer["noise"].get(found.get("unit", "mm"))
    after = found.get("heldout", {}).get("rmse_after")
    return None if noise is None or after is None else after / noise
