"""The bench of interventions: two recordings of one robot; one thing, two or nothing changed."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.lab.engine import LARGEST, SMALLEST, CannotMake, Ground, Planted, columns_of, looked_at, rms
from catheter_sim.lab.robots import BENCH_ROBOTS
from catheter_sim.lab.simulated import Sized, sized
from catheter_sim.lab.specimen import TRAINING, Course, drawn_courses, drawn_specimen, measured
from hidden_effects import natural
from hidden_effects.natural import (
    NOT_MADE,
    Draw,
    Score,
    Steps,
    hidden_of,
    judging_code,
    line_texts,
    making_code,
    median_line,
    miss_text,
    outside_texts,
    run_draws,
    scored,
    share_line,
    table_of,
)
from hidden_effects.planting import (
    clean_outputs,
    drawn_form,
    drawn_kind,
    forms_for,
    in_order,
    outside_for,
    separate,
)
from hidden_effects.running import (
    ANSWER,
    Folders,
    elsewhere,
    keep_settings,
    read_json,
    write_json,
    write_tables,
)

# ----------------------------------------------------------------------------------------------------
# What changes in a draw, which commands the two recordings have, and whether both hide something unknown.

# Of 20 draws; of 200, so: 100, 20 and 80; 70, 70 and 60; 100 and 100.
STORIES = ("single",) * 10 + ("pair",) * 2 + ("none",) * 8
COMMANDS = ("same",) * 7 + ("partly",) * 7 + ("other",) * 6
SHARED = ("foreign",) * 10 + ("",) * 10
FOREIGN = 0.2  # share of the changes that have a foreign form, where a cause has one
_STORY, _ROBOT, _CONTENT, _COMMANDS, _SHARED = 21, 22, 23, 24, 25


def story_of(purpose: str, seed: int, index: int) -> str:
    """Return how much changes: "single", "pair" or "none"."""
    return natural.dealt(_STORY, purpose, seed, index, STORIES)


def commands_of(purpose: str, seed: int, index: int) -> str:
    """Return whether the later recording has the earlier one's commands: "same", "partly" or "other"."""
    return natural.dealt(_COMMANDS, purpose, seed, index, COMMANDS)


def shares_unknown(purpose: str, seed: int, index: int) -> bool:
    """Return whether both recordings hide one and the same thing that no diagnosis knows."""
    return bool(natural.dealt(_SHARED, purpose, seed, index, SHARED))


def robot_of(purpose: str, seed: int, index: int, names: Sequence[str] = tuple(BENCH_ROBOTS)) -> str:
    """Return which of the bench's robots a draw is about."""
    return natural.dealt(_ROBOT, purpose, seed, index, names)


def generator_of(purpose: str, seed: int, index: int, attempt: int) -> np.random.Generator:
    """Return what draws the rest of a draw."""
    return natural.generator_of(purpose, seed, index, attempt, _CONTENT)


# ----------------------------------------------------------------------------------------------------
# The two recordings of a draw before anything is planted: one specimen, and the trials of each.

_RECORDING_DRAWS = 100  # of which trials stay


@dataclass(frozen=True)
class Recordings:
    """Specimen and trials of the two recordings.

    Attributes:
        before: the earlier one.
        courses: trials of the later one.
    """

    before: Ground
    courses: tuple[Course, ...]

    @cached_property
    def after(self) -> Ground:
        """The later one. What a calibration would take shows there: the earlier one has shown the specimen.

        What is large for a form is what is large in the earlier one, so that one law is the same in both.
        """
        return Ground(self.before.specimen, self.courses, calibrates=False, known_scale=self.before.scale)


def drawn_recordings(generator: np.random.Generator, robot: str, commands: str) -> Recordings:
    """Return a specimen and the trials of its two recordings.

    Args:
        generator: draws them.
        robot: one of the bench's.
        commands: "same": both have the same trials; "other": none in common; "partly": some.
    """
    specimen = drawn_specimen(generator, robot)
    first = drawn_courses(specimen, generator)
    if commands == "same":
        return Recordings(Ground(specimen, first), first)
    fresh = tuple(
        replace(course, role=old.role)
        for course, old in zip(drawn_courses(specimen, generator), first, strict=True)
    )
    if commands == "other" and _learnable(fresh):
        return Recordings(Ground(specimen, first), fresh)
    for _ in range(_RECORDING_DRAWS):
        stays = generator.random(len(first)) < 0.5
        stays[TRAINING] = stays[0]  # that one is the first again
        mixed = tuple(old if kept else new for old, new, kept in zip(first, fresh, stays, strict=True))
        if commands == "partly" and not stays.all() and stays.any() and _learnable(mixed):
            return Recordings(Ground(specimen, first), mixed)
    raise CannotMake(f"no trials were drawn that have {commands} commands")


