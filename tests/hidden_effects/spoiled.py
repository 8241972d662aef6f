"""The bench of spoiled measurements: spoil, diagnose in another process, score."""

from __future__ import annotations

import math
import shutil
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import input_channels
from catheter_sim.errors import InputError
from catheter_sim.lab.engine import (
    CannotMake,
    Ground,
    LabForm,
    Planted,
    columns_of,
    looked_at,
    rms,
    simulated,
)
from catheter_sim.lab.forms import FORMS
from catheter_sim.lab.robots import BENCH_ROBOTS
from catheter_sim.lab.specimen import drawn_courses, drawn_specimen, measured
from catheter_sim.tables import Table
from catheter_sim.units import si_factor
from hidden_effects.natural import CHANGED, accepted, code_of, commit, judging_code, making_code
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
    write_tables,
)
from hidden_effects.spoiled_kinds import BY_NAME, KINDS, Kind, Recording, Trial

# ----------------------------------------------------------------------------------------------------
# Sound recordings to spoil: a robot of the bench, few rows, a known cause in every other one or none.

ROWS = (220, 420)  # of all trials together
_CLEAN, _ROBOT = 31, 32
_ATTEMPTS = 40
_FORMS = 12  # drawn for one recording
_SIZE = (8.0, 20.0)  # of a hidden cause, times the noise, beyond what a calibration takes
_POOL = 2 * len(BENCH_ROBOTS)


@dataclass(frozen=True)
class Clean:
    """A sound recording.

    Attributes:
        recording: the measurements.
        robot: the bench's name of it.
        hidden: what is at work: cause, form, other names that say the same, and its size over the noise.
    """

    recording: Recording
    robot: str
    hidden: tuple[Mapping[str, Any], ...]


