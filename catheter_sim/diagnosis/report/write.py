"""A diagnosis written to a folder."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from catheter_sim.catalogue import robot_toml
from catheter_sim.diagnosis.notes import Attempts
from catheter_sim.diagnosis.report.fitted_series import fit_files, fit_table
from catheter_sim.diagnosis.report.result import NEXT_EXPERIMENT_FILE, Diagnosis
from catheter_sim.diagnosis.report.to_json import to_json
from catheter_sim.errors import InputError
from catheter_sim.tables import Table, replaced_when_whole, write_table

if TYPE_CHECKING:
    from catheter_sim.diagnosis.report.pictures import Picture

Content = Callable[[], str | bytes | Table]  # makes what a file holds


def write_results(
    diagnosis: Diagnosis,
    folder: str | os.PathLike[str],
    model_xml: str,
    document: Mapping[str, Any] | None = None,
    sentence: str = "",
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
        sentence: at the head of the report; "": the diagnosis's.
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
        lambda: report_html(told, pictures, sentence),
        lambda: _plain_page(with_notes(diagnosis, attempt), sentence),
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
    yield "robot.toml", lambda: robot_toml(diagnosis.extended_robot)
    if model_xml:
        yield "model.xml", lambda: model_xml
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


def _plain_page(diagnosis: Diagnosis, head: str) -> str:
    """Return the report as a page of a few lines, where the whole one could not be made."""
    notes = "".join(f"<li>{escape(note.text)}</li>" for note in diagnosis.notes)
    causes = ", ".join(cause.name for cause in diagnosis.causes) or "none"
    return (
        f"<!doctype html><meta charset='utf-8'><title>{escape(diagnosis.dataset.name)}</title>"
        f"<h1>{escape(head or diagnosis.verdict)}</h1><p>verdict: {diagnosis.verdict}; causes: {causes}</p>"
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