def _learnable(courses: Sequence[Course]) -> bool:
    """Return whether held-out trials move only channels that training moves."""
    moved = np.array([course.commands.any(axis=0) for course in courses])
    learned = moved[: TRAINING + 1].any(axis=0)
    return not moved[TRAINING + 1 :, ~learned].any()


# ----------------------------------------------------------------------------------------------------
# Makes a draw: two recordings of one specimen, what both hide, and what changed between them.

_ATTEMPTS = 6
_DRAWS = 30  # of forms, for one data set
_ANOTHER = 50  # is added to a trial's number


@dataclass(frozen=True)
class Made:
    """A draw with its data.

    Attributes:
        purpose, seed, index: of the draw.
        attempt: of those made for it, the one that gave data.
        story, commands, robot: as dealt (`deal`).
        recordings: specimen and trials.
        shared: what both recordings hide; (): nothing but the specimen's own errors.
        changed: what the later recording hides besides, with its change of the outputs over the noise.
        noise_kind: one of `noise.KINDS`, of both.
        outputs: measured, of the earlier and of the later recording's trials, in file units; NaN: missing.
        refused: what was drawn before and could not be used, and why.
    """

    purpose: str
    seed: int
    index: int
    attempt: int
    story: str
    commands: str
    robot: str
    recordings: Recordings
    shared: tuple[Sized, ...]
    changed: tuple[Sized, ...]
    noise_kind: str
    outputs: tuple[tuple[Array, ...], tuple[Array, ...]]
    refused: tuple[str, ...]


def make(
    purpose: str, seed: int, index: int, robots: Sequence[str] = tuple(BENCH_ROBOTS), bare: bool = False
) -> Made:
    """Return a draw with its data; the arguments decide everything.

    Args:
        purpose, seed, index: of the draw.
        robots: that are dealt.
        bare: without what both recordings hide, all else as it is.

    Raises:
        CannotMake: none of the attempts gave data.
    """
    story, commands = story_of(purpose, seed, index), commands_of(purpose, seed, index)
    robot = robot_of(purpose, seed, index, robots)
    refused: list[str] = []
    for attempt in range(_ATTEMPTS):
        generator = generator_of(purpose, seed, index, attempt)
        try:
            recordings = drawn_recordings(generator, robot, commands)
            shared: tuple[Sized, ...] = ()
            if shares_unknown(purpose, seed, index):
                shared = (_unknown(recordings.before, purpose, generator, refused),)
            changed = _changed(recordings.after, story, purpose, shared, generator, refused)
            shared = () if bare else shared
            clean = _outputs(recordings, shared, changed)
        except CannotMake as error:
            refused.append(str(error))
            continue
        kind = drawn_kind(generator)
        noise = recordings.before.specimen.noise
        first, second = (
            tuple(measured(values, noise, kind, generator) for values in outputs) for outputs in clean
        )
        return Made(
            purpose,
            seed,
            index,
            attempt,
            story,
            commands,
            robot,
            recordings,
            shared,
            changed,
            kind,
            (first, second),
            tuple(refused),
        )
    raise CannotMake(f"draw {index}, {robot}, {story}: {'; '.join(refused)}")


def _outputs(
    recordings: Recordings, shared: Sequence[Sized], changed: Sequence[Sized]
) -> tuple[list[Array], list[Array]]:
    first = clean_outputs(recordings.before, [planted for planted, _ in shared])
    planted = [planted for planted, _ in in_order((*shared, *changed))]
    return first, clean_outputs(recordings.after, planted)


def _unknown(ground: Ground, purpose: str, generator: np.random.Generator, refused: list[str]) -> Sized:
    """Return what both recordings hide: a form that no diagnosis knows, or something outside the list.

    What is another one in every trial is not shared.
    """
    forms = [form for form in forms_for(purpose) if not form.known]
    choices = [form for form in (*forms, *outside_for(purpose)) if form.applies(ground.specimen)]
    for _ in range(_DRAWS):
        form = choices[int(generator.integers(len(choices)))]
        found = sized(ground, form, generator)
        if found is None:
            refused.append(f"shared {form.key}: no size of {SMALLEST:g} to {LARGEST:g} times the noise")
        elif _is_by_trial(ground, found[0]):
            refused.append(f"shared {form.key}: it is another one in every trial")
        else:
            return found
    raise CannotMake("nothing was drawn that both could hide")


