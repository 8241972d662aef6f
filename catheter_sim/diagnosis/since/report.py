"""The report of a comparison of two recordings: a sentence, a document, a folder."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from catheter_sim.diagnosis.notes import Attempts
from catheter_sim.diagnosis.pipeline import model_of
from catheter_sim.diagnosis.report.headline_numbers import heldout_error
from catheter_sim.diagnosis.report.html import Head, sentence
from catheter_sim.diagnosis.report.provenance import stamped
from catheter_sim.diagnosis.report.result import DATA_SUSPECT, UNEXPLAINED
from catheter_sim.diagnosis.report.to_json import causes_document, finite_document, to_json
from catheter_sim.diagnosis.report.wording import half_width, interval, listed, rounded, words
from catheter_sim.diagnosis.report.write import write_results
from catheter_sim.diagnosis.since.compare import CHANGED, UNCHANGED, Comparison
from catheter_sim.diagnosis.since.mass import HOLDS_IF, mass_of
from catheter_sim.diagnosis.since.series import Series
from catheter_sim.diagnosis.since.series_report import series_document, write_series
from catheter_sim.files import check_output_folder

ASKS: Mapping[str, str] = {
    CHANGED: "Look at the robot for what changed. Go on with robot.toml, the robot of the later recording.",
    UNCHANGED: "Nothing. The model of the earlier recording still holds.",
    UNEXPLAINED: "Repeat the earlier recording's commands, so that rows pair. Then compare again.",
    DATA_SUSPECT: "Correct the data where the report says, or measure again. Then compare again.",
}


def comparison_sentence(found: Comparison) -> str:
    """Return what changed, in a sentence or two."""
    error = heldout_error(found.diagnosis)
    between = f"From “{found.since}” to “{found.name}”"
    if found.verdict == CHANGED:
        names = listed([listed([words(name) for name in cause.one_of], "or") for cause in found.changes])
        if found.backward:
            return (
                f"{between}, {names} changed. With what the second has lost, the {error.what} on held-out "
                f"data of the first {error.course}."
            )
        return f"{between}, {names} changed. With it the {error.what} on held-out data {error.course}."
    if found.verdict == UNCHANGED:
        return (
            f"{between}, nothing changed. The model of the first meets the second to "
            f"{error.said(error.before)}; a repeat differs by {error.said_noise}."
        )
    if found.verdict == DATA_SUSPECT:
        return f"{between}: {sentence(found.diagnosis)}"
    return f"{between}, no change is established. {sentence(found.diagnosis)}"


def comparison_head(found: Comparison) -> Head:
    """Return what the report of a comparison says at its head."""
    asks = ASKS.get(found.verdict, ASKS[UNEXPLAINED])
    return Head(comparison_sentence(found), found.verdict, asks, "What changed", "in the earlier recording")


def mass_lines(found: Comparison) -> Iterator[str]:
    """Yield a line for each force that came or went and that a mass explains."""
    for change in found.changes:
        mass = mass_of(change, found.diagnosis.dataset.gravity_mps2)
        if mass is not None:
            number = mass.mass_g
            shown, ends = rounded(number.value, half_width(number.ci95)), interval(number.value, number.ci95)
            yield f"{change.name} as a mass: {shown} g (95 %: {ends}); {HOLDS_IF}"


def comparison_document(found: Comparison, series: Series | None = None) -> dict[str, Any]:
    """Return a comparison as the document of `diagnosis.json`: a diagnosis's, with what changed.

    `series`: the recordings of which it compares the last with the first, where there are more than two.
    """
    document = to_json(found.diagnosis)
    changes, undefined = causes_document(found.changes, "changes")
    for change, entry in zip(found.changes, changes, strict=True):
        mass = mass_of(change, found.diagnosis.dataset.gravity_mps2)
        if mass is not None:
            told = {
                "mass_g": {"value": mass.mass_g.value, "ci95": list(mass.mass_g.ci95)},
                "sideways_N": mass.sideways_N,
                "holds_if": HOLDS_IF,
            }
            entry["as_mass"], endless = finite_document(told, f"changes.{change.name}.as_mass")
            undefined |= endless
    document |= {
        "verdict": found.verdict,
        "causes": [],
        "changes": changes,
        "since": {
            "dataset": found.since,
            "rows": found.rows,
            "paired_rows": found.paired_rows,
            "backward": found.backward,
        },
    }
    if series is not None:
        document["series"], endless = series_document(series)
        undefined |= endless
    kept = {
        name: why for name, why in document.get("undefined", {}).items() if not name.startswith("causes.")
    }
    if kept | undefined:
        document["undefined"] = kept | undefined
    else:
        document.pop("undefined", None)
    return document


def write_comparison(found: Comparison, folder: str | os.PathLike[str], series: Series | None = None) -> None:
    """Write report, diagnosis.json, the changed robot and its model, and the fitted series to `folder`.

    Of more than two recordings also a table and a picture of every number that changed.

    Raises:
        InputError: the folder cannot be made or written.
    """
    attempt = Attempts()
    found = replace(found, diagnosis=stamped(found.diagnosis))
    if series is not None:
        target = check_output_folder(folder)
        target.mkdir(parents=True, exist_ok=True)
        attempt("The series of recordings", partial(write_series, series, target), lambda: None)
    diagnosis = found.diagnosis
    document = attempt(
        "What changed, in diagnosis.json,",
        lambda: comparison_document(found, series),
        lambda: to_json(diagnosis) | {"verdict": found.verdict},
    )
    head = attempt("The sentence at the head", lambda: comparison_head(found), lambda: None)
    model = attempt("model.xml", lambda: model_of(diagnosis), str)
    write_results(diagnosis, folder, model, document, head, attempt)
