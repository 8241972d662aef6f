"""What people do instead of a diagnosis, on the same data, with the same twin."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.fit import Fit, fit, linearised
from catheter_sim.diagnosis.prepare import prepare, split_problem
from catheter_sim.diagnosis.problem import (
    Problem,
    Term,
    box_of,
    fitted_numbers,
    start_of,
    terms_for,
    with_fewer_rows,
)
from catheter_sim.diagnosis.search import candidates_for
from catheter_sim.errors import InputError
from hidden_effects.natural import judging_code, scored
from hidden_effects.running import ANSWER, Folders, read_json, run_all, write_json

# ----------------------------------------------------------------------------------------------------
# Three usual ways from a data set to what is wrong: fit everything, lasso, forward selection by BIC.
#
# All get the diagnosis's twin, its calibrated numbers, its noise and each cause's simplest parameters; what
# they lack is what a diagnosis has besides: data that were left out, other forms, a word for what is not on
# the list.

Named = list[str]  # causes, surest first
_CHANCE = 0.01  # of a false name in a whole data set
_MOST_CAUSES = 5
_FOLDS, _PENALTIES, _LEAST_PENALTY = 5, 25, 1e-3
_SWEEPS, _LINEARISED = 400, 3


def everything_at_once(problem: Problem) -> Named:
    """Fit all numbers of all causes (trust region in the bounds, `scipy.optimize.least_squares`).

    Named is what is off its null by more than its standard error makes likely, largest standardised change
    first.
    """
    found = fit(problem, all_terms(problem), cross_validate=False, thorough=True)
    change = found.x - _null(found)
    normal = found.jacobian.T @ found.jacobian
    freedom = max(len(found.residual) - len(found.x), 1)
    variance = float(found.residual @ found.residual) / freedom
    covariance = variance * np.linalg.pinv(normal, hermitian=True)
    size: dict[str, float] = {}
    for cause, mine in _by_cause(found).items():
        step = change[mine]
        size[cause] = float(step @ np.linalg.pinv(covariance[np.ix_(mine, mine)], hermitian=True) @ step)
    bound = {cause: chi2.isf(_CHANCE / len(size), len(mine)) for cause, mine in _by_cause(found).items()}
    sure = [cause for cause, value in size.items() if value > bound[cause]]
    return sorted(sure, key=lambda cause: -size[cause] / bound[cause])


def lasso(problem: Problem) -> Named:
    """Fit all numbers of all causes with a price on each standardised change (Tibshirani 1996).

    The price is the largest whose error on stretches left out lies within a standard error of the least
    one's; the model is linearised anew at what was found. Named is what is off its null, largest first.
    """
    numbers = fitted_numbers(problem, all_terms(problem))
    null = start_of(numbers, {item.key: item.parameter.null for item in numbers})
    low, high = box_of(numbers)
    priced = np.array([bool(item.effect) for item in numbers])
    point = np.clip(start_of(numbers), low, high)
    size = np.zeros(len(numbers))
    start = fit(problem, (), cross_validate=False)
    block = start.block
    for _ in range(_LINEARISED):
        at = linearised(problem, numbers, point, high)
        scale = np.maximum(np.sqrt((at.jacobian**2).mean(axis=0)), 1e-12)
        matrix = at.jacobian / scale
        target = at.jacobian @ (point - null) - at.error
        size = _priced_by_folds(matrix, target, priced, block)
        point = np.clip(null + size / scale, low, high)
    own: dict[str, float] = {}
    for item, value in zip(numbers, size, strict=True):
        if item.effect and value != 0.0:
            own[item.effect] = max(own.get(item.effect, 0.0), abs(float(value)))
    return sorted(own, key=lambda cause: -own[cause])


def forward_by_bic(problem: Problem) -> Named:
    """Add the cause that lowers Schwarz's criterion most, on the training data alone, until none does."""
    rest = [terms_for(problem.robot, name, problem.moving)[0] for name in candidates_for(problem)]
    best = fit(problem, (), cross_validate=False)
    named: list[Term] = []
    while rest and len(named) < _MOST_CAUSES:
        fits = [fit(problem, (*named, term), best.values, cross_validate=False, scan=True) for term in rest]
        one = int(np.argmin([_bic(item) for item in fits]))
        if _bic(fits[one]) >= _bic(best):
            break
        best = fits[one]
        named.append(rest.pop(one))
    return [term.effect for term in named]


METHODS: Mapping[str, Callable[[Problem], Named]] = {
    "everything_at_once": everything_at_once,
    "lasso": lasso,
    "forward_by_bic": forward_by_bic,
}


def named_by(method: str, problem: Problem) -> Named:
    """Return what a method names, on as many rows as a diagnosis chooses by."""
    return METHODS[method](with_fewer_rows(problem))


def all_terms(problem: Problem) -> tuple[Term, ...]:
    """Return every cause in its simplest variant."""
    return tuple(terms_for(problem.robot, name, problem.moving)[0] for name in candidates_for(problem))