def _is_by_trial(ground: Ground, planted: Planted) -> bool:
    """Return whether a form does something else in a trial of the same commands but another number."""
    course, rows = ground.picked[0]
    index = list(rows)
    cut = replace(course, time_s=course.time_s[index], commands=course.commands[index])
    acting, form, plain = planted.acting(ground.specimen, ground.scale), planted.form, ground.few[0]
    found = []
    for number in (course.number, course.number + _ANOTHER):
        here = replace(cut, number=number)
        u = cut.commands if form.command is None else form.command(acting, here, cut.commands)
        shapes = looked_at(ground.specimen, ground.scale, [planted], here, plain)
        found.append(np.concatenate([u.ravel(), columns_of(ground.specimen, shapes).ravel()]))
    return not np.array_equal(found[0], found[1])


def _changed(
    ground: Ground,
    story: str,
    purpose: str,
    shared: Sequence[Sized],
    generator: np.random.Generator,
    refused: list[str],
) -> tuple[Sized, ...]:
    """Return what changed. It is no form of what both hide: another law of one cause is hardly a change."""
    wanted = {"none": 0, "single": 1, "pair": 2}[story]
    chosen: list[Sized] = []
    for _ in range(_DRAWS if wanted else 0):
        before = [planted.form for planted, _ in (*shared, *chosen)]
        form = drawn_form(ground.specimen, purpose, FOREIGN, generator, before)
        if form is None:
            continue
        found = sized(ground, form, generator)
        if found is None:
            refused.append(f"{form.key}: no size of {SMALLEST:g} to {LARGEST:g} times the noise")
        elif chosen and not separate(ground, chosen[0], found):
            refused.append(f"{chosen[0][0].form.key} + {form.key}: one does what the other does")
        else:
            chosen.append(found)
        if len(chosen) == wanted:
            break
    if len(chosen) < wanted:
        raise CannotMake(f"nothing more was drawn that could change besides {len(chosen)}")
    return tuple(in_order(chosen))


# ----------------------------------------------------------------------------------------------------
# Writes a made draw: the two data sets in one folder, the answer in another.

OLD, NEW = "old", "new"  # folders of the two data sets in a draw's


def write_made(made: Made, folders: Folders, code: str) -> None:
    """Write a draw; the answer, last, says which code made it."""
    specimen = made.recordings.before.specimen
    courses = (made.recordings.before.courses, made.recordings.courses)
    for name, trials, outputs in zip((OLD, NEW), courses, made.outputs, strict=True):
        tables = [
            (table_of(specimen, course, values), course.role)
            for course, values in zip(trials, outputs, strict=True)
        ]
        about = f"{folders.name}, {name}"
        write_tables(
            folders.data / name, about, specimen.bench, specimen.columns, specimen.gravity_mps2, tables
        )
    write_json(answer_of(made) | {"made_by": code}, folders.answer / ANSWER)


def answer_of(made: Made) -> dict[str, Any]:
    """Return what changed in a draw, and what both recordings hide."""
    before, after = made.recordings.before, made.recordings.after
    specimen = before.specimen
    units = ["deg" if name.endswith("_deg") else "mm" for name in specimen.columns]
    return {
        "purpose": made.purpose,
        "seed": made.seed,
        "index": made.index,
        "attempt": made.attempt,
        "story": made.story,
        "commands": made.commands,
        "robot": made.robot,
        "hidden": [_change(after, item) for item in made.changed],
        "shared": [hidden_of(before, planted, rms(change)) for planted, change in made.shared],
        "noise": dict(zip(units, specimen.noise.tolist(), strict=True)),
        "noise_kind": made.noise_kind,
        "calibration": dict(specimen.factors),
        "gravity_mps2": specimen.gravity_mps2.tolist(),
        "rows": _rows(made.recordings.courses),
        "rows_before": _rows(before.courses),
        "refused": list(made.refused),
    }


def _change(ground: Ground, item: Sized) -> dict[str, Any]:
    """Return what changed, its parameters as changes of those that the specimen had.

    What a form has at no size, too, is how it acts, such as a time constant: it is told as it is.
    """
    planted, change = item
    found = hidden_of(ground, planted, rms(change))
    null = _parameters_at_rest(ground, planted)
    return found | {
        "parameters": {
            name: value - null[name]
            if math.isfinite(null.get(name, math.inf)) and value != null[name]
            else value
            for name, value in found["parameters"].items()
        }
    }


def _parameters_at_rest(ground: Ground, planted: Planted) -> Mapping[str, Any]:
    """Return the parameters of a form of no size; those that are infinite then may be missing."""
    nothing = Planted(planted.form, 0.0, planted.numbers)
    try:
        with np.errstate(divide="ignore"):
            return planted.form.parameters(nothing.acting(ground.specimen, ground.scale))
    except ZeroDivisionError:
        return {}


def _rows(courses: Sequence[Course]) -> int:
    return sum(len(course) for course in courses)


