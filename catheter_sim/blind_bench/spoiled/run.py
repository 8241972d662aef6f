"""Spoils, diagnoses in another process and scores; resumable, and only draws of one code count."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from catheter_sim.blind_bench.elsewhere import Diagnose, diagnose_elsewhere, diagnosed, run_all
from catheter_sim.blind_bench.nature.code import code_of, commit, judging_code, making_code
from catheter_sim.blind_bench.nature.run import CHANGED
from catheter_sim.blind_bench.places import (
    ANSWER,
    Folders,
    keep_settings,
    read_json,
    write_json,
    write_tables,
)
from catheter_sim.blind_bench.spoiled.clean import Clean, clean_number, clean_recording
from catheter_sim.blind_bench.spoiled.kind import Kind
from catheter_sim.blind_bench.spoiled.kinds import BY_NAME, KINDS
from catheter_sim.blind_bench.spoiled.recording import Recording
from catheter_sim.blind_bench.spoiled.score import scored
from catheter_sim.errors import InputError
from catheter_sim.tables import Table

MOST_DRAWS = 100  # of one kind
_SPOILED = 33
_STEPS = 12  # recordings tried for one that a kind can spoil


def making() -> str:
    """Return the digest of what makes and spoils recordings."""
    return f"{making_code()}-{code_of(('blind_bench/spoiled',), ('run.py', 'score.py', 'table.py'))}"


def spoiled_draw(seed: int, name: str, draw: int, root: Path) -> dict[str, Any]:
    """Return the answer of a draw, whose data lie in its folder; made unless this very code has made it."""
    folders, code = folders_of(name, draw, root), making()
    answer = read_json(folders.answer / ANSWER)
    if answer is not None and answer["made_by"] == code:
        return dict(answer)
    folders.clear()
    kind, place = BY_NAME[name], KINDS.index(BY_NAME[name])
    clean, number = _fitting(seed, kind, place, draw, root / "clean", code)
    generator = np.random.default_rng((_SPOILED, seed, place, draw))
    write_recording(kind.spoil(clean.recording, generator), folders)
    if kind.respell is not None:
        _respell(kind, folders.data, generator)
    answer = {
        "kind": name,
        "words": kind.words,
        "sound": kind.sound,
        "alike": list(kind.alike),
        "seed": seed,
        "draw": draw,
        "recording": number,
        "robot": clean.robot,
        "hidden": list(clean.hidden),
        "rows": sum(len(trial) for trial in clean.recording.trials),
        "made_by": code,
    }
    write_json(answer, folders.answer / ANSWER)
    return answer


def run_draw(
    seed: int,
    name: str,
    draw: int,
    root: Path,
    limit_s: float = 600.0,
    diagnose: Diagnose = diagnose_elsewhere,
) -> dict[str, Any]:
    """Return the score of one draw. One that this very code has scored is not run again; any other is."""
    folders, code = folders_of(name, draw, root), judging_code()
    known = read_json(folders.score)
    if known is not None and known["code"] == code:
        return dict(known)
    folders.score.unlink(missing_ok=True)
    answer = spoiled_draw(seed, name, draw, root)
    shutil.rmtree(folders.found, ignore_errors=True)
    folders.found.mkdir(parents=True)
    run = diagnosed(folders, limit_s, diagnose)
    found = None if run["failure"] else read_json(folders.found / "diagnosis.json")
    result = scored(answer, found, run)
    result |= {"commit": commit(), "code": code if judging_code() == code else CHANGED}
    write_json(result, folders.score)
    return result


def run_bench(
    seed: int,
    names: Sequence[str],
    draws: int,
    root: Path,
    jobs: int = 1,
    limit_s: float = 600.0,
    make_only: bool = False,
    on_score: Callable[[dict[str, Any]], None] = lambda score: None,
) -> list[dict[str, Any]]:
    """Return the scores of some draws of some kinds, `jobs` at a time; of `make_only` their answers.

    Raises:
        InputError: the folder holds the draws of another seed.
    """
    keep_settings(root, {"seed": seed})
    todo = [(seed, name, draw, root) for draw in range(draws) for name in names]
    if make_only:
        return run_all(spoiled_draw, todo, jobs, on_score)
    return run_all(run_draw, [(*item, limit_s) for item in todo], jobs, on_score)


def folders_of(name: str, draw: int, root: Path) -> Folders:
    """Return the places of a draw; its name says nothing about it."""
    return Folders(root, MOST_DRAWS * KINDS.index(BY_NAME[name]) + draw)


def write_recording(recording: Recording, folders: Folders) -> None:
    """Write a recording as a data set."""
    tables = []
    for trial in recording.trials:
        columns = {name: trial.inputs[:, k] for k, name in enumerate(recording.inputs)}
        columns |= {name: trial.outputs[:, k] for k, name in enumerate(recording.outputs)}
        tables.append((Table(trial.time_s, columns), trial.role))
    write_tables(
        folders.data, folders.name, recording.bench, recording.outputs, recording.gravity_mps2, tables
    )


def _fitting(seed: int, kind: Kind, place: int, draw: int, cache: Path, code: str) -> tuple[Clean, int]:
    """Return a recording that a kind can spoil, and its number."""
    for step in range(_STEPS):
        number = clean_number(place, draw, step)
        clean = clean_recording(seed, number, cache, code)
        if kind.fits(clean.recording):
            return clean, number
    raise InputError(f"{kind.name}: none of {_STEPS} recordings can be spoiled so")


def _respell(kind: Kind, folder: Path, generator: np.random.Generator) -> None:
    assert kind.respell is not None
    path = sorted(folder.glob("trial_*.csv"))[-1]
    lines = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join(kind.respell(lines, generator)) + "\n", encoding="utf-8")
