"""Runs the bench: make, compare in another process, score; resumable, and only draws of one code count."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from catheter_sim.blind_bench.elsewhere import Diagnose, diagnosed, elsewhere, run_all
from catheter_sim.blind_bench.interventions.deal import commands_of, generator_of, robot_of, story_of
from catheter_sim.blind_bench.interventions.make import make
from catheter_sim.blind_bench.interventions.recordings import drawn_recordings
from catheter_sim.blind_bench.interventions.score import score
from catheter_sim.blind_bench.interventions.write import NEW, OLD, write_made
from catheter_sim.blind_bench.nature.code import commit, making_code, whole_code
from catheter_sim.blind_bench.nature.engine import CannotMake
from catheter_sim.blind_bench.nature.ground import Ground
from catheter_sim.blind_bench.nature.run import CHANGED, SETTINGS, also_right, looked_closer, not_made
from catheter_sim.blind_bench.nature.table import NOT_MADE
from catheter_sim.blind_bench.places import ANSWER, Folders, read_json, write_json
from catheter_sim.blind_bench.robots import BENCH_ROBOTS
from catheter_sim.errors import InputError

_MAKERS = "blind_bench/interventions"


def compare_elsewhere(dataset: Path, output: Path, limit_s: float) -> str:
    """Say in another process what changed; it is given the two data sets' folders and the output folder."""
    verb = ("diagnose", str(dataset / NEW), "--since", str(dataset / OLD), "-o", str(output))
    return elsewhere(verb, dataset, limit_s)


def made_draw(
    purpose: str, seed: int, index: int, root: Path, robots: Sequence[str] = tuple(BENCH_ROBOTS)
) -> dict[str, Any]:
    """Return the answer of a draw, whose data lie in its folder; made unless this very code has made it."""
    folders, code = Folders(root, index), making_code(_MAKERS)
    answer = read_json(folders.answer / ANSWER)
    if answer is not None and answer["made_by"] == code:
        return dict(answer)
    folders.clear()
    begun = time.monotonic()
    try:
        write_made(make(purpose, seed, index, robots), folders, code)
        answer = read_json(folders.answer / ANSWER) | {"seconds_to_make": time.monotonic() - begun}
    except CannotMake as error:
        story, robot = story_of(purpose, seed, index), robot_of(purpose, seed, index, robots)
        answer = not_made(index, story, robot, str(error)) | {
            "commands": commands_of(purpose, seed, index),
            "shared": [],
            "made_by": code,
        }
    write_json(answer, folders.answer / ANSWER)
    return dict(answer)


def run_draw(
    purpose: str,
    seed: int,
    index: int,
    root: Path,
    robots: Sequence[str] = tuple(BENCH_ROBOTS),
    limit_s: float = 900.0,
    diagnose: Diagnose = compare_elsewhere,
) -> dict[str, Any]:
    """Return the score of one draw. One that this very code has scored is not run again; any other is."""
    folders, code = Folders(root, index), whole_code()
    known = read_json(folders.score)
    if known is not None and known["code"] == code:
        return dict(known)
    folders.score.unlink(missing_ok=True)
    answer = made_draw(purpose, seed, index, root, robots)
    result = dict(answer)
    if answer.get("verdict") != NOT_MADE:
        shutil.rmtree(folders.found, ignore_errors=True)
        folders.found.mkdir(parents=True)
        result = score(folders, diagnosed(folders, limit_s, diagnose))
        result |= looked_closer(answer, result, partial(_ground_of, answer))
        result["either"] = also_right(answer, result)
    result |= {
        "purpose": purpose,
        "seed": seed,
        "commit": commit(),
        "code": code if whole_code() == code else CHANGED,
    }
    write_json(result, folders.score)
    return result


def run_bench(
    purpose: str,
    seed: int,
    draws: Sequence[int],
    root: Path,
    jobs: int = 1,
    robots: Sequence[str] = tuple(BENCH_ROBOTS),
    limit_s: float = 900.0,
    on_score: Callable[[dict[str, Any]], None] = lambda score: None,
) -> list[dict[str, Any]]:
    """Return the scores of some draws of a seed, in order, `jobs` at a time.

    Raises:
        InputError: the folder holds other draws.
    """
    settings = {"interventions": True, "purpose": purpose, "seed": seed, "robots": list(robots)}
    known = read_json(root / SETTINGS)
    if known is not None and known != settings:
        raise InputError(f"{root}: holds draws of {known}, not of {settings}; give another folder")
    write_json(settings, root / SETTINGS)
    return run_all(run_draw, [(purpose, seed, k, root, robots, limit_s) for k in draws], jobs, on_score)


def _ground_of(answer: dict[str, Any]) -> Ground:
    """Return the later recording's ground, drawn again."""
    key = (answer["purpose"], answer["seed"], answer["index"], answer["attempt"])
    return drawn_recordings(generator_of(*key), answer["robot"], answer["commands"]).after
