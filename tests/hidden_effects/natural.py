"""The independent bench: data by physics that is written a second time, diagnosed and scored."""

from __future__ import annotations

import hashlib
import math
import shutil
import subprocess
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

import catheter_sim
from catheter_sim.arrays import Array
from catheter_sim.channels import input_channels
from catheter_sim.lab.engine import (
    LARGEST,
    SMALLEST,
    CannotMake,
    Ground,
    LabForm,
    Numbers,
    Planted,
    columns_of,
    looked_at,
    rms,
    simulated,
)
from catheter_sim.lab.forms import BY_KEY as LISTED
from catheter_sim.lab.forms import CAUSES, FORMS, OUTSIDE
from catheter_sim.lab.robots import BENCH_ROBOTS
from catheter_sim.lab.simulated import Sized, sized
from catheter_sim.lab.specimen import (
    TRAINING,
    Course,
    Specimen,
    drawn_courses,
    drawn_specimen,
    measured,
)
from catheter_sim.tables import Table
from catheter_sim.units import si_factor
from hidden_effects import in_part
from hidden_effects.planting import (
    IN_PART,
    clean_outputs,
    drawn_form,
    drawn_kind,
    in_order,
    outside_for,
    separate,
)
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

# ----------------------------------------------------------------------------------------------------
# Which code made a draw, and which diagnosed it: draws of other code do not count.

BY_KEY = {**LISTED, **{form.key: form for form in in_part.FORMS}}
PACKAGE = Path(catheter_sim.__file__).parent
BENCH = Path(__file__).parent
# What data are made by: the bench, robots and their simulation, and how files are written.
_MAKERS = (
    "channels.py",
    "core",
    "lab",
    "mechanics",
    "mjcf",
    "modelling",
    "robots",
    "simulation",
    "tables.py",
)
# What neither a diagnosis nor its score imports: a change there leaves draws as they are.
NOT_JUDGED = (
    "anatomy",
    "closed_loop",
    "controllers",
    "envs",
    "examples.py",
    "exporting",
    "importing",
    "lab",
    "procedure",
    "public",
    "speed",
    "validation",
    "viewer.py",
)
COMPARING = ("changes",)  # folders: of a diagnosis with --since alone
_NOT_SIMULATED = ("theory", "twin.py", "statics.py", "gpu", "picture.py")


def code_of(
    parts: tuple[str, ...] = ("",), without: tuple[str, ...] = (), bench: tuple[str, ...] = ()
) -> str:
    """Return a short digest of Python files: below parts of the package, and of the bench's."""
    found = hashlib.sha256()
    files: set[Path] = set()
    for part in parts:
        place = PACKAGE / part
        files |= set(place.rglob("*.py")) if place.is_dir() else {place}
    names = {path.relative_to(PACKAGE): path for path in files}
    for name, path in sorted((names | {Path(name): BENCH / name for name in bench}).items()):
        if set(name.parts).isdisjoint(without):
            found.update(str(name).encode() + b"\0" + path.read_bytes())
    return found.hexdigest()[:12]


def making_code(*more: str) -> str:
    """Return the digest of what makes data; `more`: further files of the benches that do."""
    return code_of(_MAKERS, _NOT_SIMULATED, ("natural.py", "in_part.py", "planting.py", "running.py", *more))


def judging_code(comparing: bool = False) -> str:
    """Return the digest of what diagnoses and scores: the package without what neither imports.

    `comparing`: and of what compares two recordings, which a diagnosis of one does not import.
    """
    parts = tuple(path.name for path in PACKAGE.iterdir() if path.name not in NOT_JUDGED)
    bench = ("natural.py", "running.py", *(("interventions.py",) if comparing else ()))
    return code_of(parts, () if comparing else COMPARING, bench)


def whole_code() -> str:
    """Return the digest of the whole package."""
    return code_of()


def commit() -> str:
    """Return the commit of the working tree, "+" where files differ from it; else the package's version."""
    try:
        head, changes = (
            subprocess.run(
                ["git", *command], cwd=PACKAGE, capture_output=True, text=True, check=True
            ).stdout.strip()
            for command in (("rev-parse", "HEAD"), ("status", "--porcelain", "--untracked-files=no"))
        )
        return head + ("+" if changes else "")
    except (OSError, subprocess.CalledProcessError):
        try:
            return version("catheter_sim")
        except PackageNotFoundError:
            return "unknown"


