"""The first bench: draw, hide, diagnose in another process, score; with its table."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.fit import fit, robot_with
from catheter_sim.diagnosis.noise import gain_interval, gain_percent, stretch_squares
from catheter_sim.diagnosis.prepare import training_problem
from catheter_sim.diagnosis.problem import Problem
from catheter_sim.diagnosis.trials import Trial, measured_of, split_trials, unit_of
from catheter_sim.diagnosis.workers import details
from catheter_sim.errors import InputError
from catheter_sim.lab.robots import BENCH_ROBOTS
from hidden_effects.first_draws import (
    TOLD_APART,
    TRUTH,
    CannotMake,
    distance,
    make,
    read_aside,
    robot_as_written,
    robot_of,
    story_of,
    write_draw,
)
from hidden_effects.natural import judging_code
from hidden_effects.running import (
    ANSWER,
    Diagnose,
    Folders,
    diagnose_elsewhere,
    diagnosed,
    keep_settings,
    read_json,
    run_all,
    write_json,
)

# ----------------------------------------------------------------------------------------------------
# Scores one diagnosis against its answer: what was named, how sure, and what the gain is worth elsewhere.

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
    train, heldout = split_trials(dataset)
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


# ----------------------------------------------------------------------------------------------------
# Adds up the scores of many draws, against what is asked of a diagnosis, with every miss.

# What is asked, as a share of the draws; of the errors, a ratio.
SINGLE, PAIR, FALSE_CAUSE, UNEXPLAINED, COVERAGE, GAIN, OVER_FLOOR = 0.95, 0.80, 0.02, 0.85, 0.85, 0.90, 1.3
NOT_MADE = "not made"
Score = dict[str, Any]


def summary(scores: Sequence[Score]) -> dict[str, Any]:
    """Return the table of many scores: lines with what was asked and reached, the misses, what was off."""
    made = [item for item in scores if item["verdict"] != NOT_MADE]
    by_story = {
        name: [item for item in made if item["story"] == name]
        for name in ("single", "pair", "none", "outside")
    }
    found = [item for item in made if item["story"] in ("single", "pair")]
    covered = [row for item in found for row in item.get("coverage", []) if row["comparable"]]
    other = [row for item in found for row in item.get("coverage", []) if not row["comparable"]]
    gains = [item["gain"] for item in made if "gain" in item]
    over_floor = [item.get("after_over_floor", math.nan) for item in found]
    over_noise = [item.get("after_over_noise", math.nan) for item in found]
    causes = [item["verdict"] == "cause_found" for item in by_story["none"]]
    alone = [sorted(item["named"]) == sorted(item["true"]) for item in found]
    seconds = [item["seconds"] for item in made]
    lines = [
        _share("single effect named first", by_story["single"], SINGLE),
        _share("both of two named", by_story["pair"], PAIR),
        _share("nothing hidden: no discrepancy", by_story["none"], None),
        _counted("nothing hidden: a cause named", causes, FALSE_CAUSE, most=True),
        _share("outside the list: unexplained", by_story["outside"], UNEXPLAINED),
        _counted("true parameter in its 95 % interval", [row["inside"] for row in covered], COVERAGE),
        _value("held-out error over the noise floor, median", over_floor, OVER_FLOOR),
        _value("held-out error over the true noise, median", over_noise, None),
        _counted("gain on a third set within the claimed interval", [item["inside"] for item in gains], GAIN),
        _counted("gain intervals of both sets overlap", [item["overlap"] for item in gains], None),
        _counted("the hidden effects named, and nothing else", alone, None),
        _value("seconds of a diagnosis, median", seconds, None),
        _value("seconds of a diagnosis, most", [max(seconds)] if seconds else [], None),
    ]
    return {
        "draws": len(scores),
        "made": len(made),
        "lines": lines,
        "parameters_not_comparable": len(other),
        "robots_refused": [
            {"index": item["index"], "why": item["robot_refused"]}
            for item in made
            if item.get("robot_refused")
        ],
        "misses": [item for item in scores if not item["right"]],
        "not_covered": [row | {"index": item["index"]} for item in found for row in _outside(item)],
        "gains_off": [item["gain"] | {"index": item["index"]} for item in made if _gain_off(item)],
    }


def as_text(table: dict[str, Any]) -> str:
    """Return the document of `summary` as text."""
    rows = [f"{table['made']} of {table['draws']} draws made"]
    for line in table["lines"]:
        asked = "" if line["asked"] is None else f"  asked {line['asked']:.2f}: {_verdict(line)}"
        count = "" if line["of"] is None else f" ({line['count']} of {line['of']})"
        rows.append(f"{line['what']:<50} {line['reached']:8.2f}{count}{asked}")
    rows.append(f"parameters fitted otherwise than hidden, not counted: {table['parameters_not_comparable']}")
    rows += ["", "misses:"]
    rows += [f"  {miss_text(item)}" for item in table["misses"]] or ["  none"]
    rows += ["", "parameters outside their intervals:"]
    rows += [
        f"  {row['index']:3d} {row['parameter']}: true {row['true']:.4g}, fitted {row['fitted']:.4g} "
        f"({row['low']:.4g} to {row['high']:.4g})"
        for row in table["not_covered"]
    ] or ["  none"]
    rows += ["", "gains on the third set outside the claimed interval [%]:"]
    rows += [
        f"  {row['index']:3d} claimed {row['claimed']:.1f} "
        f"({_number(row['low'])} to {_number(row['high'])}), "
        f"third {row['third']:.1f} ({row['third_low']:.1f} to {row['third_high']:.1f})"
        for row in table["gains_off"]
    ] or ["  none"]
    rows += ["", "robot.toml of the diagnosis that is no robot:"]
    rows += [f"  {row['index']:3d} {row['why']}" for row in table["robots_refused"]] or ["  none"]
    return "\n".join(rows)


def miss_text(item: Score) -> str:
    """Return one draw in a line: what was hidden, what was said instead, and whether it could be told."""
    said = item["verdict"]
    if item["named"]:
        said += f" {' + '.join(item['named'])}"
    if item.get("alike"):
        said += f", alike {' | '.join(' = '.join(group) for group in item['alike'])}"
    if item.get("failure"):
        said += f": {item['failure']}"
    text = f"{item['index']:3d} {item['robot']}, {item['story']}: {' + '.join(item['true']) or 'nothing'}"
    text += f" ({item['size']:.0f} x noise, {item['rows']} rows) -> {said}"
    if "distance" in item:
        text += f"; from the truth {item['distance']:.1f} ({item['distance_rms']:.2f} x noise a value)"
    if "truth_tried" in item and item["story"] in ("single", "pair") and not item["right"]:
        tried = item["truth_tried"]
        place = f"place {tried['place']}" if tried else "not"
        text += f"; the truth was {place} among those tried"
    if "after_over_noise" in item:
        text += f"; error {item['before_over_noise']:.2f} -> {item['after_over_noise']:.2f} x noise"
    return text


def _share(what: str, items: Sequence[Score], asked: float | None) -> dict[str, Any]:
    return _counted(what, [item["right"] for item in items], asked)


def _counted(what: str, hits: Iterable[bool], asked: float | None, most: bool = False) -> dict[str, Any]:
    values = list(hits)
    reached = sum(values) / len(values) if values else math.nan
    met = None
    if asked is not None:
        met = bool(reached <= asked if most else reached >= asked)  # NaN meets nothing
    return {
        "what": what,
        "reached": reached,
        "count": sum(values),
        "of": len(values),
        "asked": asked,
        "met": met,
    }


def _value(what: str, values: Sequence[float], asked: float | None) -> dict[str, Any]:
    finite = [value for value in values if math.isfinite(value)]
    reached = float(np.median(finite)) if finite else math.nan
    met = None if asked is None else bool(reached <= asked)
    return {"what": what, "reached": reached, "count": None, "of": None, "asked": asked, "met": met}


def _verdict(line: dict[str, Any]) -> str:
    if not math.isfinite(line["reached"]):
        return "not measured"
    return "met" if line["met"] else "MISSED"


def _outside(item: Score) -> list[dict[str, Any]]:
    return [row for row in item.get("coverage", []) if row["comparable"] and not row["inside"]]


def _gain_off(item: Score) -> bool:
    return "gain" in item and not item["gain"]["inside"]


def _number(value: float | None) -> str:
    return "none" if value is None else f"{value:.1f}"


# ----------------------------------------------------------------------------------------------------
# Runs the bench: draw, hide, diagnose in another process, score; resumable draw by draw.

RUN = "run.json"
CODE = "code.json"  # beside the answer: the digest of the code that made the draw and goes on with it


def run_draw(
    seed: int,
    index: int,
    root: Path,
    robots: Sequence[str] = tuple(BENCH_ROBOTS),
    limit_s: float = 900.0,
    diagnose: Diagnose = diagnose_elsewhere,
) -> dict[str, Any]:
    """Return the score of one draw, made unless its file is there, whole, and of this code.

    Data, once whole, and a diagnosis, once ended, are not made again by the same code either.
    """
    folders, code = Folders(root, index), judging_code()
    known = read_json(folders.score)
    if known is not None and known.get("code") == code:
        return dict(known)
    if read_json(folders.answer / CODE) != code or read_json(folders.answer / ANSWER) is None:
        folders.clear()
        write_json(code, folders.answer / CODE)
        try:
            write_draw(make(seed, index, robots), folders)
        except CannotMake as error:
            result = _not_made(seed, index, robots, str(error)) | {"code": code}
            write_json(result, folders.score)
            return result
    run = read_json(folders.found / RUN)
    if run is None:
        shutil.rmtree(folders.found, ignore_errors=True)
        folders.found.mkdir(parents=True)
        run = diagnosed(folders, limit_s, diagnose)
        write_json(run, folders.found / RUN)
    result = score(folders, run) | {"code": code}
    write_json(result, folders.score)
    return result


def run_bench(
    seed: int,
    draws: int,
    root: Path,
    jobs: int = 1,
    robots: Sequence[str] = tuple(BENCH_ROBOTS),
    limit_s: float = 900.0,
    on_score: Callable[[dict[str, Any]], None] = lambda score: None,
) -> list[dict[str, Any]]:
    """Return the scores of the first `draws` draws of a seed, in order, `jobs` at a time.

    Raises:
        InputError: the folder holds the draws of another seed or other robots.
    """
    keep_settings(root, {"seed": seed, "robots": list(robots)})
    arguments = [(seed, index, root, robots, limit_s) for index in range(draws)]
    return run_all(run_draw, arguments, jobs, on_score)


def _not_made(seed: int, index: int, robots: Sequence[str], why: str) -> dict[str, Any]:
    return {
        "index": index,
        "story": story_of(seed, index),
        "robot": robot_of(seed, index, robots),
        "true": [],
        "size": 0.0,
        "rows": 0,
        "seconds": 0.0,
        "verdict": NOT_MADE,
        "failure": why,
        "named": [],
        "right": False,
    }