def clean_number(kind: int, draw: int, step: int = 0) -> int:
    """Return the number of the recording that a draw of a kind spoils; even ones hide nothing.

    Args:
        kind: its place in the list.
        draw: of that kind, from 0.
        step: how many recordings before it could not be spoiled so.
    """
    return (2 * kind + draw + 2 * step + 2 * (draw // _POOL)) % _POOL


def clean_recording(seed: int, number: int, cache: Path, code: str) -> Clean:
    """Return a sound recording, from the cache where this very code made it.

    Raises:
        CannotMake: none of the attempts gave data.
    """
    place = cache / f"clean_{number:02d}"
    known = read_json(place.with_suffix(".json"))
    if known is None or known["made_by"] != code:
        known = _made(seed, number, place) | {"made_by": code}
        write_json(known, place.with_suffix(".json"))
    ground = _ground(seed, number, known["attempt"])
    with np.load(place.with_suffix(".npz")) as file:
        outputs = [file[f"trial_{k}"] for k in range(len(ground.courses))]
    return Clean(_recording(ground, outputs), known["robot"], tuple(known["hidden"]))


def _made(seed: int, number: int, place: Path) -> dict[str, Any]:
    refused = []
    for attempt in range(_ATTEMPTS):
        ground = _ground(seed, number, attempt)
        rows = sum(len(course) for course in ground.courses)
        if not ROWS[0] <= rows <= ROWS[1]:
            continue
        generator = np.random.default_rng((_CLEAN, seed, number, attempt, 1))
        try:
            hidden = (_planted(ground, generator),) if number % 2 else ()
            outputs = [_outputs(ground, [item[0] for item in hidden], k) for k in range(len(ground.courses))]
        except CannotMake as error:
            refused.append(str(error))
            continue
        noisy = [measured(values, ground.specimen.noise, "white", generator) for values in outputs]
        place.parent.mkdir(parents=True, exist_ok=True)
        arrays: dict[str, Any] = {f"trial_{k}": values for k, values in enumerate(noisy)}
        np.savez_compressed(place.with_suffix(".npz"), **arrays)
        return {
            "attempt": attempt,
            "robot": _robot(seed, number),
            "rows": rows,
            "hidden": [_told(planted, size) for planted, size in hidden],
        }
    raise CannotMake(f"recording {number}, {_robot(seed, number)}: {'; '.join(refused)}")


def _robot(seed: int, number: int) -> str:
    """Return the robot of a recording: each once without a cause and once with one."""
    names = tuple(BENCH_ROBOTS)
    order = np.random.default_rng((_ROBOT, seed)).permutation(len(names))
    return names[int(order[(number // 2 + number % 2 * (len(names) // 2)) % len(names)])]


def _ground(seed: int, number: int, attempt: int) -> Ground:
    generator = np.random.default_rng((_CLEAN, seed, number, attempt, 0))
    specimen = drawn_specimen(generator, _robot(seed, number))
    return Ground(specimen, drawn_courses(specimen, generator))


def _planted(ground: Ground, generator: np.random.Generator) -> tuple[Planted, float]:
    """Return a cause in a form that the diagnosis knows, and what of it a calibration leaves."""
    for _ in range(_FORMS):
        form = _drawn_form(ground, generator)
        numbers = form.draw(ground.specimen, ground.scale, generator)
        target = math.exp(generator.uniform(*np.log(_SIZE)))
        sign = float(generator.choice([-1.0, 1.0])) if form.signed else 1.0
        found = ground.sized(form, numbers, target, sign)
        if found is not None:
            return found[0], rms(ground.left(found[1]))
    raise CannotMake("no cause of a fitting size was drawn")


def _drawn_form(ground: Ground, generator: np.random.Generator) -> LabForm:
    choices = [form for form in FORMS if form.known and form.applies(ground.specimen)]
    causes = list(dict.fromkeys(form.cause for form in choices))
    cause = causes[int(generator.integers(len(causes)))]
    own = [form for form in choices if form.cause == cause]
    return own[int(generator.integers(len(own)))]


def _outputs(ground: Ground, planted: list[Planted], number: int) -> Array:
    """Return a trial's outputs without noise."""
    specimen, course = ground.specimen, ground.courses[number]
    shapes = ground.plain[number]
    if any(not item.form.looks_only for item in planted):
        shapes = simulated(specimen, ground.scale, planted, course, without=shapes)
    return columns_of(specimen, looked_at(specimen, ground.scale, planted, course, shapes))


def _recording(ground: Ground, outputs: list[Array]) -> Recording:
    specimen = ground.specimen
    names = tuple(input_channels(specimen.bench.robot))
    unit = np.array([si_factor(name) for name in names])
    trials = tuple(
        Trial(course.role, course.time_s, course.commands / unit, values)
        for course, values in zip(ground.courses, outputs, strict=True)
    )
    return Recording(specimen.bench, names, specimen.columns, specimen.gravity_mps2, specimen.noise, trials)


def _told(planted: Planted, size: float) -> dict[str, Any]:
    form = planted.form
    return {
        "cause": form.cause,
        "form": form.name,
        "also": list(form.also),
        "size": planted.size,
        "numbers": dict(planted.numbers),
        "over_noise": size,
    }


# ----------------------------------------------------------------------------------------------------
# Scores the diagnosis of a spoiled recording: by what its file says, and nothing else.

Document = Mapping[str, Any]
# How a diagnosis may end.
SUSPECT, REFUSED, NONE_NAMED, TRUE_CAUSE, ALIKE, WRONG, FAILED = (
    "data_suspect",
    "refused",
    "no cause",
    "true cause",
    "says the same",
    "wrong cause",
    "failed",
)
_BAD_INPUT = "exit status 2:"


def scored(answer: Document, found: Document | None, run: Document) -> dict[str, Any]:
    """Return the score of a diagnosis, None where there is none.

    Right is whatever names no cause that is not there: the data are suspect or refused, nothing is named, or
    the causes that are truly there are named, or such as say the very same as the spoiling. In sound data it
    is wrong to suspect or to refuse anything.
    """
    true = set().union(*(accepted(item) for item in answer["hidden"]))
    named = [] if found is None else [cause["name"] for cause in found["causes"]]
    end = _end(found, run, set(named), true, set(answer["alike"]))
    right = end in (NONE_NAMED, TRUE_CAUSE) if answer["sound"] else end not in (WRONG, FAILED)
    return {
        "kind": answer["kind"],
        "words": answer["words"],
        "seed": answer["seed"],
        "draw": answer["draw"],
        "robot": answer["robot"],
        "recording": answer["recording"],
        "true": [item["cause"] for item in answer["hidden"]],
        "forms": [item["form"] for item in answer["hidden"]],
        "named": named,
        "verdict": "" if found is None else found["verdict"],
        "end": end,
        "right": right,
        "suspicions": [] if found is None else found.get("suspicions", []),
        "failure": run["failure"],
        "seconds": run["seconds"],
    }


def _end(found: Document | None, run: Document, named: set[str], true: set[str], alike: set[str]) -> str:
    if found is None:
        return REFUSED if run["failure"].startswith(_BAD_INPUT) else FAILED
    if found["verdict"] == "data_suspect" and not named:
        return SUSPECT
    if not named:
        return NONE_NAMED
    if named <= true:
        return TRUE_CAUSE
    return ALIKE if named <= true | alike else WRONG


# ----------------------------------------------------------------------------------------------------
# The table of a bench of spoiled data: one row a kind, and every miss.

Score = Mapping[str, Any]
_ENDS = (SUSPECT, REFUSED, NONE_NAMED, TRUE_CAUSE, ALIKE)
_HEAD = (
    "kind",
    "what happened",
    "draws",
    "suspect",
    "refused",
    "no cause",
    "true cause",
    "says the same",
    "wrong",
)


def as_markdown(scores: Sequence[Score]) -> str:
    """Return one row for each kind: how its diagnoses ended."""
    lines = [f"| {' | '.join(_HEAD)} |", "|" + "---|" * len(_HEAD)]
    for kind in KINDS:
        own = [score for score in scores if score["kind"] == kind.name]
        if not own:
            continue
        ends = Counter(score["end"] for score in own)
        wrong = sum(not score["right"] for score in own)
        counts = [len(own), *(ends[end] for end in _ENDS), wrong]
        cells = (f"`{kind.name}`", kind.words, *(str(count or "") for count in counts))
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def summary_text(scores: Sequence[Score]) -> str:
    """Return what the draws say together, and every miss."""
    spoiled = [score for score in scores if score["kind"] != "sound"]
    sound = [score for score in scores if score["kind"] == "sound"]
    kinds = {score["kind"] for score in spoiled}
    right = [kind for kind in kinds if all(item["right"] for item in spoiled if item["kind"] == kind)]
    lines = [
        f"spoiled: {sum(score['right'] for score in spoiled)} of {len(spoiled)} draws, "
        f"{len(right)} of {len(kinds)} kinds without a cause that is not there",
        f"sound: {sum(score['right'] for score in sound)} of {len(sound)} draws neither suspected nor given "
        f"a wrong cause; the hidden cause named in {sum(score['end'] == TRUE_CAUSE for score in sound)} of "
        f"{sum(bool(score['true']) for score in sound)}",
    ]
    lines += [f"MISS {score_text(score)}" for score in scores if not score["right"]]
    return "\n".join(lines)


def score_text(score: Score) -> str:
    """Return a draw and how its diagnosis ended, in one line."""
    hidden = " + ".join(f"{cause}.{form}" for cause, form in zip(score["true"], score["forms"], strict=True))
    named = f": {', '.join(score['named'])}" if score["named"] else ""
    said = "; ".join(
        f"{item['where']}: {item['what']}" if item.get("where") else item["what"]
        for item in score["suspicions"]
    )
    why = score["failure"] or said
    return (
        f"{score['kind']} {score['draw']}, {score['robot']}, {hidden or 'nothing'} hidden: "
        f"{score['end']}{named}{f' ({why})' if why else ''}"
    )


# ----------------------------------------------------------------------------------------------------
# Spoils, diagnoses in another process and scores; resumable, and only draws of one code count.

MOST_DRAWS = 100  # of one kind
_SPOILED = 33
_STEPS = 12  # recordings tried for one that a kind can spoil


def making() -> str:
    """Return the digest of what makes and spoils recordings."""
    return f"{making_code()}-{code_of((), (), ('spoiled.py', 'spoiled_kinds.py'))}"


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
