"""Tell the diagnosis which causes are at work, and see whether it would name them.

    python scripts/natural_effects.py --draws 45 --seed 1 --purpose tune -o results/nature
    python scripts/given_the_causes.py results/nature --story pair

A cause that was not named was not found, or it was found and does not explain enough. To part the two, the
search is left out: the hidden causes are fitted in every combination of the forms that the diagnosis knows,
and the best by stretches left out goes to the held-out trials and to the verdict, as if the search had chosen
it. What is named then is the most that a better search could name as a whole (causes that are named in part,
beside something unknown, are not asked for). What is not has a law that no form has, or looks like bad data.
Of each draw the error is printed, over the noise: of the calibrated model, and of the best fit, on the
training trials and on the held-out ones.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))  # where the benches lie

from catheter_sim.cli.arguments import whole_number
from catheter_sim.diagnosis.choose import Choice, decide_on_heldout, without_explained_faults
from catheter_sim.diagnosis.conclude import examine, judge, score_hypotheses
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.fit import Fit, fit
from catheter_sim.diagnosis.prepare import calibrate, find_data_faults, prepare, running, split_problem
from catheter_sim.diagnosis.problem import (
    Problem,
    Term,
    further_terms,
    in_other_forms,
    terms_for,
    with_fewer_rows,
)
from catheter_sim.diagnosis.search import Selection, candidates_for
from catheter_sim.diagnosis.workers import SERIAL
from hidden_effects.natural import accepted, scores_in
from hidden_effects.running import ANSWER, Folders, read_json

ROUGH_STEPS, FITTED_WELL = 6, 3
COLUMNS = (
    "draw",
    "robot",
    "hidden",
    "forms",
    "forms known",
    "named by the diagnosis",
    "its verdict",
    "error before",
    "left in training",
    "left held out",
    "verdict given the causes",
    "named then",
    "all named then",
)


def main() -> int:
    """Print a row for each draw, and how many would be named; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("bench", metavar="DIR", help="a folder of scripts/natural_effects.py, diagnosed")
    parser.add_argument("--story", choices=("single", "pair"), default="pair", help="default pair")
    parser.add_argument("--missed", action="store_true", help="only draws that the diagnosis got wrong")
    parser.add_argument("--most", type=whole_number(1, 10**6), default=10**6, help="draws at most")
    parser.add_argument("-o", "--output", metavar="FILE.csv", help="write the rows there, too")
    options = parser.parse_args()
    root = Path(options.bench)
    scores = [item for item in scores_in(root) if item["story"] == options.story]
    scores = [item for item in scores if not (options.missed and item["right"])][: options.most]
    if not scores:
        print(f"given_the_causes: error: {root}: no such draw of the present code", file=sys.stderr)
        return 2
    rows = []
    for score in scores:
        rows.append(row := given(root, score))
        print("; ".join(f"{name}: {value}" for name, value in row.items()), flush=True)
    if options.output:
        with open(options.output, "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, COLUMNS)
            writer.writeheader()
            writer.writerows(rows)
    named = sum(row["all named then"] for row in rows)
    print(f"{named} of {len(rows)} would be named; {sum(item['right'] for item in scores)} were")
    return 0


def given(root: Path, score: dict[str, Any]) -> dict[str, Any]:
    """Return the row of one draw."""
    folders = Folders(root, score["index"])
    hidden = read_json(folders.answer / ANSWER)["hidden"]
    split = split_problem(prepare(load_dataset(folders.data)))
    before = calibrate(split)
    with running(SERIAL, False) as run:
        faults = without_explained_faults(run, split, before, find_data_faults(split, before))
        choice = told(split.train, [item["cause"] for item in hidden], split.thorough)
        kept = decide_on_heldout(run, split, before, choice)
        examined = examine(split, before, kept)
        scores = score_hypotheses(run, split, choice, kept, examined, faults)
        verdict = judge(split, before, kept, faults, examined, scores)
    of_unit = kept.pruned.by_unit[kept.unit]
    names = set(verdict.established)
    values = (
        score["index"],
        score["robot"],
        " + ".join(item["cause"] for item in hidden),
        " + ".join(item["form"] for item in hidden),
        " + ".join("known" if item["known"] else "foreign" for item in hidden),
        " + ".join(score["named"]) or "nothing",
        score["verdict"],
        round(of_unit.rmse_before / of_unit.noise_floor, 2),
        round(float(np.sqrt(np.mean(choice.fit.residual**2))), 2),
        round(of_unit.rmse_after / of_unit.noise_floor, 2),
        verdict.name,
        " + ".join(sorted(names)) or "nothing",
        all(accepted(item) & names for item in hidden),
    )
    return dict(zip(COLUMNS, values, strict=True))


def told(problem: Problem, causes: Sequence[str], thorough: bool) -> Choice:
    """Return the causes in those of their forms that do best on stretches left out."""
    few = with_fewer_rows(problem)
    forms = [_terms(few, name) for name in causes if name in candidates_for(problem)]
    rough = [
        fit(few, terms, None, cross_validate=False, most=ROUGH_STEPS) for terms in itertools.product(*forms)
    ]
    rough.sort(key=lambda item: float(item.residual @ item.residual))
    well = [fit(few, item.terms, item.values) for item in rough[:FITTED_WELL]]
    best: Fit = min(well, key=lambda item: item.cross_validated_rms)
    null = fit(few, (), None)
    selection = Selection(null, (), tuple(well), (null, best), best, ())
    fitted = fit(problem, best.terms, best.values, cross_validate=False, thorough=thorough)
    return Choice(tuple(causes), selection, fitted)


def _terms(problem: Problem, cause: str) -> tuple[Term, ...]:
    robot, moving = problem.robot, problem.moving
    first = (*terms_for(robot, cause, moving), *further_terms(robot, cause, moving))
    others = (other for term in first for _, other in in_other_forms(robot, term, moving))
    return tuple(dict.fromkeys((*first, *others)))


if __name__ == "__main__":
    sys.exit(main())
