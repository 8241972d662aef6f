"""Runs the bench of hidden effects in motion: draw, diagnose in another process, score; draw by draw."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from catheter_sim.blind_bench.in_motion.draw import HANGING, Draw, drawn
from catheter_sim.blind_bench.in_motion.finer import WildMotion
from catheter_sim.blind_bench.nature.code import judging_code
from catheter_sim.blind_bench.places import keep_settings, read_json, write_json
from catheter_sim.catalogue import robot_toml
from catheter_sim.channels import input_channels
from catheter_sim.tables import Table, write_table

HELDOUT = 0.25  # share of the trials, the last ones
SINGLE, FALSE_CAUSE = 0.90, 1.0 / 40.0  # what is asked
Score = dict[str, Any]


def story_of(index: int) -> str:
    """Return what a draw tells: causes and nothing in turn."""
    return ("single", "none")[index % 2]


def run_draw(
    seed: int, index: int, root: Path, trials: int, seconds: float, jobs: int, limit_s: float
) -> Score:
    """Return the score of one draw, made unless its file is there, whole, and of this code."""
    code = judging_code()
    path = root / "scores" / f"draw_{index:03d}.json"
    known = read_json(path)
    if known is not None and known.get("code") == code:
        return dict(known)
    story = story_of(index)
    score: Score = {"index": index, "story": story, "code": code}
    try:
        draw = drawn(seed, index, story, trials, seconds)
    except WildMotion as error:
        score |= {"verdict": "not made", "why": str(error), "right": True}
        write_json(score, path)
        return score
    data, found = root / "data" / f"draw_{index:03d}", root / "found" / f"draw_{index:03d}"
    write_data(draw, data)
    begun = time.monotonic()
    command = [sys.executable, "-m", "catheter_sim", "diagnose", str(data), "-o", str(found)]
    failure = ""
    try:
        done = subprocess.run(
            [*command, "--jobs", str(jobs)], capture_output=True, text=True, timeout=limit_s, check=False
        )
        if done.returncode:
            failure = (done.stderr.strip().splitlines() or [f"exit status {done.returncode}"])[-1]
    except subprocess.TimeoutExpired:
        failure = f"out of time, {limit_s:g} s"
    score |= {"seconds": time.monotonic() - begun} | _scored(
        draw, read_json(found / "diagnosis.json"), failure
    )
    write_json(score, path)
    return score


def run_bench(
    seed: int,
    draws: Sequence[int],
    root: Path,
    trials: int,
    seconds: float,
    jobs: int,
    limit_s: float,
    on_score: Callable[[Score], None] = lambda score: None,
) -> list[Score]:
    """Return the scores of some draws of a seed, in order; a stopped run goes on where it was.

    Raises:
        InputError: the folder holds the draws of another seed or of other trials.
    """
    keep_settings(root, {"seed": seed, "trials": trials, "seconds": seconds})
    scores = []
    for index in draws:
        scores.append(run_draw(seed, index, root, trials, seconds, jobs, limit_s))
        on_score(scores[-1])
    return scores


def write_data(draw: Draw, folder: Path) -> None:
    """Write a draw as a data set; what it hides is not in it."""
    folder.mkdir(parents=True, exist_ok=True)
    names = input_channels(draw.robot, "tension")
    entries, first_heldout = [], len(draw.trials) - max(1, round(HELDOUT * len(draw.trials)))
    for number, (inputs, outputs) in enumerate(zip(draw.trials, draw.outputs, strict=True)):
        file = f"trial_{number + 1:02d}.csv"
        columns = {name: inputs.tendon[:, k] for k, name in enumerate(names)}
        columns |= {name: np.round(outputs[:, k], 4) for k, name in enumerate(draw.columns)}
        write_table(Table(inputs.time_s, columns), folder / file)
        entries.append({"file": file, "role": "train" if number < first_heldout else "heldout"})
    document = {
        "dataset": {
            "name": folder.name,
            "robot": "robot.toml",
            "source": "made for the bench of hidden effects in motion",
            "licence": "CC0-1.0",
        },
        "conditions": {"gravity_mps2": HANGING.tolist(), "motion": "dynamic"},
        "channels": {"inputs": names, "outputs": list(draw.columns)},
        "trials": entries,
    }
    (folder / "dataset.toml").write_text(tomli_w.dumps(document), encoding="utf-8")
    (folder / "robot.toml").write_text(robot_toml(draw.robot), encoding="utf-8")


def summary(scores: Sequence[Score]) -> list[str]:
    """Return lines that compare what was reached with what is asked."""
    lines = []
    for story, words in (("single", "single cause named first"), ("none", "nothing hidden: a cause named")):
        mine = [item for item in scores if item["story"] == story and item["verdict"] != "not made"]
        if not mine:
            continue
        if story == "single":
            count = sum(item["right"] for item in mine)
            lines.append(f"{words}: {count} of {len(mine)}; asked: {100 * SINGLE:g} %")
        else:
            count = sum(not item["right"] for item in mine)
            lines.append(f"{words}: {count} of {len(mine)}; asked: at most 1 of 40")
    times = sorted(item["seconds"] for item in scores if "seconds" in item)
    if times:
        lines.append(f"seconds of a diagnosis: median {times[len(times) // 2]:.0f}, most {times[-1]:.0f}")
    return lines


def _scored(draw: Draw, found: Any, failure: str) -> Score:
    answer = {
        "cause": draw.cause,
        "form": draw.form,
        "size_over_noise": draw.size,
        "noise_mm": draw.noise_mm,
        "hidden": {
            name: value
            for name, value in asdict(draw.specimen).items()
            if name != "robot" and value not in (0.0, (), (0.0, 0.0, 0.0))
        },
    }
    if found is None or failure:
        return {"verdict": "failed", "why": failure or "no diagnosis.json", "right": False, "answer": answer}
    named = [cause["name"] for cause in found["causes"]]
    right = named[:1] == [draw.cause] if draw.cause else found["verdict"] != "cause_found"
    return {
        "verdict": found["verdict"],
        "named": named,
        "parameters": {cause["name"]: cause["parameters"] for cause in found["causes"]},
        "indistinguishable": found["indistinguishable"],
        "heldout": found["heldout"],
        "noise_floor": found["noise_floor"],
        "right": right,
        "answer": answer,
    }