# ----------------------------------------------------------------------------------------------------
# Which story a draw tells, about which robot, by which cause: dealt so that shares hold for any number.

# Of 45 draws; of 450, so: 150, 200, 60 and 40.
STORIES = ("none",) * 15 + ("single",) * 20 + ("pair",) * 6 + ("outside",) * 4
STORIES_IN_PART = ("none",) + ("single",) * 9
FOREIGN_SHARE = 0.4  # share of the effects that have a foreign form, where a cause has one
# Tuning never sees what judging draws: the purpose is part of every key.
_PURPOSE = {"tune": 0, "judge": 1, "tune_in_part": 2, "judge_in_part": 3}
_STORY, _ROBOT, _CONTENT = 11, 12, 13


def dealt(kind: int, purpose: str, seed: int, index: int, values: Sequence[str]) -> str:
    """Return one of `values`: of as many draws as there are values each gets another one.

    Args:
        kind: what is dealt, a number of its own.
        purpose, seed, index: of the draw.
        values: to deal.
    """
    block, place = divmod(index, len(values))
    order = np.random.default_rng((kind, _PURPOSE[purpose], seed, block)).permutation(len(values))
    return values[int(order[place])]


def story_of(purpose: str, seed: int, index: int) -> str:
    """Return which kind of story a draw tells."""
    return dealt(_STORY, purpose, seed, index, STORIES_IN_PART if purpose in IN_PART else STORIES)


def robot_of(purpose: str, seed: int, index: int, names: Sequence[str] = tuple(BENCH_ROBOTS)) -> str:
    """Return which of the bench's robots a draw is about."""
    return dealt(_ROBOT, purpose, seed, index, names)


def generator_of(
    purpose: str, seed: int, index: int, attempt: int, kind: int = _CONTENT
) -> np.random.Generator:
    """Return what draws the rest of a draw."""
    return np.random.default_rng((kind, _PURPOSE[purpose], seed, index, attempt))


# ----------------------------------------------------------------------------------------------------
# Whether other names say the same in a draw's data, whoever looks: nature's own answer to a miss.
#
# The named causes' known forms are fitted, all at once and with the specimen's uncertain numbers in their
# ranges, to the change that the hidden ones make. What they leave, rooted over all values of the training
# trials, is the distance d of the two explanations: one who knew both and the noise would take one for the
# other with probability Phi(-d / 2).

TOLD_APART = 4.0  # distance from which on 2 % would be mistaken
_PASSES = 4
_STEP = 0.2  # of a form's first size
_MOST_FREE = 24

Atom = tuple[LabForm, Numbers]


def distance(ground: Ground, hidden: Sequence[Planted], causes: Sequence[str]) -> float | None:
    """Return how far the nearest combination of the causes' known forms stays from what is hidden.

    None where there are too many numbers to fit, or no posture is found.
    """
    atoms = atoms_of(ground, causes)
    if len(atoms) > _MOST_FREE:
        return None
    values = sum(len(course) for course in ground.courses[:TRAINING]) * len(ground.specimen.columns)
    try:
        wanted = together(ground, hidden)
        if not atoms:
            return float(rms(ground.left(wanted)) * np.sqrt(values))
        sizes = np.zeros(len(atoms))
        best = np.inf
        for _ in range(_PASSES):
            now = together(ground, _sized(atoms, sizes))
            best = min(best, rms(ground.left(wanted - now)))
            steps = np.array([_STEP * form.start for form, _ in atoms])
            slopes = [
                (together(ground, _sized(atoms, sizes + step * unit)) - now) / step
                for step, unit in zip(steps, np.eye(len(atoms)), strict=True)
            ]
            sizes = _kept(atoms, sizes + _fitted(ground, wanted - now, slopes))
        best = min(best, rms(ground.left(wanted - together(ground, _sized(atoms, sizes)))))
    except CannotMake:
        return None
    return float(best * np.sqrt(values))


def atoms_of(ground: Ground, causes: Sequence[str]) -> list[Atom]:
    """Return the known forms of causes, each with every choice of channel, axis or part that it has."""
    specimen, scale = ground.specimen, ground.scale
    return [
        (form, numbers)
        for form in FORMS
        if form.known and form.cause in causes and form.applies(specimen)
        for numbers in form.every(specimen, scale)
    ]


