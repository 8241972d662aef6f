"""Runs the bench: make, diagnose in another process, score; resumable, and only draws of one code count."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from catheter_sim.blind_bench.elsewhere import Diagnose, diagnose_elsewhere, diagnosed, run_all
from catheter_sim.blind_bench.nature.code import commit, judging_code, making_code
from catheter_sim.blind_bench.nature.deal import generator_of, robot_of, story_of
from catheter_sim.blind_bench.nature.engine import CannotMake
from catheter_sim.blind_bench.nature.form import Planted
from catheter_sim.blind_bench.nature.forms import BY_KEY
from catheter_sim.blind_bench.nature.ground import Ground
from catheter_sim.blind_bench.nature.make import drawn_ground, make
from catheter_sim.blind_bench.nature.rivals import TOLD_APART, distance
from catheter_sim.blind_bench.nature.score import named_beside, score
from catheter_sim.blind_bench.nature.table import NOT_MADE
from catheter_sim.blind_bench.nature.write import write_made
from catheter_sim.blind_bench.places import ANSWER, Folders, keep_settings, read_json, write_json
from catheter_sim.blind_bench.robots import BENCH_ROBOTS

CHANGED = "changed while it ran"


@dataclass(frozen=True)
class Draw:
    """A draw of a bench, and where it lies."""

    purpose: str
    seed: int
    index: int
    root: Path
    robots: Sequence[str] = tuple(BENCH_ROBOTS)

    @property
    def folders(self) -> Folders:
        """Its places."""
        return Folders(self.root, self.index)


@dataclass(frozen=True)
class Steps:
    """What a bench does with a draw.

    Attributes:
        making_code: gives the digest of what makes its data.
        judging_code: gives the digest of what scores them.
        make: makes and writes data and answer, which holds that digest; raises CannotMake.
        dealt: what is known of a draw without its data: `story`, `robot`, and what else scores need.
        score: gives the score, from the draw's folders and how the diagnosis went.
        ground: gives, from an answer, the ground on which other names are tried.
    """

    making_code: Callable[[], str]
    judging_code: Callable[[], str]
    make: Callable[[Draw, str], None]
    dealt: Callable[[Draw], dict[str, Any]]
    score: Callable[[Folders, dict[str, Any]], dict[str, Any]]
    ground: Callable[[dict[str, Any]], Ground]


def made(steps: Steps, draw: Draw) -> dict[str, Any]:
    """Return the answer of a draw, whose data lie in its folder; made unless this very code has made it."""
    folders, code = draw.folders, steps.making_code()
    answer = read_json(folders.answer / ANSWER)
    if answer is not None and answer["made_by"] == code:
        return dict(answer)
    folders.clear()
    begun = time.monotonic()
    try:
        steps.make(draw, code)
        answer = read_json(folders.answer / ANSWER) | {"seconds_to_make": time.monotonic() - begun}
    except CannotMake as error:
        answer = not_made(draw.index, str(error)) | steps.dealt(draw) | {"made_by": code}
    write_json(answer, folders.answer / ANSWER)
    return dict(answer)


def scored_draw(steps: Steps, draw: Draw, limit_s: float, diagnose: Diagnose) -> dict[str, Any]:
    """Return the score of one draw. One that this very code has scored is not run again; any other is."""
    folders, code = draw.folders, steps.judging_code()
    known = read_json(folders.score)
    if known is not None and known["code"] == code:
        return dict(known)
    folders.score.unlink(missing_ok=True)
    answer = made(steps, draw)
    if answer.get("verdict") == NOT_MADE:
        result = dict(answer)
    else:
        shutil.rmtree(folders.found, ignore_errors=True)
        folders.found.mkdir(parents=True)
        result = steps.score(folders, diagnosed(folders, limit_s, diagnose))
        result |= _looked_closer(answer, result, partial(steps.ground, answer))
        either = {name for item in answer["hidden"] for name in (*item["also"], *item.get("alike", []))}
        result["either"] = sorted((either | set(result.get("same", []))) - set(result["true"]))
    result |= {
        "purpose": draw.purpose,
        "seed": draw.seed,
        "commit": commit(),
        "code": code if steps.judging_code() == code else CHANGED,
    }
    write_json(result, folders.score)
    return result


def run_draws(
    steps: Steps,
    draws: Sequence[Draw],
    jobs: int,
    limit_s: float,
    diagnose: Diagnose,
    on_score: Callable[[dict[str, Any]], None],
) -> list[dict[str, Any]]:
    """Return the scores of draws, in order, `jobs` at a time."""
    return run_all(scored_draw, [(steps, draw, limit_s, diagnose) for draw in draws], jobs, on_score)


def run_bench(
    purpose: str,
    seed: int,
    draws: Sequence[int],
    root: Path,
    jobs: int = 1,
    robots: Sequence[str] = tuple(BENCH_ROBOTS),
    limit_s: float = 900.0,
    make_only: bool = False,
    on_score: Callable[[dict[str, Any]], None] = lambda score: None,
) -> list[dict[str, Any]]:
    """Return the scores of some draws of a seed, in order, `jobs` at a time; of `make_only` their answers.

    Raises:
        InputError: the folder holds the draws of another purpose, seed or other robots.
    """
    keep_settings(root, {"purpose": purpose, "seed": seed, "robots": list(robots)})
    todo = [Draw(purpose, seed, index, root, robots) for index in draws]
    if make_only:
        return run_all(made, [(STEPS, draw) for draw in todo], jobs, on_score)
    return run_draws(STEPS, todo, jobs, limit_s, diagnose_elsewhere, on_score)


def scores_in(root: Path, code: str | None = None) -> list[dict[str, Any]]:
    """Return the scores in a bench's folder that count: those of one code, by default this one's."""
    wanted = code or judging_code()
    found = [read_json(path) for path in sorted((root / "scores").glob("draw_*.json"))]
    return [item for item in found if item is not None and item["code"] == wanted]


def _scoring_code() -> str:
    return judging_code()


def _looked_closer(
    answer: dict[str, Any], result: dict[str, Any], ground: Callable[[], Ground]
) -> dict[str, Any]:
    """Return what a miss is worth: right where nobody could tell what is named from what is hidden.

    Nor is a cause claimed wrongly, then, or counted where probabilities are held to their promise.

    Args:
        answer: what is hidden.
        result: the score so far.
        ground: gives specimen and trials, if they are needed.
    """
    if result["story"] not in ("single", "pair"):
        return {}
    named = result["named"][:1] if result["story"] == "single" else result["named"]
    missed = bool(named) and not result["right"]
    beside = [name for name in result["named"] if named_beside(answer, [{name}])]
    if result["story"] != "single" or not result["another_named"]:
        beside = []
    if not missed and not beside:
        return {}
    where = ground()
    hidden = [
        Planted(BY_KEY[f"{item['cause']}.{item['form']}"], item["size"], item["numbers"])
        for item in answer["hidden"]
    ]
    found: dict[str, Any] = {}
    if missed:
        found["distance"] = distance(where, hidden, named)
        found["right"] = found["named_right"] = _same(found["distance"])
    if beside:
        same = [name for name in beside if _same(distance(where, hidden, [name]))]
        found |= {"same": same, "another_named": len(same) < len(beside)}
    return found


def _ground_of(answer: dict[str, Any]) -> Ground:
    generator = generator_of(*(answer[key] for key in ("purpose", "seed", "index", "attempt")))
    return drawn_ground(generator, answer["robot"])


def _same(apart: float | None) -> bool:
    return apart is not None and apart < TOLD_APART


def not_made(index: int, why: str) -> dict[str, Any]:
    """Return the answer, and the score, of a draw for which there are no data."""
    return {
        "index": index,
        "true": [],
        "forms": [],
        "known": True,
        "sizes": [],
        "noise_kind": "",
        "rows": 0,
        "seconds": 0.0,
        "failure": why,
        "verdict": NOT_MADE,
        "named": [],
        "right": False,
        "exact": False,
        "false_alarm": False,
        "another_named": False,
        "named_right": False,
        "grouped": False,
        "groups": [],
        "probabilities": None,
        "intervals": [],
    }


def _make(draw: Draw, code: str) -> None:
    write_made(make(draw.purpose, draw.seed, draw.index, draw.robots), draw.folders, code)


def _dealt(draw: Draw) -> dict[str, Any]:
    key = (draw.purpose, draw.seed, draw.index)
    return {"story": story_of(*key), "robot": robot_of(*key, draw.robots)}


STEPS = Steps(making_code, _scoring_code, _make, _dealt, score, _ground_of)
