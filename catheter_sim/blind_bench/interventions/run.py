"""Runs the bench: make, compare in another process, score; resumable, and only draws of one code count."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from catheter_sim.blind_bench.elsewhere import elsewhere
from catheter_sim.blind_bench.interventions.deal import commands_of, generator_of, robot_of, story_of
from catheter_sim.blind_bench.interventions.make import make
from catheter_sim.blind_bench.interventions.recordings import drawn_recordings
from catheter_sim.blind_bench.interventions.score import score
from catheter_sim.blind_bench.interventions.write import NEW, OLD, write_made
from catheter_sim.blind_bench.nature.code import judging_code, making_code
from catheter_sim.blind_bench.nature.ground import Ground
from catheter_sim.blind_bench.nature.run import Draw, Steps, run_draws
from catheter_sim.blind_bench.places import keep_settings
from catheter_sim.blind_bench.robots import BENCH_ROBOTS


def compare_elsewhere(dataset: Path, output: Path, limit_s: float) -> str:
    """Say in another process what changed; it is given the two data sets' folders and the output folder."""
    verb = ("diagnose", str(dataset / NEW), "--since", str(dataset / OLD), "-o", str(output))
    return elsewhere(verb, dataset, limit_s)


def run_bench(
    purpose: str,
    seed: int,
    draws: Sequence[int],
    root: Path,
    jobs: int = 1,
    robots: Sequence[str] = tuple(BENCH_ROBOTS),
    limit_s: float = 900.0,
    on_score: Callable[[dict[str, Any]], None] = lambda score: None,
    bare: bool = False,
) -> list[dict[str, Any]]:
    """Return the scores of some draws of a seed, in order, `jobs` at a time.

    `bare`: without what both recordings hide.

    Raises:
        InputError: the folder holds other draws.
    """
    settings = {"interventions": True, "purpose": purpose, "seed": seed, "robots": list(robots)}
    keep_settings(root, settings | ({"bare": True} if bare else {}))
    todo = [Draw(purpose, seed, index, root, robots) for index in draws]
    steps = replace(STEPS, make=partial(_make, bare=bare))
    return run_draws(steps, todo, jobs, limit_s, compare_elsewhere, on_score)


def scoring_code() -> str:
    """Return the digest of what compares and scores."""
    return judging_code(comparing=True)


def _making_code() -> str:
    return making_code("blind_bench/interventions")


def _make(draw: Draw, code: str, bare: bool = False) -> None:
    write_made(make(draw.purpose, draw.seed, draw.index, draw.robots, bare), draw.folders, code)


def _dealt(draw: Draw) -> dict[str, Any]:
    key = (draw.purpose, draw.seed, draw.index)
    return {
        "story": story_of(*key),
        "robot": robot_of(*key, draw.robots),
        "commands": commands_of(*key),
        "shared": [],
    }


def _ground_of(answer: dict[str, Any]) -> Ground:
    """Return the later recording's ground, drawn again."""
    generator = generator_of(*(answer[name] for name in ("purpose", "seed", "index", "attempt")))
    return drawn_recordings(generator, answer["robot"], answer["commands"]).after


STEPS = Steps(_making_code, scoring_code, _make, _dealt, score, _ground_of)