def together(ground: Ground, planted: Sequence[Planted]) -> Array:
    """Return the change over the noise that all of them make, on the ground's few rows, shape (n,)."""
    if not planted:
        return np.zeros(sum(len(rows) for _, rows in ground.picked) * len(ground.specimen.columns))
    specimen, scale, found = ground.specimen, ground.scale, []
    inside = [item for item in planted if not item.form.looks_only]
    watched = len(inside) < len(planted)
    for number, (course, rows) in enumerate(ground.picked):
        if watched:  # who looks remembers all rows
            plain = ground.plain[number]
            shapes = simulated(specimen, scale, inside, course, without=plain) if inside else plain
            seen = looked_at(specimen, scale, planted, course, shapes)
            change = columns_of(specimen, seen.at(rows)) - columns_of(specimen, plain.at(rows))
        else:
            shapes = simulated(specimen, scale, inside, course, rows, ground.few[number])
            change = columns_of(specimen, shapes) - ground.few_outputs[number]
        found.append(change / specimen.noise)
    return np.concatenate(found).ravel()


def _sized(atoms: Sequence[Atom], sizes: Array) -> list[Planted]:
    """Return the atoms that do something."""
    pairs = zip(atoms, sizes.tolist(), strict=True)
    return [Planted(form, size, numbers) for (form, numbers), size in pairs if size != 0.0]


def _kept(atoms: Sequence[Atom], sizes: Array) -> Array:
    """Return sizes within what each form may have."""
    most = np.array([form.most for form, _ in atoms])
    least = np.where([form.signed for form, _ in atoms], -most, 0.0)
    return np.clip(sizes, 0.98 * least, 0.98 * most)


def _fitted(ground: Ground, wanted: Array, slopes: Sequence[Array]) -> Array:
    """Return how much of each slope, calibration beside it, comes nearest to what is wanted."""
    known = ground.calibrations
    directions = np.concatenate([np.stack(slopes, axis=1), known], axis=1)
    left = wanted - ground.left(wanted, slopes)  # what calibration and slopes together explain
    return np.asarray(np.linalg.lstsq(directions, left, rcond=1e-8)[0][: len(slopes)])


# ----------------------------------------------------------------------------------------------------
# Makes a draw: a specimen, its trials, what is planted and how large, and the data.

_ATTEMPTS = 6
_DRAWS = 30  # of causes, for one data set


@dataclass(frozen=True)
class Made:
    """A draw with its data.

    Attributes:
        purpose, seed, index: of the draw.
        attempt: of those made for it, the one that gave data.
        story: one of `deal.STORIES`.
        robot: the bench's name of it.
        ground: specimen and trials.
        planted: what is hidden.
        sizes: of each, over the noise, beyond what a calibration takes.
        noise_kind: one of `noise.KINDS`.
        outputs: measured, shape (r, o) each, in file units; NaN: missing.
        refused: what was drawn before and could not be used, and why.
    """

    purpose: str
    seed: int
    index: int
    attempt: int
    story: str
    robot: str
    ground: Ground
    planted: tuple[Planted, ...]
    sizes: tuple[float, ...]
    noise_kind: str
    outputs: tuple[Array, ...]
    refused: tuple[str, ...]


def make(purpose: str, seed: int, index: int, robots: Sequence[str] = tuple(BENCH_ROBOTS)) -> Made:
    """Return a draw with its data; the arguments decide everything.

    Raises:
        CannotMake: none of the attempts gave data.
    """
    story, robot = story_of(purpose, seed, index), robot_of(purpose, seed, index, robots)
    refused: list[str] = []
    for attempt in range(_ATTEMPTS):
        generator = generator_of(purpose, seed, index, attempt)
        try:
            ground = drawn_ground(generator, robot)
            specimen = ground.specimen
            chosen, sizes = _planted(ground, story, purpose, generator, refused)
            outputs = clean_outputs(ground, chosen)
        except CannotMake as error:
            refused.append(str(error))
            continue
        kind = drawn_kind(generator)
        noisy = tuple(measured(values, specimen.noise, kind, generator) for values in outputs)
        return Made(
            purpose, seed, index, attempt, story, robot, ground, chosen, sizes, kind, noisy, tuple(refused)
        )
    raise CannotMake(f"draw {index}, {robot}, {story}: {'; '.join(refused)}")


def drawn_ground(generator: np.random.Generator, robot: str) -> Ground:
    """Return a specimen of a robot and its trials."""
    specimen = drawn_specimen(generator, robot)
    return Ground(specimen, drawn_courses(specimen, generator))


