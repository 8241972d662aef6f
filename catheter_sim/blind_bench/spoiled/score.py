"""Scores the diagnosis of a spoiled recording: by what its file says, and nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from catheter_sim.blind_bench.nature.score import accepted

Document = Mapping[str, Any]
# How a diagnosis may end.
SUSPECT, REFUSED, NONE_NAMED, TRUE_CAUSE, ALIKE, WRONG, FAILED = (
    "data_suspect",
    "refused",
    "no cause",
    "true cause",
    "says the same",
    "wrong cause",
    "failed",
)
_BAD_INPUT = "exit status 2:"


def scored(answer: Document, found: Document | None, run: Document) -> dict[str, Any]:
    """Return the score of a diagnosis, None where there is none.

    Right is whatever names no cause that is not there: the data are suspect or refused, nothing is named, or
    the causes that are truly there are named, or such as say the very same as the spoiling. In sound data it
    is wrong to suspect or to refuse anything.
    """
    true = set().union(*(accepted(item) for item in answer["hidden"]))
    named = [] if found is None else [cause["name"] for cause in found["causes"]]
    end = _end(found, run, set(named), true, set(answer["alike"]))
    right = end in (NONE_NAMED, TRUE_CAUSE) if answer["sound"] else end not in (WRONG, FAILED)
    return {
        "kind": answer["kind"],
        "words": answer["words"],
        "seed": answer["seed"],
        "draw": answer["draw"],
        "robot": answer["robot"],
        "recording": answer["recording"],
        "true": [item["cause"] for item in answer["hidden"]],
        "forms": [item["form"] for item in answer["hidden"]],
        "named": named,
        "verdict": "" if found is None else found["verdict"],
        "end": end,
        "right": right,
        "suspicions": [] if found is None else found.get("suspicions", []),
        "failure": run["failure"],
        "seconds": run["seconds"],
    }


def _end(found: Document | None, run: Document, named: set[str], true: set[str], alike: set[str]) -> str:
    if found is None:
        return REFUSED if run["failure"].startswith(_BAD_INPUT) else FAILED
    if found["verdict"] == "data_suspect" and not named:
        return SUSPECT
    if not named:
        return NONE_NAMED
    if named <= true:
        return TRUE_CAUSE
    return ALIKE if named <= true | alike else WRONG
