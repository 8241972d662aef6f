"""The report of what changed: of two recordings, and of a series."""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from catheter_sim.diagnosis.changes.compare import CHANGED, UNCHANGED, Changes
from catheter_sim.diagnosis.changes.differences import HOLDS_IF, STEP, mass_of
from catheter_sim.diagnosis.changes.series import NumberOverTime, Series
from catheter_sim.diagnosis.document import cause_entries, finite_document, stamped, to_json
from catheter_sim.diagnosis.notes import Attempts
from catheter_sim.diagnosis.pipeline import model_of
from catheter_sim.diagnosis.report import Head, sentence, write_results, written
from catheter_sim.diagnosis.result import DATA_SUSPECT, UNEXPLAINED
from catheter_sim.diagnosis.words import (
    half_width,
    heldout_error,
    interval,
    listed,
    name_and_unit,
    rounded,
    words,
)
from catheter_sim.files import check_output_folder

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# ----------------------------------------------------------------------------------------------------
# The report of a series of recordings: lines, a part of the document, a table and a picture.

TABLE_FILE, PICTURE_FILE = "series.csv", "series.png"
COLUMNS = ("recording", "change", "parameter", "value", "low", "high", "course")


def series_rows(series: Series) -> Iterator[dict[str, Any]]:
    """Yield a row for each number in each recording (`COLUMNS`)."""
    for item in series.numbers:
        for name, value in zip(series.names, item.changes, strict=True):
            yield {
                "recording": name,
                "change": item.cause,
                "parameter": item.parameter,
                "value": value.value,
                "low": value.ci95[0],
                "high": value.ci95[1],
                "course": course_words(series, item),
            }


def course_words(series: Series, item: NumberOverTime) -> str:
    """Return how a number went, in words."""
    if item.course.kind != STEP or item.course.after is None:
        return item.course.kind
    return f"step after {series.names[item.course.after]}"


def series_lines(series: Series) -> Iterator[str]:
    """Yield the verdict on each later recording, then each number over all of them."""
    for name, item in zip(series.names[1:], series.comparisons, strict=True):
        changed = ", ".join(" or ".join(cause.one_of) for cause in item.changes)
        yield f"{name} since {item.since}: {item.verdict}{f' ({changed})' if changed else ''}"
    for number in series.numbers:
        shown = [
            f"{name} {rounded(value.value, half_width(value.ci95))} ({interval(value.value, value.ci95)})"
            for name, value in zip(series.names[1:], number.changes[1:], strict=True)
        ]
        yield f"{number.cause}.{number.parameter}: {', '.join(shown)}: {course_words(series, number)}"


def series_document(series: Series) -> tuple[dict[str, Any], dict[str, str]]:
    """Return the part of `diagnosis.json` under `series`, and why numbers of it are not finite."""
    document = {
        "recordings": list(series.names),
        "since_first": [
            {
                "dataset": name,
                "verdict": item.verdict,
                "changes": [cause.name for cause in item.changes],
                "rows": item.rows,
                "paired_rows": item.paired_rows,
            }
            for name, item in zip(series.names[1:], series.comparisons, strict=True)
        ],
        "parameters": [
            {
                "cause": item.cause,
                "parameter": item.parameter,
                "course": item.course.kind,
                "step_after": None if item.course.after is None else series.names[item.course.after],
                "values": [value.value for value in item.changes],
                "ci95": [list(value.ci95) for value in item.changes],
            }
            for item in series.numbers
        ],
    }
    return finite_document(document, "series")