def _planted(
    ground: Ground, story: str, purpose: str, generator: np.random.Generator, refused: list[str]
) -> tuple[tuple[Planted, ...], tuple[float, ...]]:
    if story == "none":
        return (), ()
    wanted = 2 if story == "pair" else 1
    chosen: list[Sized] = []
    for _ in range(_DRAWS):
        form = _drawn(ground.specimen, story, purpose, generator, [item.form for item, _ in chosen])
        if form is None:
            continue
        found = sized(ground, form, generator)
        if found is None:
            refused.append(f"{form.key}: no size of {SMALLEST:g} to {LARGEST:g} times the noise")
            continue
        if chosen and not separate(ground, chosen[0], found):
            refused.append(f"{chosen[0][0].form.key} + {form.key}: one does what the other does")
            continue
        chosen.append(found)
        if len(chosen) == wanted:
            order = in_order(chosen)
            sizes = tuple(rms(ground.left(change)) for _, change in order)
            return tuple(item for item, _ in order), sizes
    raise CannotMake(
        f"nothing more was drawn that could be planted besides {[p.form.key for p, _ in chosen]}"
    )


def _drawn(
    specimen: Specimen,
    story: str,
    purpose: str,
    generator: np.random.Generator,
    before: Sequence[LabForm],
) -> LabForm | None:
    """Return a form that makes sense on a specimen."""
    if story == "outside":
        choices = [form for form in outside_for(purpose) if form.applies(specimen)]
        return choices[int(generator.integers(len(choices)))]
    return drawn_form(specimen, purpose, FOREIGN_SHARE, generator, before)


# ----------------------------------------------------------------------------------------------------
# Writes a made draw: the data set in one folder, the answer in another.


def write_made(made: Made, folders: Folders, code: str) -> None:
    """Write a draw; the answer, last, says which code made it."""
    specimen = made.ground.specimen
    tables = [
        (table_of(specimen, course, outputs), course.role)
        for course, outputs in zip(made.ground.courses, made.outputs, strict=True)
    ]
    write_tables(folders.data, folders.name, specimen.bench, specimen.columns, specimen.gravity_mps2, tables)
    write_json(answer_of(made) | {"made_by": code}, folders.answer / ANSWER)


def table_of(specimen: Specimen, course: Course, outputs: Array) -> Table:
    """Return a trial as a file's table: commands, then outputs."""
    found = {
        name: course.commands[:, index] / si_factor(name)
        for index, name in enumerate(input_channels(specimen.bench.robot))
    }
    found |= {name: outputs[:, index] for index, name in enumerate(specimen.columns)}
    return Table(course.time_s, found)


def answer_of(made: Made) -> dict[str, Any]:
    """Return what a draw hides."""
    specimen = made.ground.specimen
    units = ["deg" if name.endswith("_deg") else "mm" for name in specimen.columns]
    return {
        "purpose": made.purpose,
        "seed": made.seed,
        "index": made.index,
        "attempt": made.attempt,
        "story": made.story,
        "robot": made.robot,
        "hidden": [
            hidden_of(made.ground, planted, size)
            for planted, size in zip(made.planted, made.sizes, strict=True)
        ],
        "noise": dict(zip(units, specimen.noise.tolist(), strict=True)),
        "noise_kind": made.noise_kind,
        "calibration": dict(specimen.factors),
        "gravity_mps2": specimen.gravity_mps2.tolist(),
        "rows": sum(len(course) for course in made.ground.courses),
        "refused": list(made.refused),
    }


def hidden_of(ground: Ground, planted: Planted, size: float) -> dict[str, Any]:
    """Return what a planted form is; `size` is what it changes over the noise."""
    form = planted.form
    acting = planted.acting(ground.specimen, ground.scale)
    return {
        "cause": form.cause,
        "form": form.name,
        "known": form.known or form.learnt,
        "outside": form.outside,
        "law": form.law,
        "also": list(form.also),
        "size": planted.size,
        "numbers": dict(planted.numbers),
        "over_noise": size,
        "parameters": {name: float(value) for name, value in form.parameters(acting).items()},
    }


# ----------------------------------------------------------------------------------------------------
# Scores one diagnosis against the answer: by what its file says, and nothing else.

SURE = 0.5  # probability beyond which something outside the list is claimed
NONE, BY_OUTSIDE = "none", "outside"  # keys of `probabilities` besides the causes
Document = Mapping[str, Any]