def _null(found: Fit) -> Array:
    return start_of(found.numbers, {item.key: item.parameter.null for item in found.numbers})


def _by_cause(found: Fit) -> dict[str, list[int]]:
    own: dict[str, list[int]] = {}
    for index, item in enumerate(found.numbers):
        if item.effect:
            own.setdefault(item.effect, []).append(index)
    return own


def _bic(found: Fit) -> float:
    count = len(found.residual)
    squares = max(float(found.residual @ found.residual), 1e-12)
    return count * float(np.log(squares / count)) + len(found.x) * float(np.log(count))


def _priced_by_folds(matrix: Array, target: Array, priced: np.ndarray, block: np.ndarray) -> Array:
    """Return the sizes (p,) at the price that the stretches left out choose, by the rule of one error."""
    fold = np.unique(block, return_inverse=True)[1] % _FOLDS
    most = float(np.abs(matrix.T @ target)[priced].max()) / len(target)
    prices = most * np.geomspace(1.0, _LEAST_PENALTY, _PENALTIES)
    errors = np.zeros((_FOLDS, len(prices)))
    for number in range(_FOLDS):
        out = fold == number
        if not out.any() or out.all():
            continue
        path = _along(matrix[~out], target[~out], priced, prices)
        errors[number] = ((matrix[out] @ path.T - target[out, None]) ** 2).mean(axis=0)
    mean, error = errors.mean(axis=0), errors.std(axis=0) / np.sqrt(_FOLDS)
    least = int(np.argmin(mean))
    chosen = int(np.flatnonzero(mean <= mean[least] + error[least])[0])
    return _along(matrix, target, priced, prices[: chosen + 1])[-1]


def _along(matrix: Array, target: Array, priced: np.ndarray, prices: Sequence[float] | Array) -> Array:
    """Return the sizes at falling prices, shape (k, p), by coordinate descent, each from the one before."""
    count = len(target)
    gram, product = matrix.T @ matrix / count, matrix.T @ target / count
    size, path = np.zeros(matrix.shape[1]), []
    for price in prices:
        for _ in range(_SWEEPS):
            before = size.copy()
            for index in range(len(size)):
                if gram[index, index] <= 0.0:
                    continue
                pull = product[index] - gram[index] @ size + gram[index, index] * size[index]
                if priced[index]:
                    pull = np.sign(pull) * max(abs(pull) - price, 0.0)
                size[index] = pull / gram[index, index]
            if np.abs(size - before).max() <= 1e-7 * max(float(np.abs(size).max()), 1e-12):
                break
        path.append(size.copy())
    return np.array(path)


# ----------------------------------------------------------------------------------------------------
# Runs the other methods on the data sets of the independent bench, and scores them as the diagnosis is.

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
        found = _as_found(named_by(method, split_problem(prepare(load_dataset(folders.data))).train))
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


# ----------------------------------------------------------------------------------------------------
# One row per method: how often it is right, by what was hidden.

Score = Mapping[str, Any]
COLUMNS = ("known", "foreign", "pair", "false alarm", "outside", "names too many", "seconds")


def rows(scores: Mapping[str, Sequence[Score]]) -> list[dict[str, Any]]:
    """Return a row per method: shares of right answers, by its own name, and the median of seconds."""
    return [{"method": name} | _row(own) for name, own in scores.items()]


def as_text(table: Sequence[Mapping[str, Any]]) -> str:
    """Return the rows as a table in Markdown."""
    lines = ["| method | " + " | ".join(COLUMNS) + " |", "|" + "---|" * (len(COLUMNS) + 1)]
    lines += [f"| {row['method']} | " + " | ".join(row[name] for name in COLUMNS) + " |" for row in table]
    return "\n".join(lines)


def _row(scores: Sequence[Score]) -> dict[str, str]:
    stories = {
        name: [item for item in scores if item["story"] == name]
        for name in ("single", "pair", "none", "outside")
    }
    singles = stories["single"]
    seconds = [item["seconds"] for item in scores if math.isfinite(item["seconds"])]
    return {
        "known": _share(item["exact"] for item in singles if item["known"]),
        "foreign": _share(item["exact"] or _outside(item) for item in singles if not item["known"]),
        "pair": _share(item["exact"] for item in stories["pair"]),
        "false alarm": _share(item["false_alarm"] for item in stories["none"]),
        "outside": _share(item["right"] for item in stories["outside"]),
        "names too many": _share(
            bool(set(item["named"]) - set(item["true"])) for item in (*singles, *stories["pair"])
        ),
        "seconds": f"{np.median(seconds):.0f}" if seconds else "-",
    }


def _outside(item: Score) -> bool:
    return bool(item["right"]) and not item["named"]


def _share(hits: Iterable[bool]) -> str:
    values = [bool(hit) for hit in hits]
    return f"{sum(values)} of {len(values)}" if values else "-"