def series_figure(series: Series, ax: Any = None) -> Figure:
    """Return a figure of every number over the recordings, with 95 % intervals, a panel for each."""
    from catheter_sim.pictures.curves import panels_of, tidy_axes

    count = max(len(series.numbers), 1)
    columns = min(count, 2)
    rows = math.ceil(count / columns)
    figure, grid = panels_of(ax, rows, columns, (4.6 * columns, 2.6 * rows))
    panels = grid.ravel()
    for axes in panels[len(series.numbers) :]:
        axes.set_axis_off()
    for axes, item in zip(panels, series.numbers, strict=False):
        value = np.array([number.value for number in item.changes])
        low, high = np.array([number.ci95 for number in item.changes]).T
        shown = np.isfinite(value) & np.isfinite(low) & np.isfinite(high)
        place = np.arange(len(value))[shown]
        ends = np.abs([value[shown] - low[shown], high[shown] - value[shown]])
        axes.errorbar(place, value[shown], ends, fmt="o-", color="#1f5f8b", capsize=4, linewidth=1.2)
        axes.axhline(0.0, color="0.6", linewidth=0.8)
        axes.set_xticks(range(len(value)), [_short(name) for name in series.names])
        name, unit = name_and_unit(item.parameter)
        axes.set_ylabel(f"change of {name}{f' [{unit}]' if unit else ''}", fontsize=8)
        axes.set_title(f"{words(item.cause)}: {course_words(series, item)}", fontsize=9)
        tidy_axes(axes)
    return figure


def write_series(series: Series, folder: Path) -> None:
    """Write the table and the picture of a series to a folder that is there."""
    from catheter_sim.pictures.curves import png_of

    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in series_rows(series):
        cells = (row[name] for name in COLUMNS)
        writer.writerow([f"{cell:.6g}" if isinstance(cell, float) else cell for cell in cells])
    written(table.getvalue(), folder / TABLE_FILE)
    written(png_of(series_figure(series)), folder / PICTURE_FILE)


def _short(name: str, most: int = 18) -> str:
    return name if len(name) <= most else name[: most - 1] + "…"


# ----------------------------------------------------------------------------------------------------
# The report of a comparison of two recordings: a sentence, a document, a folder.

ASKS: Mapping[str, str] = {
    CHANGED: "Look at the robot for what changed. Go on with robot.toml, the robot of the later recording.",
    UNCHANGED: "Nothing. The model of the earlier recording still holds.",
    UNEXPLAINED: "Repeat the earlier recording's commands, so that rows pair. Then compare again.",
    DATA_SUSPECT: "Correct the data where the report says, or measure again. Then compare again.",
}


def comparison_sentence(found: Changes) -> str:
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


def comparison_head(found: Changes) -> Head:
    """Return what the report of a comparison says at its head."""
    asks = ASKS.get(found.verdict, ASKS[UNEXPLAINED])
    return Head(comparison_sentence(found), found.verdict, asks, "What changed", "in the earlier recording")


def mass_lines(found: Changes) -> Iterator[str]:
    """Yield a line for each force that came or went and that a mass explains."""
    for change in found.changes:
        mass = mass_of(change, found.diagnosis.dataset.gravity_mps2)
        if mass is not None:
            number = mass.mass_g
            shown, ends = rounded(number.value, half_width(number.ci95)), interval(number.value, number.ci95)
            yield f"{change.name} as a mass: {shown} g (95 %: {ends}); {HOLDS_IF}"


def comparison_document(found: Changes, series: Series | None = None) -> dict[str, Any]:
    """Return a comparison as the document of `diagnosis.json`: a diagnosis's, with what changed.

    `series`: the recordings of which it compares the last with the first, where there are more than two.
    """
    document = to_json(found.diagnosis)
    changes, undefined = finite_document(cause_entries(found.changes), "changes")
    for change, entry in zip(found.changes, changes, strict=True):
        mass = mass_of(change, found.diagnosis.dataset.gravity_mps2)
        if mass is not None:
            as_mass = {
                "mass_g": {"value": mass.mass_g.value, "ci95": list(mass.mass_g.ci95)},
                "sideways_N": mass.sideways_N,
                "holds_if": HOLDS_IF,
            }
            entry["as_mass"], endless = finite_document(as_mass, f"changes.{change.name}.as_mass")
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


def write_comparison(found: Changes, folder: str | os.PathLike[str], series: Series | None = None) -> None:
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