def score(folders: Folders, run: Document) -> dict[str, Any]:
    """Return the score of one draw.

    Args:
        folders: with the answer and what the diagnosis wrote.
        run: how the diagnosis went: `seconds`, and `failure`, "" if it ended well.
    """
    answer = read_json(folders.answer / ANSWER)
    found = read_json(folders.found / "diagnosis.json")
    return scored(answer, None if run["failure"] else found, run)


def scored(answer: Document, found: Document | None, run: Document) -> dict[str, Any]:
    """Return the score of a diagnosis, None where there is none."""
    hidden = answer["hidden"]
    result: dict[str, Any] = {
        "index": answer["index"],
        "story": answer["story"],
        "robot": answer["robot"],
        "true": [item["cause"] for item in hidden],
        "forms": [item["form"] for item in hidden],
        "known": all(item["known"] for item in hidden),
        "sizes": [item["over_noise"] for item in hidden],
        "noise_kind": answer["noise_kind"],
        "rows": answer["rows"],
        "seconds": run["seconds"],
        "failure": run["failure"],
        "verdict": "failed",
        "named": [],
        "right": False,
        "exact": False,
        "false_alarm": False,
        "grouped": False,
        "groups": [],
        "another_named": False,
        "named_right": False,
        "probabilities": None,
        "intervals": [],
    }
    if found is None:
        return result
    named = [cause["name"] for cause in found["causes"]]
    groups = [set(cause.get("one_of") or [cause["name"]]) for cause in found["causes"]]
    chances = probabilities_of(found)
    result |= {
        "verdict": found["verdict"],
        "named": named,
        "grouped": any(len(group) > 1 for group in groups[:1]),
        "groups": [[cause["probability"], sorted(cause["one_of"])] for cause in _grouped(found)],
        "alike": found.get("indistinguishable", []),
        "forms_named": [cause.get("form", "") for cause in found["causes"]],
        "implausible": [cause["name"] for cause in found["causes"] if cause.get("plausible") is False],
        "probabilities": chances,
        "intervals": _intervals(hidden, found["causes"]) if answer["story"] in ("single", "pair") else [],
        "after_over_noise": _after(answer, found),
    }
    result |= _judged(answer, found, named, groups, chances)
    return result


def _grouped(found: Document) -> list[Document]:
    """Return the causes and corrections that are groups."""
    every = (*found["causes"], *found.get("corrections", ()))
    return [cause for cause in every if len(cause.get("one_of") or ()) > 1]


def probabilities_of(found: Document) -> dict[str, float] | None:
    """Return the probability of every cause, of none and of outside; None where none is given."""
    given = found.get("probabilities")
    if isinstance(given, Mapping) and given:
        return {str(name): float(value) for name, value in given.items()}
    single = {
        cause["name"]: float(cause["probability"])
        for cause in found["causes"]
        if cause.get("probability") is not None
    }
    return single or None


def accepted(item: Document) -> set[str]:
    """Return the names that are right for one hidden cause."""
    return {item["cause"], *item["also"], *item.get("alike", [])}


def called_outside(found: Document, chances: Mapping[str, float] | None) -> bool:
    """Return whether a diagnosis says that something is at work that is not on its list."""
    return found["verdict"] in ("unexplained", "improved") or (chances or {}).get(BY_OUTSIDE, 0.0) > SURE


def named_beside(answer: Document, groups: Sequence[set[str]]) -> list[set[str]]:
    """Return the named causes, or groups, of which nothing is at work, nor says the same."""
    right = set().union(*(accepted(item) for item in answer["hidden"]))
    return [group for group in groups if not group & right]


def _judged(
    answer: Document,
    found: Document,
    named: Sequence[str],
    groups: Sequence[set[str]],
    chances: Mapping[str, float] | None,
) -> dict[str, bool]:
    hidden = answer["hidden"]
    beside = bool(named_beside(answer, groups))
    if answer["story"] == "none":
        alarm = found["verdict"] == "cause_found"
        return {"right": not alarm, "exact": found["verdict"] == "no_discrepancy", "false_alarm": alarm}
    if answer["story"] == "outside":
        right = called_outside(found, chances)
        return {"right": right, "exact": right, "another_named": beside}
    if answer["story"] == "single":
        (item,) = hidden
        exact = named[:1] == [item["cause"]]
        right = bool(groups) and bool(groups[0] & accepted(item))
        result = {"named_right": right, "exact": exact, "another_named": beside}
        if not item["known"]:
            right = right or (not beside and called_outside(found, chances))
        return result | {"right": right}
    exact = all(item["cause"] in named for item in hidden)
    first, second = (accepted(item) for item in hidden)
    pairs = ((one, other) for one in groups for other in groups if one is not other)
    both = any(one & first and other & second for one, other in pairs)
    return {"right": both, "named_right": both, "exact": exact, "another_named": beside}


