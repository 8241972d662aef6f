"""Scores one diagnosis against its answer: what was named, how sure, and what the gain is worth elsewhere."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.blind_bench.alike import TOLD_APART, distance
from catheter_sim.blind_bench.folders import TRUTH, read_aside, robot_as_written
from catheter_sim.blind_bench.places import ANSWER, Folders, read_json
from catheter_sim.catalogue import load_robot
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.fit import fit, robot_with
from catheter_sim.diagnosis.noise import gain_interval, gain_percent, stretch_squares
from catheter_sim.diagnosis.prepare import training_problem
from catheter_sim.diagnosis.problem import Problem
from catheter_sim.diagnosis.trials import Trial, measured_of, split, unit_of
from catheter_sim.diagnosis.workers import details
from catheter_sim.errors import InputError

Document = Mapping[str, Any]


def score(folders: Folders, run: Document) -> dict[str, Any]:
    """Return the score of one draw.

    Args:
        folders: with data, answer and what the diagnosis wrote.
        run: how the diagnosis went: `seconds`, and `failure`, "" if it ended well.
    """
    answer = read_json(folders.answer / ANSWER)
    true = list(answer["effects"]) or ([answer["outside"]] if answer["outside"] else [])
    result: dict[str, Any] = {
        "index": answer["index"],
        "story": answer["story"],
        "robot": answer["robot"],
        "true": true,
        "size": answer["simulated_size_over_noise"],
        "rows": answer["rows"],
        "seconds": run["seconds"],
        "verdict": "failed",
        "failure": run["failure"],
        "named": [],
        "right": False,
    }
    found = read_json(folders.found / "diagnosis.json")
    if run["failure"] or found is None:
        return result
    named = [cause["name"] for cause in found["causes"]]
    noise = answer["noise"].get(found["unit"], math.nan)
    result |= {
        "verdict": found["verdict"],
        "named": named,
        "alike": found["indistinguishable"],
        "unit": found["unit"],
        "after_over_floor": _ratio(found["heldout"]["rmse_after"], found["noise_floor"]),
        "after_over_noise": _ratio(found["heldout"]["rmse_after"], noise),
        "before_over_noise": _ratio(found["heldout"]["rmse_before"], noise),
        "truth_tried": _rank(found["ranking"], true),
    }
    result["robot_refused"] = _refused(folders.found / "robot.toml")
    problem, trials = _problem(folders)
    if answer["story"] in ("single", "pair"):
        first = named[:1] if answer["story"] == "single" else named
        result["right"] = all(name in first for name in true)
        if not result["right"]:
            robot = robot_as_written(folders.answer / TRUTH)
            apart = distance(problem, trials, robot, answer["noise"], named, _known(found))
            result |= {"distance": apart[0], "distance_rms": apart[1]}
            grouped = all(_accounted(name, first, found["indistinguishable"]) for name in true)
            result["right"] = _stands_for(named, found["verdict"], grouped, apart[0])
            result["by_group"] = grouped
        result["coverage"] = _coverage(answer["effects"], found["causes"])
    else:
        wanted = {"none": ("no_discrepancy",), "outside": ("unexplained", "improved")}[answer["story"]]
        result["right"] = found["verdict"] in wanted
    if found["verdict"] == "cause_found":
        result["gain"] = _gains(folders, problem, found)
    return result


def _refused(path: Path) -> str:
    """Return why a written robot is not accepted where a robot id is; "" if it is."""
    try:
        load_robot(path)
    except InputError as error:
        return str(error).removeprefix(f"{path}: ")
    return ""


def _problem(folders: Folders) -> tuple[Problem, tuple[Trial, ...]]:
    """Return the data set's problem and all its trials."""
    dataset = load_dataset(folders.data)
    train, heldout = split(dataset)
    return training_problem(dataset, train), (*train, *heldout)


def _accounted(name: str, named: Sequence[str], groups: Sequence[Sequence[str]]) -> bool:
    """Return whether a true cause is named, or stands in a group with a named one."""
    return name in named or any(name in group and not set(named).isdisjoint(group) for group in groups)


