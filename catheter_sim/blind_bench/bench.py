"""Runs the bench: draw, hide, diagnose in another process, score; resumable draw by draw."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from catheter_sim.blind_bench.draw import robot_of, story_of
from catheter_sim.blind_bench.elsewhere import Diagnose, diagnose_elsewhere, diagnosed, run_all
from catheter_sim.blind_bench.folders import write_draw
from catheter_sim.blind_bench.make import make
from catheter_sim.blind_bench.makers import CannotMake
from catheter_sim.blind_bench.nature.code import judging_code
from catheter_sim.blind_bench.places import ANSWER, Folders, keep_settings, read_json, write_json
from catheter_sim.blind_bench.robots import BENCH_ROBOTS
from catheter_sim.blind_bench.score import score
from catheter_sim.blind_bench.table import NOT_MADE

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