def _intervals(hidden: Sequence[Document], causes: Sequence[Document]) -> list[dict[str, Any]]:
    """Return whether each true parameter lies in its interval, where its form fits one to one."""
    rows = []
    for item in hidden:
        for cause in causes:
            fitted = cause["parameters"]
            if cause["name"] != item["cause"] or not item["known"] or set(fitted) != set(item["parameters"]):
                continue
            for name, value in item["parameters"].items():
                low, high = fitted[name].get("ci95") or (None, None)
                low = -math.inf if low is None else low
                high = math.inf if high is None else high
                rows.append(
                    {
                        "parameter": f"{cause['name']}.{name}",
                        "true": value,
                        "fitted": fitted[name]["value"],
                        "low": low,
                        "high": high,
                        "inside": low <= value <= high,
                    }
                )
    return rows


def _after(answer: Document, found: Document) -> float | None:
    noise = answer["noise"].get(found.get("unit", "mm"))
    after = found.get("heldout", {}).get("rmse_after")
    return None if noise is None or after is None else after / noise


# ----------------------------------------------------------------------------------------------------
# Adds up the scores of many draws: shares against what is asked, Brier score, reliability, every miss.
#
# A share is one of few draws: a line is met where its 95 % interval (Wilson 1927) holds what is asked.

Score = dict[str, Any]
NOT_MADE = "not made"
BINS = (0.0, 0.1, 0.2, 0.5, 0.8, 1.0)  # of probabilities; the promise of those from 0.2 on is judged
JUDGED_FROM = 0.2
FILLED = 20  # answers that a bin needs to be judged
# What is asked.
KNOWN, FOREIGN_NAMED, FOREIGN, ANOTHER, PAIR = 0.97, 0.50, 0.92, 0.03, 0.90
FALSE_ALARM, SAID_OUTSIDE, GROUPED = 0.01, 0.90, 0.15
INTERVALS = (0.90, 0.98)
SECONDS = 30.0


def summary(scores: Sequence[Score]) -> dict[str, Any]:
    """Return the table of many scores: lines with what is asked and reached, reliability, and the misses."""
    made = [item for item in scores if item["verdict"] != NOT_MADE]
    singles = [item for item in made if item["story"] == "single"]
    known = [item for item in singles if item["known"]]
    foreign = [item for item in singles if not item["known"]]
    pairs = [item for item in made if item["story"] == "pair"]
    nothing = [item for item in made if item["story"] == "none"]
    outside = [item for item in made if item["story"] == "outside"]
    inside = [row["inside"] for item in made for row in item["intervals"]]
    answers = answers_of(made)
    lines = [
        share_line("single, known form: named first", (item["right"] for item in known), KNOWN),
        share_line("single, known form: by its own name", (item["exact"] for item in known)),
        share_line(
            "single, known form: answered by a group", (item["grouped"] for item in known), at_most=GROUPED
        ),
        share_line("single, foreign form: named", (item["named_right"] for item in foreign), FOREIGN_NAMED),
        share_line(
            "single, foreign form: named, outside or improved", (item["right"] for item in foreign), FOREIGN
        ),
        share_line(
            "single: another cause named", (item["another_named"] for item in singles), at_most=ANOTHER
        ),
        share_line(
            "both of two named, known forms", (item["right"] for item in pairs if item["known"]), PAIR
        ),
        share_line("both of two named, one foreign", (item["right"] for item in pairs if not item["known"])),
        share_line("both of two, by their own names", (item["exact"] for item in pairs)),
        share_line(
            "nothing hidden: a cause named", (item["false_alarm"] for item in nothing), at_most=FALSE_ALARM
        ),
        share_line("nothing hidden: no discrepancy", (item["exact"] for item in nothing)),
        share_line("outside the list: said so", (item["right"] for item in outside), SAID_OUTSIDE),
        share_line("true parameter in its 95 % interval", inside, INTERVALS[0], INTERVALS[1]),
        share_line(
            "named cause at a bound or implausible",
            (bool(item.get("implausible")) for item in made),
            at_most=0.0,
        ),
        median_line("seconds of a diagnosis, median", [item["seconds"] for item in made], SECONDS),
        median_line("held-out error over the noise, median", [item.get("after_over_noise") for item in made]),
    ]
    return {
        "draws": len(scores),
        "made": len(made),
        "lines": lines,
        "brier": _brier(answers),
        "reliability": reliability(answers),
        "misses": [item for item in scores if not item["right"]],
        "outside_intervals": [
            row | {"index": item["index"]} for item in made for row in item["intervals"] if not row["inside"]
        ],
    }