# ----------------------------------------------------------------------------------------------------
# Scores what was told of a draw against its answer: read from `diagnosis.json`, as a user would.

Document = Mapping[str, Any]
_AS_CAUSES = {"changed": "cause_found", "unchanged": "no_discrepancy"}


def score(folders: Folders, run: Document) -> dict[str, Any]:
    """Return the score of one draw.

    Args:
        folders: with the answer and what the comparison wrote.
        run: how it went: `seconds`, and `failure`, "" if it ended well.
    """
    answer = read_json(folders.answer / ANSWER)
    found = read_json(folders.found / "diagnosis.json")
    return scored_change(answer, None if run["failure"] else found, run)


def scored_change(answer: Document, found: Document | None, run: Document) -> dict[str, Any]:
    """Return the score of a comparison, None where there is none: as of a diagnosis whose causes changed.

    Nothing changed and "changed" is told: a false alarm. "unexplained" is none, but not the answer either.
    """
    about = {"commands": answer["commands"], "shared": [item["cause"] for item in answer["shared"]]}
    if found is None:
        return scored(answer, None, run) | about
    verdict = found["verdict"]
    as_diagnosis = {**found, "causes": found["changes"], "verdict": _AS_CAUSES.get(verdict, verdict)}
    since = found.get("since", {})
    return (
        scored(answer, as_diagnosis, run)
        | about
        | {"verdict": verdict, "paired_rows": since.get("paired_rows")}
    )


# ----------------------------------------------------------------------------------------------------
# Adds up the scores of many draws: shares against what is asked, and every miss.

# What is asked.
SINGLE, PAIR, FALSE_ALARM, INTERVALS = 0.89, 0.55, 1.0 / 80.0, (0.90, 0.98)
SECONDS = 60.0


def summary(scores: Sequence[Score]) -> dict[str, Any]:
    """Return the table of many scores: lines with what is asked and reached, and the misses."""
    made = [item for item in scores if item["verdict"] != NOT_MADE]
    singles, pairs, nothing = (
        [item for item in made if item["story"] == story] for story in ("single", "pair", "none")
    )
    inside = [row["inside"] for item in made for row in item["intervals"]]
    lines = [
        share_line("one changed: told first", (item["right"] for item in singles), SINGLE),
        share_line("one changed: by its own name", (item["exact"] for item in singles)),
        share_line(
            "one changed, known form: told first", (item["right"] for item in singles if item["known"])
        ),
        share_line(
            "one changed, foreign form: first or outside",
            (item["right"] for item in singles if not item["known"]),
        ),
        *(
            share_line(
                f"one changed, {commands} commands: told first",
                (item["right"] for item in singles if item["commands"] == commands),
            )
            for commands in dict.fromkeys(COMMANDS)
        ),
        share_line("two changed: both told", (item["right"] for item in pairs), PAIR),
        share_line("two changed: by their own names", (item["exact"] for item in pairs)),
        share_line(
            "nothing changed: called changed", (item["false_alarm"] for item in nothing), at_most=FALSE_ALARM
        ),
        share_line("nothing changed: called unchanged", (item["exact"] for item in nothing)),
        share_line("true change in its 95 % interval", inside, INTERVALS[0], INTERVALS[1]),
        median_line("seconds of a comparison, median", [item["seconds"] for item in made], SECONDS),
        median_line("seconds of a comparison, longest", _longest(made)),
    ]
    return {
        "draws": len(scores),
        "made": len(made),
        "lines": lines,
        "misses": [item for item in scores if is_miss(item)],
        "outside_intervals": [
            row | {"index": item["index"]} for item in made for row in item["intervals"] if not row["inside"]
        ],
    }


def as_text(table: dict[str, Any]) -> str:
    """Return the document of `summary` as text."""
    rows = [*line_texts(table), "", "misses:"]
    rows += [f"  {draw_text(item)}" for item in table["misses"]] or ["  none"]
    return "\n".join([*rows, *outside_texts(table)])


def draw_text(item: Score) -> str:
    """Return one draw in a line: what changed, what both hide, and what was said."""
    about = f"{item['commands']} commands"
    if item["shared"]:
        about += f", both hide {' + '.join(item['shared'])}"
    return f"{miss_text(item)} ({about})"


def is_miss(item: Score) -> bool:
    """Return whether a draw is listed: not right, or nothing changed and not told so."""
    return not item["right"] or (item["story"] == "none" and not item["exact"])


def _longest(made: Sequence[Score]) -> list[float]:
    return [max((item["seconds"] for item in made), default=float("nan"))]


# ----------------------------------------------------------------------------------------------------
# Runs the bench: make, compare in another process, score; resumable, and only draws of one code count.


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
    return making_code("interventions.py")


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
