"""Fit how much each number counts for a cause's probability, to finished draws of a bench of hidden effects.

    python scripts/calibrate_probabilities.py results/tuning_1 results/tuning_2

Each folder is one that a bench wrote: answers/ holds what was hidden, found/ what was diagnosed. Printed are
the weights of `diagnosis/probabilities.py` (LOG_ODDS_OF_..., MEMBER_WEIGHT). They are the most probable of a
logistic regression that starts from what was believed of each before any draw (BELIEVED, with a normal
distribution of SPREAD); none goes against its sign. Of causes that no good hypothesis has they are counted
(one answer of each kind added, after Laplace). A group of causes that the data cannot tell apart is one
answer. Then how well the probabilities promise: Brier score, and of each bin of answers the mean promise and
the share that was right, each draw by weights fitted without it (ten folds). What a bench takes for neither
right nor wrong is left out. Draws whose accuracy is judged must not be among them.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))  # where the benches lie

from scipy.optimize import minimize

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.probabilities import (
    CauseEvidence,
    Evidence,
    features_of_named,
    features_of_none,
    features_of_outside,
    features_of_rival,
)
from catheter_sim.diagnosis.result import DATA_SUSPECT, NONE, OUTSIDE
from catheter_sim.effects import EFFECTS
from hidden_effects.running import read_json

SPREAD = 0.5  # standard deviation of a believed weight, of itself: a few dozen answers change it
FOLDS = 10
COUNTED = ("others",)  # kinds of which nothing is known
BELIEVED = {  # weights before any draw; 0: nothing is believed
    "named": (0.0, 0.3, 2.0, 0.15, 0.1, -0.7, -1.0, -0.5, -0.5, 0.6),
    "rivals": (0.0, 0.21, 0.5, -0.1),
    "none": (0.0, -3.0, -1.0),
    "outside": (0.0, 2.69, 0.53, 0.15, 0.5, 0.5),
    "member": (0.0, 0.7),
}
Features = tuple[float, ...]


@dataclass(frozen=True)
class Row:
    """One answer: of which cause, its kind, the draw, what speaks for it, and whether it is true."""

    name: str
    kind: str
    draw: int
    features: Features
    true: bool


def main() -> int:
    """Print the weights and how well they promise; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folders", nargs="+", metavar="DIR", help="that a bench wrote")
    options = parser.parse_args()
    rows: list[Row] = []
    for folder in options.folders:
        found = list(rows_of(Path(folder), start=len({row.draw for row in rows})))
        if not found:
            print(f"calibrate_probabilities: error: {folder}: holds no finished draws", file=sys.stderr)
            return 2
        rows += found
    promised: list[Array] = []
    for kind in dict.fromkeys(row.kind for row in rows):
        mine = [row for row in rows if row.kind == kind]
        basis = np.array([row.features for row in mine])
        true = np.array([row.true for row in mine], dtype=float)
        weights = weigh(kind, basis, true)
        print(f"LOG_ODDS_OF_{kind.upper()} = ({', '.join(f'{value:.2f}' for value in weights)},)")
        print(f"    {len(mine)} answers, {int(true.sum())} true")
        draws = np.array([row.draw for row in mine])
        promise = np.zeros(len(mine))
        for fold in range(FOLDS):
            left_out = draws % FOLDS == fold
            if left_out.any() and not left_out.all():
                promise[left_out] = chance(basis[left_out] @ weigh(kind, basis[~left_out], true[~left_out]))
        promised.append(np.stack([promise, true], axis=1))
    print(reliability(np.concatenate(promised)))
    return 0


def rows_of(folder: Path, start: int) -> Sequence[Row]:
    """Return every answer of a bench's finished draws."""
    rows: list[Row] = []
    for number, path in enumerate(sorted((folder / "answers").glob("*/answer.json"))):
        found = read_json(folder / "found" / path.parent.name / "diagnosis.json")
        answer = read_json(path)
        if found is None or answer is None or found["verdict"] == DATA_SUSPECT or not found.get("evidence"):
            continue
        score = read_json(folder / "scores" / f"{path.parent.name}.json") or {}
        neither = {*score.get("either", []), *([OUTSIDE] if _foreign(answer) else [])}
        evidence = from_numbers(found["evidence"])
        every = _rows(evidence, *_hidden(answer), start + number)
        rows += [row for row in every if row.name not in neither]
    return rows


def _foreign(answer: dict[str, Any]) -> bool:
    """Return whether a cause is hidden in a form that the diagnosis has none for."""
    return any(not item["known"] and not item["outside"] for item in answer.get("hidden", []))