def answers_of(scores: Iterable[Score]) -> list[tuple[float, bool]]:
    """Return every (draw, cause) pair that was given a probability, with whether the cause is at work.

    A group counts beside its members: it holds where one of them is at work. A cause whose form says the same
    as the hidden one is neither right nor wrong, and left out; so is "outside" where a foreign form of a
    listed cause is hidden.
    """
    found = []
    for item in scores:
        if item["probabilities"] is None:
            continue
        listed = item["story"] in ("single", "pair")
        either, true = set(item.get("either", [])), set(item["true"])
        for chance, group in item.get("groups", []):
            if not set(group) & either:
                found.append((chance, listed and bool(set(group) & true)))
        for name, chance in item["probabilities"].items():
            if name in item.get("either", []):
                continue
            if name == NONE:
                found.append((chance, item["story"] == "none"))
            elif name == BY_OUTSIDE:
                if item["known"] or not listed:
                    found.append((chance, item["story"] == "outside"))
            elif name in CAUSES:
                found.append((chance, listed and name in item["true"]))
    return found


def reliability(answers: Sequence[tuple[float, bool]]) -> list[dict[str, Any]]:
    """Return a row for each bin of probability: how many answers, their mean promise, how many held.

    The promise of a bin is kept where it lies in the 95 % interval of the share that held.
    """
    rows = []
    for low, high in pairwise(BINS):
        own = [(chance, held) for chance, held in answers if low <= chance < high or (high == 1.0 == chance)]
        promised = float(np.mean([chance for chance, _ in own])) if own else math.nan
        held = sum(held for _, held in own)
        met = None
        if low >= JUDGED_FROM and len(own) >= FILLED:
            ends = interval_of(held, len(own))
            met = bool(ends[0] <= promised <= ends[1])
        share = held / len(own) if own else math.nan
        rows.append(
            {"from": low, "to": high, "count": len(own), "promised": promised, "held": share, "met": met}
        )
    return rows


def interval_of(hits: int, of: int) -> tuple[float, float]:
    """Return the 95 % interval of a share (Wilson 1927); 0 to 1 where nothing was counted."""
    if not of:
        return 0.0, 1.0
    found = binomtest(hits, of).proportion_ci(method="wilson")
    return float(found.low), float(found.high)


def as_text(table: dict[str, Any]) -> str:
    """Return the document of `summary` as text."""
    rows = [
        *line_texts(table),
        "",
        "Brier score over all (draw, cause) pairs: " + number_text(table["brier"]),
    ]
    rows += ["reliability:   promised    held   answers"]
    for row in table["reliability"]:
        judged = "" if row["met"] is None else ("  met" if row["met"] else "  MISSED")
        share = f"{row['promised']:10.3f} {row['held']:7.3f}" if row["count"] else " " * 18
        rows.append(f"  {row['from']:.1f} to {row['to']:.1f} {share} {row['count']:9d}{judged}")
    rows += ["", "misses:"]
    rows += [f"  {miss_text(item)}" for item in table["misses"]] or ["  none"]
    return "\n".join([*rows, *outside_texts(table)])


def line_texts(table: dict[str, Any]) -> list[str]:
    """Return how many draws were made, and each line of a table with what is asked of it."""
    rows = [f"{table['made']} of {table['draws']} draws made"]
    for line in table["lines"]:
        if not line["of"]:
            rows.append(f"{line['what']:<44}  not given")
            continue
        count = "" if line["count"] is None else f" ({line['count']} of {line['of']}; {_ends(line)})"
        asked = "" if line["met"] is None else f"  asked {_asked(line)}: {'met' if line['met'] else 'MISSED'}"
        rows.append(f"{line['what']:<44} {line['reached']:8.3f}{count}{asked}")
    return rows


