"""Scores what was told of a draw against its answer: read from `diagnosis.json`, as a user would."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from catheter_sim.blind_bench.nature.score import scored
from catheter_sim.blind_bench.places import ANSWER, Folders, read_json

Document = Mapping[str, Any]
_AS_CAUSES = {"changed": "cause_found", "unchanged": "no_discrepancy"}


def score(folders: Folders, run: Document) -> dict[str, Any]:
    """Return the score of one draw.

    Args:
        folders: with the answer and what the comparison wrote.
        run: how it went: `seconds`, and `failure`, "" if it ended well.
    """
    answer = read_json(folders.answer / ANSWER)
    found = read_json(folders.found / "diagnosis.json")
    return scored_change(answer, None if run["failure"] else found, run)


def scored_change(answer: Document, found: Document | None, run: Document) -> dict[str, Any]:
    """Return the score of a comparison, None where there is none: as of a diagnosis whose causes changed.

    Nothing changed and "changed" is told: a false alarm. "unexplained" is none, but not the answer either.
    """
    about = {"commands": answer["commands"], "shared": [item["cause"] for item in answer["shared"]]}
    if found is None:
        return scored(answer, None, run) | about
    verdict = found["verdict"]
    as_diagnosis = {**found, "causes": found["changes"], "verdict": _AS_CAUSES.get(verdict, verdict)}
    since = found.get("since", {})
    return (
        scored(answer, as_diagnosis, run)
        | about
        | {"verdict": verdict, "paired_rows": since.get("paired_rows")}
    )
