"""A diagnosis written to a folder."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from catheter_sim.catalogue import robot_toml
from catheter_sim.diagnosis.notes import Attempts
from catheter_sim.diagnosis.report.fitted_series import fit_files, fit_table
from catheter_sim.diagnosis.report.next_experiment import NEXT_EXPERIMENT_FILE
from catheter_sim.diagnosis.report.result import Cause, Diagnosis
from catheter_sim.diagnosis.report.to_json import to_json
from catheter_sim.errors import InputError
from catheter_sim.tables import Table, replaced_when_whole, write_table

if TYPE_CHECKING:
    from catheter_sim.diagnosis.report.html import Head
    from catheter_sim.diagnosis.report.pictures import Picture

Content = Callable[[], str | bytes | Table]  # makes what a file holds


def write_results(
    diagnosis: Diagnosis,
    folder: str | os.PathLike[str],
    model_xml: str,
    document: Mapping[str, Any] | None = None,
    head: Head | None = None,
    attempt: Attempts | None = None,
) -> tuple[Path, ...]:
    """Write everything that a diagnosis leaves into `folder`, made if need be; return the files.

    Each file is written whole or not at all, and `diagnosis.json` last, so that a folder with one is
    complete. Where a file cannot be made, the others are, and a note in both reports says so.

    Args:
        diagnosis: what was found.
        folder: where to; files of an earlier diagnosis are replaced.
        model_xml: the extended robot as MJCF; "": it could not be made.
        document: of diagnosis.json; None: the diagnosis's.
        head: of the report; None: the diagnosis's.
        attempt: has notes on what failed before; gets those on what fails here.

    Raises:
        InputError: the folder, or a file in it, cannot be made or written; what can be is.
    """
    from catheter_sim.diagnosis.report.html import report_html  # here: it imports this module
    from catheter_sim.diagnosis.report.pictures import figures

    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{target}: cannot be made: {error.strerror or error}") from None
    attempt = attempt or Attempts()
    written: list[Path] = []
    refused: list[InputError] = []

    def put(name: str, content: Content) -> None:
        try:
            done = attempt(name, lambda: _written(content(), target / name), lambda: None)
        except InputError as error:
            refused.append(error)
        else:
            written.extend([done] if done else [])

    pictures: tuple[Picture, ...] = attempt("Every picture", lambda: figures(diagnosis), lambda: ())
    for name, content in _beside(diagnosis, model_xml, pictures):
        put(name, content)
    told = with_notes(diagnosis, attempt)
    page = attempt(
        "Most of report.html",
        lambda: report_html(told, pictures, head),
        lambda: _plain_page(with_notes(diagnosis, attempt), head),
    )
    put("report.html", lambda: page)
    made = attempt("Most of diagnosis.json", lambda: dict(document or to_json(told)), lambda: _least(told))
    made["notes"] = [note.text for note in with_notes(diagnosis, attempt).notes]
    put("diagnosis.json", lambda: json.dumps(made, indent=1, allow_nan=False) + "\n")
    if refused:
        raise refused[0]
    return tuple(written)


def _beside(
    diagnosis: Diagnosis, model_xml: str, pictures: Sequence[Picture]
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


def with_notes(diagnosis: Diagnosis, attempt: Attempts) -> Diagnosis:
    """Return a diagnosis with a note on each part that failed."""
    return replace(diagnosis, notes=tuple(dict.fromkeys((*diagnosis.notes, *attempt.notes))))


def _written(content: str | bytes | Table, path: Path) -> Path:
    """Write a file, whole or not at all; return it."""
    if isinstance(content, Table):
        write_table(content, path)
    else:
        with replaced_when_whole(path, binary=isinstance(content, bytes)) as file:
            file.write(content)
    return path


def _plain_page(diagnosis: Diagnosis, head: Head | None) -> str:
    """Return the report as a page of a few lines, where the whole one could not be made."""
    notes = "".join(f"<li>{escape(note.text)}</li>" for note in diagnosis.notes)
    causes = ", ".join(cause.name for cause in diagnosis.causes) or "none"
    title = head.sentence if head else diagnosis.verdict
    return (
        f"<!doctype html><meta charset='utf-8'><title>{escape(diagnosis.dataset.name)}</title>"
        f"<h1>{escape(title)}</h1><p>verdict: {diagnosis.verdict}; causes: {causes}</p>"
        f"<ul>{notes}</ul><p>The figures are in diagnosis.json.</p>"
    )


def _least(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return what `diagnosis.json` says at least, where the rest could not be put into it."""
    return {
        "dataset": diagnosis.dataset.name,
        "robot": diagnosis.dataset.robot_reference,
        "unit": diagnosis.unit,
        "verdict": diagnosis.verdict,
        "causes": [{"name": cause.name} for cause in diagnosis.causes],
    }


def marked_toml(diagnosis: Diagnosis) -> str:
    """Return the extended robot as TOML; a comment says of each effect whether it is a cause."""
    marks = _marks(diagnosis)

    def marked(match: re.Match[str]) -> str:
        return f"# {marks.get(match[1], 'as specified')}\n{match[0]}"

    text = re.sub(r"^\[effects\.(\w+)\]$", marked, robot_toml(diagnosis.extended_robot), flags=re.MULTILINE)
    return "".join(f"# {line}\n" for line in _origin(diagnosis)) + text


def marked_xml(diagnosis: Diagnosis, model_xml: str) -> str:
    """Return MJCF with a comment that says of each effect whether it is a cause."""
    lines = [*_origin(diagnosis), *(f"{name}: {mark}" for name, mark in _marks(diagnosis).items())]
    comment = "\n  ".join(lines).replace("--", "- -")  # two hyphens end a comment
    return f"<!-- {comment} -->\n{model_xml}" if lines else model_xml


def _marks(diagnosis: Diagnosis) -> dict[str, str]:
    """Return what each effect of the extended robot is, by its name."""
    causes = {cause.name: _mark(cause, "cause", ", probability {:.2f}") for cause in diagnosis.causes}
    return causes | {
        cause.name: _mark(cause, "correction, not established", " ({:.2f})")
        for cause in diagnosis.corrections
    }


def _mark(cause: Cause, what: str, how_probable: str) -> str:
    mark = what if math.isnan(cause.probability) else what + how_probable.format(cause.probability)
    return f"{mark}; may be {' or '.join(cause.one_of[1:])} instead" if cause.members else mark


def _origin(diagnosis: Diagnosis) -> list[str]:
    """Return where the extended robot comes from: the same for the same data, whenever it was made."""
    made = diagnosis.provenance
    if not made.made:
        return []
    return [
        f"catheter-sim {made.version}, diagnosis: {diagnosis.verdict}",
        f"SHA-256 of the data: {made.data_digest}",
    ]