def outside_texts(table: dict[str, Any]) -> list[str]:
    """Return a heading, and each parameter that lies outside its interval."""
    rows = [
        f"  {row['index']:3d} {row['parameter']}: true {row['true']:.4g}, "
        f"fitted {number_text(row['fitted'])} ({row['low']:.4g} to {row['high']:.4g})"
        for row in table["outside_intervals"]
    ]
    return ["", "parameters outside their intervals:", *(rows or ["  none"])]


def miss_text(item: Score) -> str:
    """Return one draw in a line: what was hidden, and what was said."""
    true = " + ".join(f"{cause}.{form}" for cause, form in zip(item["true"], item["forms"], strict=True))
    said = item["verdict"]
    if item["named"]:
        said += f" {' + '.join(item['named'])}"
    if item["failure"]:
        said += f": {item['failure']}"
    sizes = "/".join(f"{size:.0f}" for size in item["sizes"])
    about = f"{sizes} x noise, " if sizes else ""
    about += f"{item['noise_kind']}, {item['rows']} rows"
    text = f"{item['index']:3d} {item['robot']}, {item['story']}: {true or 'nothing'} ({about}) -> {said}"
    chances = sorted((item["probabilities"] or {}).items(), key=lambda pair: -pair[1])[:3]
    if chances:
        text += f" [{', '.join(f'{name} {chance:.2f}' for name, chance in chances)}]"
    if item.get("distance") is not None:
        text += f"; from the truth {item['distance']:.1f}"
    if item.get("after_over_noise") is not None:
        text += f"; error {item['after_over_noise']:.2f} x noise"
    return text


def share_line(
    what: str, hits: Iterable[bool], at_least: float | None = None, at_most: float | None = None
) -> dict[str, Any]:
    values = [bool(hit) for hit in hits]
    reached = sum(values) / len(values) if values else math.nan
    low, high = interval_of(sum(values), len(values))
    asked = at_least is not None or at_most is not None
    met = None
    if asked and values:
        met = (at_least is None or high >= at_least) and (at_most is None or low <= at_most)
    return {
        "what": what,
        "reached": reached,
        "count": sum(values),
        "of": len(values),
        "interval": [low, high],
        "at_least": at_least,
        "at_most": at_most,
        "met": met,
    }


def median_line(what: str, values: Sequence[float | None], at_most: float | None = None) -> dict[str, Any]:
    finite = [value for value in values if value is not None and math.isfinite(value)]
    reached = float(np.median(finite)) if finite else math.nan
    met = None if at_most is None or not finite else bool(reached <= at_most)
    return {
        "what": what,
        "reached": reached,
        "count": None,
        "of": len(finite),
        "at_least": None,
        "at_most": at_most,
        "met": met,
    }


def _brier(answers: Sequence[tuple[float, bool]]) -> float | None:
    return float(np.mean([(chance - held) ** 2 for chance, held in answers])) if answers else None


def _ends(line: dict[str, Any]) -> str:
    low, high = line["interval"]
    return f"{low:.3f} to {high:.3f}"


def _asked(line: dict[str, Any]) -> str:
    ends = [line["at_least"], line["at_most"]]
    if None not in ends:
        return f"{ends[0]:g} to {ends[1]:g}"
    return f"at least {ends[0]:g}" if ends[1] is None else f"at most {ends[1]:g}"


def number_text(value: float | None) -> str:
    return "not given" if value is None else f"{value:.4g}"


# ----------------------------------------------------------------------------------------------------
# Runs the bench: make, diagnose in another process, score; resumable, and only draws of one code count.

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


# ----------------------------------------------------------------------------------------------------
# The list of forms as a table in Markdown, as the documentation shows it.


def forms_table() -> str:
    """Return one row for each form: its cause, its name, its law, who knows it, what says the same."""
    rows = ["| cause | form | law | the diagnosis | also right |", "|---|---|---|---|---|"]
    return "\n".join([*rows, *_rows(FORMS), *_rows(OUTSIDE)]) + "\n"


def _rows(forms: Iterable[LabForm]) -> list[str]:
    rows = []
    for form in forms:
        cause = f"outside: {form.cause}" if form.outside else f"`{form.cause}`"
        name = "" if form.outside else form.name
        knows = "knows it" if form.known else f"does not, {form.purpose}"
        knows = f"knows it by now; drawn as foreign, {form.purpose}" if form.learnt else knows
        also = ", ".join(f"`{other}`" for other in form.also)
        rows.append(f"| {cause} | {name} | {form.law.replace('|', chr(92) + '|')} | {knows} | {also} |")
    return rows
