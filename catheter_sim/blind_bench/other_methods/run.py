"""Runs the other methods on the data sets of the independent bench, and scores them as the diagnosis is."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from catheter_sim.blind_bench.elsewhere import run_all
from catheter_sim.blind_bench.nature.code import judging_code
from catheter_sim.blind_bench.nature.score import scored
from catheter_sim.blind_bench.other_methods.methods import METHODS, named_by
from catheter_sim.blind_bench.places import ANSWER, Folders, read_json, write_json
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.prepare import pose, prepare
from catheter_sim.errors import InputError

PLACE = "other_methods"  # folder of what they found, in the bench's


def run_methods(
    root: Path, draws: Sequence[int], jobs: int, on_score: Callable[[dict[str, Any]], None]
) -> list[dict[str, Any]]:
    """Return the scores of every method on every draw whose data lie in a bench's folder.

    What this very code has scored is not run again.
    """
    arguments = [(root, index, method) for index in draws for method in METHODS]
    return run_all(score_of, arguments, jobs, on_score)


def score_of(root: Path, index: int, method: str) -> dict[str, Any]:
    """Return the score of one method on one draw; {} where no data lie there."""
    folders, code = Folders(root, index), judging_code()
    place = root / PLACE / method / f"{folders.name}.json"
    known = read_json(place)
    if known is not None and known["code"] == code:
        return dict(known)
    answer = read_json(folders.answer / ANSWER)
    if answer is None or "hidden" not in answer:
        return {}
    begun, found, failure = time.monotonic(), None, ""
    try:
        found = _as_found(named_by(method, pose(prepare(load_dataset(folders.data))).train))
    except (InputError, np.linalg.LinAlgError) as error:
        failure = str(error)
    run = {"seconds": time.monotonic() - begun, "failure": failure}
    result = scored(answer, found, run) | {"method": method, "code": code}
    write_json(result, place)
    return dict(result)


def _as_found(named: Sequence[str]) -> dict[str, Any]:
    """Return what a method names in the words of a diagnosis; it has none for what is not on its list."""
    return {
        "verdict": "cause_found" if named else "no_discrepancy",
        "causes": [{"name": name, "parameters": {}} for name in named],
    }
