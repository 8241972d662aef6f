"""The report: `diagnosis.json`, the page, fitted series and the extended robot, written to a folder."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from html import escape
from itertools import chain, count
from pathlib import Path, PurePath
from typing import Any

from catheter_sim.catalogue import robot_toml
from catheter_sim.channels import channel_inputs, drives_of
from catheter_sim.diagnosis.document import to_json
from catheter_sim.diagnosis.notes import Attempts
from catheter_sim.diagnosis.pictures import PATHS, ReportPicture, judged
from catheter_sim.diagnosis.residuals import VIEWS
from catheter_sim.diagnosis.result import (
    CAUSE_FOUND,
    DATA_SUSPECT,
    IMPROVED,
    NEXT_EXPERIMENT_FILE,
    NO_DISCREPANCY,
    Cause,
    DiagnosisResult,
    TrialFit,
)
from catheter_sim.diagnosis.shapes import in_space, words_on_rows
from catheter_sim.diagnosis.thresholds import ESTABLISHED, LEAST_SHOWN_PROBABILITY, NEAR_NOISE, SIGNIFICANT_P
from catheter_sim.diagnosis.trials import Dataset
from catheter_sim.diagnosis.words import (
    asks_of,
    axis_label,
    before_model,
    bench_rows,
    cause_rows,
    column_words,
    corrected_names,
    errors_and_noise,
    extra_row,
    half_width,
    headline_numbers,
    heldout_error,
    key_rows,
    listed,
    number_words,
    parameter_row,
    probability_rows,
    ranking_row,
    remainder_rows,
    rounded,
    shown_share,
    shown_unit,
    simulated_text,
    sortable,
    spoken,
    test_rows,
    trial_row,
    unit_row,
    use_words,
    words,
)
from catheter_sim.diagnosis.workers import SERIAL, Workers
from catheter_sim.effects.varying import varies
from catheter_sim.errors import InputError
from catheter_sim.page.render import page_json, page_script, png_source, rendered
from catheter_sim.tables import Table, replaced_when_whole, write_table

# ----------------------------------------------------------------------------------------------------
# The fitted series of trials as CSV files: their names and columns.

INPUT = "input_"  # before a channel's name, in the fitted series


def fit_files(fits: Sequence[TrialFit]) -> tuple[str, ...]:
    """Return the names of the CSV files that hold the fitted series of trials, no two alike.

    `fitted_<role>_<trial>.csv`: the trial's file without its ending, its folders before it with `_` between
    (`a/t.csv` held out: `fitted_heldout_a_t.csv`). Where two trials would still have one name, on a system
    that takes capitals for small letters too, those that `dataset.toml` lists later get `_2`, `_3` ….
    """
    names: list[str] = []
    for fit in fits:
        path = PurePath(fit.file)
        parts = [part for part in (*path.parent.parts, path.stem) if part not in (path.anchor, "..")]
        trial = "_".join(parts)
        while len(os.fsencode(trial)) > _LONGEST_NAME:
            trial = trial[1:]
        name = "_".join(("fitted", *filter(None, [fit.role]), trial))
        taken = {other.lower() for other in names}
        numbers = (f"{name}_{number}" for number in count(2))
        names.append(next(item for item in chain([name], numbers) if item.lower() not in taken))
    return tuple(f"{name}.csv" for name in names)


def fit_table(fit: TrialFit, dataset: Dataset) -> Table:
    """Return measured, before, after and what was commanded side by side.

    Columns `<output>`, `before_<output>`, `after_<output>` and `input_<channel>`, of a data set's trial.
    """
    columns = dict(fit.measured.columns)
    for prefix, table in (("before", fit.before), ("after", fit.after)):
        columns |= {f"{prefix}_{name}": table.columns[name] for name in fit.measured.columns}
    inputs = next(trial.inputs for trial in dataset.trials if trial.file == fit.file)
    rows = slice(0, len(fit.time_s))
    drives = drives_of(dataset.robot, inputs.actuation)
    given = channel_inputs(replace(dataset.robot, actuation=inputs.actuation), inputs)
    for drive, values in zip(drives, given.T, strict=True):
        columns[f"{INPUT}{drive.column}"] = values[rows] / drive.quantity.file_size
    loads = (("force", inputs.force_tip, "N"), ("moment", inputs.moment_tip, "Nm"))
    for kind, values, unit in loads:
        if values.any():
            columns |= {f"{INPUT}{kind}_tip_{axis}_{unit}": values[rows, k] for k, axis in enumerate("xyz")}
    return Table(fit.time_s, columns, fit.file)


_LONGEST_NAME = 200  # of a trial, in the name of a file [bytes]; systems allow some 255 in all


# ----------------------------------------------------------------------------------------------------
# The report of a diagnosis: a page that takes a minute to read, with the evidence folded below it.
#
# What was found, the figures, the paths in space, what is wrong, what to do now, what was tried, the
# doubts. One HTML file with its pictures in it: it needs no network and fits a telephone.

_TEMPLATE = "report_template.html"


_MOST_CANDIDATES = 6  # rows of the ranking; diagnosis.json holds all


def sentence(diagnosis: DiagnosisResult) -> str:
    """Return what was found, in one to three sentences."""
    robot, error = diagnosis.extended_robot.name, heldout_error(diagnosis)
    if diagnosis.verdict == CAUSE_FOUND:
        names = [listed([words(name) for name in cause.one_of], "or") for cause in diagnosis.causes]
        return " ".join(
            [
                f"The model of {robot} is wrong about {listed(names)}.",
                f"Corrected, its {error.what} on held-out data {error.course}.",
                *_side_by_side(diagnosis),
            ]
        )
    if diagnosis.verdict == IMPROVED:
        several = len(diagnosis.corrections) != 1
        what, none = ("corrections", "None of them is") if several else ("a correction", "It is not")
        return (
            f"With {what}, the {error.what} of {robot} on held-out data {error.course}. {none} established: "
            f"{_why_not(diagnosis)}."
        )
    if diagnosis.verdict == NO_DISCREPANCY:
        model = "calibrated model" if diagnosis.calibrated else "model"
        as_is = "" if diagnosis.calibrated else ", as specified,"
        return (
            f"The {model} of {robot}{as_is} agrees with these data. Its {error.what} on held-out data is "
            f"{error.said(error.before)}; row-to-row noise is {error.said_noise}."
        )
    if diagnosis.has_too_little:
        return too_little_sentence(diagnosis)
    if diagnosis.verdict == DATA_SUSPECT:
        first, *others = [item.words for item in diagnosis.data_faults] or ["the report does not say where."]
        more = f" There {'is' if len(others) == 1 else 'are'} {len(others)} more below." if others else ""
        return f"These data of {robot} look wrong, so no cause was looked for. {first}{more}"
    return (
        f"The {error.what} of {robot} on held-out data is {error.said(error.before)}; row-to-row noise is "
        f"{error.said_noise}. No cause is established: {_why_not(diagnosis)}."
    )


def too_little_sentence(diagnosis: DiagnosisResult) -> str:
    """Return what is missing, after what fits all the same where that was asked for."""
    robot, missing = diagnosis.extended_robot.name, " ".join(item.words for item in diagnosis.data_faults)
    found = diagnosis.unproved
    if found is None:
        return f"No cause can be named from these data of {robot}. {missing}"
    result = max(found.by_unit.values(), key=lambda item: item.gain_percent)
    before, after, noise = (f"{text} {shown_unit(result.unit)}".strip() for text in errors_and_noise(result))
    if not found.causes:
        fits = f"The search found nothing that fits these data of {robot} better than the calibrated model"
        return f"{fits}, which is off by {before} on data held out. That rules nothing out. {missing}"
    fits, s = listed([_with_numbers(cause) for cause in found.causes]), "s" * (len(found.causes) == 1)
    if found.times_noise <= NEAR_NOISE:
        fits += f" explain{s} training and held-out data of {robot} to the noise"
    else:
        fits += f" lower{s} the error of {robot} on data held out from {before} to {after} (noise: {noise})"
    return f"{fits[0].upper()}{fits[1:]}. That cannot be proved. {missing}"


def _with_numbers(cause: Cause) -> str:
    """Return a cause in words with its numbers: "actuation gain 1.30"."""
    shown = []
    for name, item in cause.parameters.items():
        text, unit = number_words(name)
        value = f"{rounded(item.value, half_width(item.ci95))} {unit}".strip()
        shown.append(value if len(cause.parameters) == 1 else f"{text} {value}")
    return f"{words(cause.name)} {shown[0]}" if len(shown) == 1 else f"{words(cause.name)} ({listed(shown)})"


def _side_by_side(diagnosis: DiagnosisResult) -> Iterator[str]:
    """Yield what is said beside named causes: further corrections, and something else at work."""
    count = len(diagnosis.corrections)
    if count:
        number = "One further correction lowers" if count == 1 else f"{count} further corrections lower"
        yield f"{number} the error; {'it is not' if count == 1 else 'none is'} established."
    outside = diagnosis.probabilities.get("outside", 0.0)
    if outside >= ESTABLISHED:
        yield f"Something outside the list is at work too, with probability {outside:.2f}."
    elif any(note.code == "something_else_too" for note in diagnosis.notes):
        yield "Something else is at work too."


def _why_not(diagnosis: DiagnosisResult) -> str:
    """Return why no cause is established, by the probabilities."""
    outside = diagnosis.probabilities.get("outside", 0.0)
    if outside >= ESTABLISHED:
        return f"something outside the list is at work with probability {outside:.2f}"
    likely = {
        name: value
        for name, value in diagnosis.probabilities.items()
        if name not in ("none", "outside") and value >= LEAST_SHOWN_PROBABILITY
    }
    if not likely:
        return "these data do not show what is wrong"
    name = max(likely, key=lambda item: likely[item])
    said = f"the most probable one, {words(name)}, has probability {likely[name]:.2f}"
    return f"{said} and does not pass every check" if likely[name] >= ESTABLISHED else said


@dataclass(frozen=True)
class Head:
    """What a report says that is not of one recording, but of a comparison of two.

    `verdict` is that of diagnosis.json, `asks` what it asks a reader to do, `title` stands above the causes;
    `null` says what a number's value without the cause is.
    """

    sentence: str
    verdict: str
    asks: str
    title: str = "What is wrong"
    null: str = "without the effect"


def report_html(
    diagnosis: DiagnosisResult, pictures: Sequence[ReportPicture], head: Head | None = None
) -> str:
    """Return the report as one HTML text.

    `head` is that of a comparison; None: the diagnosis's own.
    """
    context = {
        "head": head or Head(sentence(diagnosis), diagnosis.verdict, asks_of(diagnosis)),
        "dataset": diagnosis.dataset,
        "diagnosis": diagnosis,
        "unit": shown_unit(diagnosis.unit),
        "before_model": before_model(diagnosis),
        "provenance": diagnosis.provenance,
        **_summary(diagnosis),
        **_ranking(diagnosis),
        **_evidence(diagnosis, pictures),
        **_moving(diagnosis, pictures),
    }
    return rendered("catheter_sim.diagnosis", _TEMPLATE, context, {"spoken": spoken})


def _summary(diagnosis: DiagnosisResult) -> dict[str, Any]:
    """Return what stands before the evidence."""
    return {
        "numbers": headline_numbers(diagnosis),
        "causes": cause_rows(diagnosis.causes),
        "corrections": cause_rows(diagnosis.corrections),
        "absorbs": [words(cause.name) for cause in diagnosis.absorbs],
        "indistinguishable": [
            listed([words(name) for name in group], "or") for group in diagnosis.indistinguishable
        ],
        "why_not": _why_not(diagnosis),
        "bench": bench_rows(diagnosis),
        "next_words": diagnosis.next_experiment.words,
        "next_file": NEXT_EXPERIMENT_FILE if diagnosis.next_experiment.inputs is not None else "",
        "use_words": use_words(diagnosis),
        "remainder": remainder_rows(diagnosis),
    }


def _moving(diagnosis: DiagnosisResult, pictures: Sequence[ReportPicture]) -> dict[str, Any]:
    """Return what the page needs to move: its script, and the robot in space if the paths are drawn."""
    drawn = any(picture.name == PATHS for picture in pictures[:1])
    space = in_space(diagnosis, fit_files(diagnosis.fits)) if drawn else None
    return {
        "space": space,
        "space_json": page_json(space),
        "space_words": words_on_rows(space) if space else "",
        "script": page_script("scene.js", "report.js"),
    }


def _ranking(diagnosis: DiagnosisResult) -> dict[str, Any]:
    best = sorted(diagnosis.ranking, key=lambda item: sortable(item.heldout_rmse))
    named = corrected_names(diagnosis)
    shown = [
        item
        for index, item in enumerate(best)
        if index < _MOST_CANDIDATES or not item.causes or set(item.causes) == named
    ]
    return {
        "ranking": [ranking_row(diagnosis, item, best) for item in shown],
        "ranking_left_out": len(best) - len(shown),
        "ranking_words": _ranking_words(diagnosis),
        "noise": errors_and_noise(diagnosis.headline)[2],
    }


def _evidence(diagnosis: DiagnosisResult, pictures: Sequence[ReportPicture]) -> dict[str, Any]:
    _, subject = judged(diagnosis)
    dataset = diagnosis.dataset
    not_computed = {} if diagnosis.was_fitted else {"before": "-", "after": "-"}
    return {
        "pictures": [
            {
                "name": picture.name,
                "caption": picture.caption,
                "alt": spoken(picture.caption).striptags(),
                "wide": picture.name != PATHS,
                "data": png_source(picture.png),
            }
            for picture in pictures
        ],
        "shown_first": sum(picture.score is None for picture in pictures),
        "units": [
            unit_row(diagnosis, unit) | {"simulated": simulated_text(diagnosis, unit)}
            for unit in (diagnosis.by_unit if diagnosis.was_fitted else ())
        ],
        "extra": [extra_row(name, value) for name, value in diagnosis.extra.items()],
        "probabilities": probability_rows(diagnosis),
        "least_probability": f"{LEAST_SHOWN_PROBABILITY:g}",
        "calibrated": [parameter_row(name, item) for name, item in diagnosis.calibrated.items()],
        "views": [
            {
                "view": VIEWS[score.view],
                "coordinate": "each output's own"
                if score.coordinate == "own"
                else axis_label(score.coordinate),
                "before": shown_share(score.before_percent),
                "after": shown_share(score.after_percent),
            }
            for score in (picture.score for picture in pictures)
            if score is not None
        ],
        "tests": test_rows(diagnosis),
        "significant": f"{SIGNIFICANT_P:g}",
        "subject": subject,
        "trials": [trial_row(diagnosis, fit) | not_computed for fit in diagnosis.fits],
        "gravity": listed([f"{value:g}" for value in dataset.gravity_mps2]),
        "inputs": listed([column_words(name) for name in dataset.input_channels]),
        "outputs": listed([column_words(name) for name in dataset.output_channels]),
        "fit_files": fit_files(diagnosis.fits),
        "keys": key_rows(diagnosis),
    }


def _ranking_words(diagnosis: DiagnosisResult) -> str:
    """Return what the highlighted row of the ranking is."""
    named = corrected_names(diagnosis)
    if not named:
        return f"The highlighted row is the {before_model(diagnosis)}, without any cause."
    if set(diagnosis.chosen_in_training) == named:
        return "The highlighted set was chosen inside the training data. The held-out error took no part."
    first = listed([words(name) for name in diagnosis.chosen_in_training]) or "no cause"
    return (
        f"The highlighted set is in robot.toml. Inside the training data {first} was chosen. The notes say "
        "what changed it."
    )


# ----------------------------------------------------------------------------------------------------
# A diagnosis written to a folder.

Content = Callable[[], str | bytes | Table]  # makes what a file holds


def write_results(
    diagnosis: DiagnosisResult,
    folder: str | os.PathLike[str],
    model_xml: str,
    given: Mapping[str, Any] | None = None,
    head: Head | None = None,
    attempt: Attempts | None = None,
    place: Workers = SERIAL,
) -> tuple[Path, ...]:
    """Write everything that a diagnosis leaves into `folder`, made if need be; return the files.

    Each file is written whole or not at all, and `diagnosis.json` last, so that a folder with one is
    complete. Where a file cannot be made, the others are, and a note in both reports says so. `model_xml` is
    the extended robot as MJCF, "" where it could not be made; `given`, the document of diagnosis.json, and
    `head` are the diagnosis's own if None. `attempt` has notes on what failed before, and gets those on what
    fails here. Pictures are drawn at `place`.

    Raises:
        InputError: the folder, or a file in it, cannot be made or written; what can be is.
    """
    from catheter_sim.diagnosis.pictures import figures

    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{target}: cannot be made: {error.strerror or error}") from None
    attempt = attempt or Attempts()
    files: list[Path] = []
    refused: list[InputError] = []

    def put(name: str, content: Content) -> None:
        try:
            done = attempt(name, lambda: written(content(), target / name), lambda: None)
        except InputError as error:
            refused.append(error)
        else:
            files.extend([done] if done else [])

    pictures: tuple[ReportPicture, ...] = attempt(
        "Every picture", lambda: figures(diagnosis, place), lambda: ()
    )
    for name, content in _beside(diagnosis, model_xml, pictures):
        put(name, content)
    noted = with_notes(diagnosis, attempt)
    page = attempt(
        "Most of report.html",
        lambda: report_html(noted, pictures, head),
        lambda: _plain_page(with_notes(diagnosis, attempt), head),
    )
    put("report.html", lambda: page)
    document = attempt("Most of diagnosis.json", lambda: dict(given or to_json(noted)), lambda: _least(noted))
    document["notes"] = [note.text for note in with_notes(diagnosis, attempt).notes]
    put("diagnosis.json", lambda: json.dumps(document, indent=1, allow_nan=False) + "\n")
    if refused:
        raise refused[0]
    return tuple(files)


def _beside(
    diagnosis: DiagnosisResult, model_xml: str, pictures: Sequence[ReportPicture]
) -> Iterator[tuple[str, Content]]:
    """Yield the name of each file beside the two reports, with what makes its content."""
    yield "robot.toml", lambda: marked_toml(diagnosis)
    if model_xml:
        yield "model.xml", lambda: marked_xml(diagnosis, model_xml)
    for fit, name in zip(diagnosis.fits, fit_files(diagnosis.fits), strict=True):
        yield name, partial(fit_table, fit, diagnosis.dataset)
    inputs = diagnosis.next_experiment.inputs
    if inputs is not None:
        yield NEXT_EXPERIMENT_FILE, lambda: inputs
    for picture in pictures:
        yield f"{picture.name}.png", partial(bytes, picture.png)


def with_notes(diagnosis: DiagnosisResult, attempt: Attempts) -> DiagnosisResult:
    """Return a diagnosis with a note on each part that failed."""
    return replace(diagnosis, notes=tuple(dict.fromkeys((*diagnosis.notes, *attempt.notes))))


def written(content: str | bytes | Table, path: Path) -> Path:
    """Return a path after the file there was written, whole or not at all."""
    if isinstance(content, Table):
        write_table(content, path)
    else:
        with replaced_when_whole(path, binary=isinstance(content, bytes)) as file:
            file.write(content)
    return path


def _plain_page(diagnosis: DiagnosisResult, head: Head | None) -> str:
    """Return the report as a page of a few lines, where the whole one could not be made."""
    notes = "".join(f"<li>{escape(note.text)}</li>" for note in diagnosis.notes)
    causes = ", ".join(cause.name for cause in diagnosis.causes) or "none"
    title = head.sentence if head else diagnosis.verdict
    return (
        f"<!doctype html><meta charset='utf-8'><title>{escape(diagnosis.dataset.name)}</title>"
        f"<h1>{escape(title)}</h1><p>verdict: {diagnosis.verdict}; causes: {causes}</p>"
        f"<ul>{notes}</ul><p>The figures are in diagnosis.json.</p>"
    )


def _least(diagnosis: DiagnosisResult) -> dict[str, Any]:
    """Return what `diagnosis.json` says at least, where the rest could not be put into it."""
    return {
        "dataset": diagnosis.dataset.name,
        "robot": diagnosis.dataset.robot_reference,
        "unit": diagnosis.unit,
        "verdict": diagnosis.verdict,
        "causes": [{"name": cause.name} for cause in diagnosis.causes],
    }


def marked_toml(diagnosis: DiagnosisResult) -> str:
    """Return the extended robot as TOML; a comment says of each effect whether it is a cause."""
    marks = _marks(diagnosis)
    said: set[str] = set()

    def marked(match: re.Match[str]) -> str:
        first = match[1] not in said
        said.add(match[1])
        return f"# {marks.get(match[1], 'as specified')}\n{match[0]}" if first else match[0]

    # An effect of which nothing but variations is given has no table of its own.
    table = r"^\[\[?effects\.(\w+)(?:\.varies)?\]?\]$"
    text = re.sub(table, marked, robot_toml(diagnosis.extended_robot), flags=re.MULTILINE)
    return "".join(f"# {line}\n" for line in _origin(diagnosis)) + text


def marked_xml(diagnosis: DiagnosisResult, model_xml: str) -> str:
    """Return MJCF with a comment that says of each effect whether it is a cause."""
    lines = [*_origin(diagnosis), *(f"{name}: {mark}" for name, mark in _marks(diagnosis).items())]
    if varies(diagnosis.extended_robot):
        lines.append("a number that varies has its own value here; robot.toml has how it varies")
    comment = "\n  ".join(lines).replace("--", "- -")  # two hyphens end a comment
    return f"<!-- {comment} -->\n{model_xml}" if lines else model_xml


def _marks(diagnosis: DiagnosisResult) -> dict[str, str]:
    """Return what each effect of the extended robot is, by its name."""
    causes = {cause.name: _mark(cause, "cause", ", probability {:.2f}") for cause in diagnosis.causes}
    return causes | {
        cause.name: _mark(cause, "correction, not established", " ({:.2f})")
        for cause in diagnosis.corrections
    }


def _mark(cause: Cause, what: str, how_probable: str) -> str:
    mark = what if math.isnan(cause.probability) else what + how_probable.format(cause.probability)
    return f"{mark}; may be {' or '.join(cause.one_of[1:])} instead" if cause.members else mark


def _origin(diagnosis: DiagnosisResult) -> list[str]:
    """Return where the extended robot comes from: the same for the same data, whenever it was made."""
    origin = diagnosis.provenance
    if not origin.made:
        return []
    return [
        f"catheter-sim {origin.version}, diagnosis: {diagnosis.verdict}",
        f"SHA-256 of the data: {origin.data_digest}",
    ]
