"""The report of a series of recordings: lines, a part of the document, a table and a picture."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from catheter_sim.diagnosis.report.drawing import png_of, tidy_axes
from catheter_sim.diagnosis.report.to_json import finite_document
from catheter_sim.diagnosis.report.wording import half_width, interval, name_and_unit, rounded, words
from catheter_sim.diagnosis.since.course import STEP
from catheter_sim.diagnosis.since.series import NumberOverTime, Series
from catheter_sim.tables import replaced_when_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
    from catheter_sim.pictures.figures import panels_of

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
    with replaced_when_whole(folder / TABLE_FILE) as file:
        file.write(",".join(COLUMNS) + "\n")
        for row in series_rows(series):
            file.write(",".join(_cell(row[name]) for name in COLUMNS) + "\n")
    with replaced_when_whole(folder / PICTURE_FILE, binary=True) as file:
        file.write(png_of(series_figure(series)))


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    return '"' + str(value).replace('"', '""') + '"' if any(c in str(value) for c in ',"') else str(value)


def _short(name: str, most: int = 18) -> str:
    return name if len(name) <= most else name[: most - 1] + "…"