def _hidden(answer: dict[str, Any]) -> tuple[set[str], bool]:
    """Return the causes that an answer of either bench holds, and whether one is outside the list."""
    if "hidden" in answer:
        outside = any(item["outside"] for item in answer["hidden"])
        return {item["cause"] for item in answer["hidden"] if not item["outside"]}, outside
    return set(answer["effects"]), bool(answer["outside"])


def _rows(found: Evidence, true: set[str], outside: bool, draw: int) -> list[Row]:
    rows = []
    members = {name for item in found.causes.values() for name in item.members}
    for name in EFFECTS:
        item = found.causes.get(name)
        if item is None:
            if name not in members:
                rows.append(Row(name, "others", draw, (1.0,), name in true))
        elif item.named:
            right = bool({name, *item.members} & true)
            rows.append(Row(name, "named", draw, features_of_named(item, found), right))
            # Of two that stand in one place, and of which one is at work, how often it is the surer one.
            for other, surer in item.members.items():
                if len({name, other} & true) == 1:
                    rows.append(Row(name, "member", draw, (0.0, surer), name in true))
        else:
            rows.append(Row(name, "rivals", draw, features_of_rival(item), name in true))
    rows.append(Row(OUTSIDE, "outside", draw, features_of_outside(found), outside))
    nothing = not true and not outside
    rows.append(Row(NONE, "none", draw, features_of_none(found), nothing))
    return rows


def from_numbers(document: Mapping[str, Mapping[str, float]]) -> Evidence:
    """Return the evidence of which `as_numbers` made a document."""
    whole = document["all"]
    causes = {
        name: CauseEvidence(
            bool(item["named"]),
            item["over_others"],
            item["over_unknown"],
            item["ratio"],
            int(item["numbers"]),
            {other: item[f"over_{other}"] for other in EFFECTS if f"over_{other}" in item},
        )
        for name, item in document.items()
        if name != "all"
    }
    return Evidence(
        causes,
        whole["over_none"],
        int(whole["sets_tried"]),
        whole["times_noise"],
        whole["unknown"],
        whole["unknown_share"],
        whole["times_before"],
        whole["structure"],
        bool(whole["harmful"]),
        int(whole["values"]),
    )


def weigh(kind: str, basis: Array, true: Array) -> Array:
    """Return the weights of a kind of answers, shape (f,)."""
    return counted(basis, true) if kind in COUNTED else fitted(basis, true, BELIEVED[kind])


def counted(basis: Array, true: Array) -> Array:
    """Return the weights by which each sort of answers promises the share that is true, shape (f,).

    There are as many sorts as weights, or fewer.
    """
    sorts, sort = np.unique(basis, axis=0, return_inverse=True)
    right, count = np.bincount(sort.ravel(), weights=true) + 1.0, np.bincount(sort.ravel()) + 2.0
    return np.asarray(np.linalg.lstsq(sorts, np.log(right / (count - right)), rcond=None)[0])


def fitted(basis: Array, true: Array, believed: Sequence[float]) -> Array:
    """Return the most probable weights after the answers, shape (f,), none against a believed one's sign."""
    before = np.array(believed)
    size = np.where(before == 0.0, np.inf, SPREAD * np.abs(before))

    def loss(weights: Array) -> tuple[float, Array]:
        log_odds, off = basis @ weights, (weights - before) / size
        missed = float(np.logaddexp(0.0, log_odds).sum() - true @ log_odds)
        slope = basis.T @ (chance(log_odds) - true)
        return missed + 0.5 * float(off @ off), slope + off / size

    bounds = [(0.0 if value > 0.0 else None, 0.0 if value < 0.0 else None) for value in believed]
    return np.asarray(minimize(loss, before, jac=True, method="L-BFGS-B", bounds=bounds).x)


def chance(log_odds: Array) -> Array:
    """Return probabilities of log odds."""
    return np.asarray(1.0 / (1.0 + np.exp(-np.clip(log_odds, -30.0, 30.0))))


def reliability(answers: Array, form: Callable[[float], str] = "{:.2f}".format) -> str:
    """Return the Brier score, and the promise and the truth of each bin of answers, as text."""
    lines = [f"Brier score {np.mean((answers[:, 0] - answers[:, 1]) ** 2):.4f} of {len(answers)} answers"]
    for low in np.arange(0.0, 1.0, 0.1):
        mine = answers[(answers[:, 0] >= low) & (answers[:, 0] < low + 0.1 + (low > 0.85))]
        if len(mine):
            promise, right = mine.mean(axis=0)
            lines.append(f"{len(mine):6d} answers: promised {form(promise)}, true {form(right)}")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