def _stands_for(named: Sequence[str], verdict: str, grouped: bool, distance: float) -> bool:
    """Return whether other names than the true ones are as good: what is named cannot be told from the truth.

    What a calibration within its ranges does as well is no cause: naming none is right then.
    """
    return distance < TOLD_APART and (grouped if named else verdict == "no_discrepancy")


def _known(found: Document) -> dict[tuple[str, str], float]:
    return {
        (cause["name"], name): item["value"]
        for cause in found["causes"]
        for name, item in cause["parameters"].items()
        if item["value"] is not None
    }


def _coverage(effects: Mapping[str, Mapping[str, float]], causes: Sequence[Document]) -> list[dict[str, Any]]:
    """Return, for each parameter of a true effect that was named, whether its interval holds it.

    A value hidden for all channels or segments is the true one of each that was fitted. `comparable` is false
    where other parameters of the effect were fitted than those that were hidden.
    """
    rows = []
    for cause in causes:
        if cause["name"] not in effects:
            continue
        true = effects[cause["name"]]
        fitted = cause["parameters"]
        common = {
            name: true[other]
            for other in true
            if other not in fitted
            for name in fitted
            if details(name, other)
        }
        known = {**common, **{name: value for name, value in true.items() if name in fitted or not common}}
        comparable = set(known) == set(fitted)
        for name, value in known.items():
            low, high = fitted[name]["ci95"] if name in fitted else (None, None)
            low = -math.inf if low is None else low
            high = math.inf if high is None else high
            rows.append(
                {
                    "parameter": f"{cause['name']}.{name}",
                    "true": value,
                    "fitted": fitted[name]["value"] if name in fitted else None,
                    "low": low,
                    "high": high,
                    "comparable": comparable,
                    "inside": comparable and low <= value <= high,
                }
            )
    return rows


def _gains(folders: Folders, problem: Problem, found: Document) -> dict[str, Any]:
    """Return the claimed gain beside that on the third set of trials.

    The model before is fitted anew as the diagnosis fits it: its calibrated numbers are not in what the
    diagnosis writes. The model after is the robot that it wrote.
    """
    trials = read_aside(folders, problem.columns)
    before = fit(problem, (), cross_validate=False, thorough=False)
    robots = robot_with(problem, before.numbers, before.x), robot_as_written(folders.found / "robot.toml")
    errors = [_errors(problem, trials, robot) for robot in robots]
    test = Problem(
        problem.robot, problem.nuisances, trials, problem.columns, problem.weight, problem.twin, every=1
    )
    unit = found["unit"]
    mine = _units(problem, trials) == unit
    rmse = [float(np.sqrt(np.mean(error[mine] ** 2))) for error in errors]
    claimed = found["heldout"]
    low, high = claimed["gain_percent_ci95"]
    gain = gain_percent(*rmse)
    own = gain_interval(stretch_squares(test, errors[0], errors[1], unit))
    inside = low is not None and high is not None and low <= gain <= high
    return {
        "claimed": claimed["gain_percent"],
        "low": low,
        "high": high,
        "third": gain,
        "third_low": own[0],
        "third_high": own[1],
        "inside": inside,
        "overlap": low is not None and high is not None and own[0] <= high and low <= own[1],
    }


def _errors(problem: Problem, trials: Sequence[Trial], robot: RobotSpec) -> Array:
    parts = []
    for trial in trials:
        measured = measured_of(trial, problem.columns)
        model = problem.twin([robot], trial.inputs, 1)[0]
        parts.append((model - measured)[np.isfinite(measured)])
    return np.concatenate(parts)


def _units(problem: Problem, trials: Sequence[Trial]) -> np.ndarray:
    units = np.array([unit_of(name) for name in problem.columns])
    parts = []
    for trial in trials:
        finite = np.isfinite(measured_of(trial, problem.columns))
        parts.append(np.broadcast_to(units, finite.shape)[finite])
    return np.concatenate(parts)


def _rank(ranking: Sequence[Document], true: Sequence[str]) -> dict[str, Any] | None:
    """Return the place and the errors of the true set of causes in the ranking; None if it is not there."""
    for place, item in enumerate(ranking, start=1):
        if sorted(item["causes"]) == sorted(true):
            return {"place": place, **item}
    return None


def _ratio(value: float | None, unit: float | None) -> float:
    return value / unit if value is not None and unit else math.nan
