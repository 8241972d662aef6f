"""The pictures of a diagnosis: measured against computed, how large the errors are, and what they follow."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from catheter_sim.diagnosis.residuals import (
    STAGES,
    VIEWS,
    BinnedMean,
    Residuals,
    ViewScore,
    binned_mean,
    fits_to_judge,
    input_columns,
    score_views,
    stack,
)
from catheter_sim.diagnosis.result import Diagnosis, TrialFit
from catheter_sim.diagnosis.trials import Dataset, unit_of
from catheter_sim.diagnosis.wording import axis_label
from catheter_sim.tables import Array

_DPI = 150
_MOST_COLUMNS = 3  # panels in one picture
_LEAST_MOTION = 0.02  # of the output that moves most
_GAP = 5.0  # a pause this many times the median step breaks a line in the pictures
_TIP = ("tip_x_mm", "tip_y_mm", "tip_z_mm")
_COLOURS = {"measured": "#222222", "before": "#b5532a", "after": "#1f5f8b"}
_LEGEND: dict[str, Any] = {"fontsize": 9, "frameon": False}
_LABELS = {"before": "before: calibrated model", "after": "after: extended model"}


@dataclass(frozen=True)
class Picture:
    """A picture of the report.

    Attributes:
        name: of its file, without suffix.
        caption: what is seen, in a sentence or two.
        png: the file's content.
        score: for a residual view, what it explains.
    """

    name: str
    caption: str
    png: bytes
    score: ViewScore | None = None


def figures(diagnosis: Diagnosis) -> tuple[Picture, ...]:
    """Return the report's pictures; the first is the one at its top."""
    pictures = [_headline_picture(diagnosis), _error_picture(diagnosis)]
    fits, subject = judged(diagnosis)
    columns = shown_columns(diagnosis, fits)
    for score in score_views(diagnosis.dataset, fits, diagnosis.unit):
        if not score.coordinate:
            continue
        figure = view_figure(diagnosis.dataset, fits, score, columns, subject)
        caption = f"Mean residual against {VIEWS[score.view]}, with its 95 % interval."
        pictures.append(Picture(f"residuals_{score.view}", caption, _png(figure), score))
    return tuple(pictures)


def shown_columns(diagnosis: Diagnosis, fits: Sequence[TrialFit]) -> list[str]:
    """Return up to three outputs of the reported unit: the tip's if measured, else those that move most.

    An output that hardly moves (2 % of the one that moves most) shows nothing and is left out.
    """
    columns = [name for name in diagnosis.dataset.output_channels if unit_of(name) == diagnosis.unit]
    tip = [name for name in columns if name.startswith("tip_")]
    pool = tip or columns

    def range_of(name: str) -> float:
        values = np.concatenate([fit.measured.columns[name] for fit in fits])
        return float(np.nanmax(values) - np.nanmin(values)) if np.isfinite(values).any() else 0.0

    ranges = {name: range_of(name) for name in pool}
    least = _LEAST_MOTION * max(ranges.values())
    most = sorted(pool, key=lambda name: -ranges[name])[:_MOST_COLUMNS]
    return [name for name in pool if name in most and ranges[name] >= least]


def errors_of(fit: TrialFit, columns: Sequence[str], stage: str) -> Array:
    """Return measured minus computed, shape (columns, r); NaN where nothing was measured."""
    table = fit.before if stage == "before" else fit.after
    return np.array([fit.measured.columns[name] - table.columns[name] for name in columns])


def _is_point(columns: Sequence[str]) -> bool:
    """Return whether the tip's three coordinates are among `columns`, so that it has a distance."""
    return all(name in columns for name in _TIP)


def judged(diagnosis: Diagnosis) -> tuple[tuple[TrialFit, ...], str]:
    """Return the trials by which the residual views are judged, and what to call them."""
    fits = fits_to_judge(diagnosis.dataset, diagnosis.fits)
    only_heldout = all(fit.role == "heldout" for fit in fits)
    return fits, "held-out data" if only_heldout else "all data"


def view_figure(
    dataset: Dataset, fits: Sequence[TrialFit], score: ViewScore, columns: Sequence[str], subject: str
) -> Figure:
    """Return the picture of one view: mean residual of each of `columns` along the coordinate.

    Args:
        dataset: where the trials' inputs are.
        fits: trials to take.
        score: the view, its coordinate and what it explains.
        columns: outputs, a panel each.
        subject: which trials these are, for the title ("held-out trials").
    """
    figure = Figure(figsize=(3.3 * max(len(columns), 2) + 0.6, 3.1), layout="constrained")
    panels = figure.subplots(1, len(columns), sharey=True, squeeze=False)[0]
    shown: list[BinnedMean] = []
    for axes, column in zip(panels, columns, strict=True):
        axes.axhline(0.0, color="0.75", linewidth=0.8, zorder=0)
        for stage in STAGES:
            residuals = stack(dataset, fits, column, stage)
            name, coordinate = _pick(residuals, score)
            curve = binned_mean(coordinate, residuals.values, residuals.blocks)
            shown.append(curve)
            axes.errorbar(
                curve.centre,
                curve.mean,
                yerr=np.nan_to_num(curve.half_width),
                color=_COLOURS[stage],
                label=_LABELS[stage],
                marker="o" if stage == "before" else "s",
                markersize=3.5,
                linewidth=1.3,
                elinewidth=0.8,
                capsize=2,
            )
        axes.set_xlabel(axis_label(name), fontsize=9)
        axes.set_title(axis_label(column).split(" [")[0], fontsize=9)
        axes.tick_params(labelsize=8)
        axes.spines[["top", "right"]].set_visible(False)
        if score.view == "direction":
            axes.set_xticks([-1, 1], ["falling", "rising"])
            axes.set_xlim(-1.5, 1.5)
    panels[0].set_ylim(*_limits(shown))
    panels[0].set_ylabel(f"mean residual [{unit_of(columns[0])}]", fontsize=9)
    panels[0].legend(fontsize=7.5, frameon=False)
    figure.suptitle(
        f"Against {VIEWS[score.view]}, {subject}: explains {percent(score.before_percent)} of the residuals "
        f"before, {percent(score.after_percent)} after",
        fontsize=10,
    )
    return figure


def _headline_picture(diagnosis: Diagnosis) -> Picture:
    heldout = [fit for fit in diagnosis.fits if fit.role == "heldout"] or list(diagnosis.fits)
    columns = shown_columns(diagnosis, heldout)
    fit = max(heldout, key=lambda item: int(np.isfinite(item.measured.columns[columns[0]]).sum()))
    trial = next(item for item in diagnosis.dataset.trials if item.file == fit.file)
    driven = {
        name: values
        for name, values in input_columns(diagnosis.dataset, trial).items()
        if np.ptp(values) > 0.0
    }
    which = "held-out trial" if fit.role == "heldout" else "training trial"
    if len(driven) == 1:
        name, values = next(iter(driven.items()))
        figure = _loops(fit, columns, name, values[: len(fit.time_s)])
        seen = f"against {axis_label(name)}"
        last = ""
    else:
        figure = _series(fit, columns, in_space=_is_point(columns))
        seen = "over time"
        last = " The last panel is the error left."
    return Picture(
        "headline",
        f"The {which} {fit.file} {seen}: measured, computed before (calibrated model without causes) and "
        f"after (extended model).{last}",
        _png(figure),
    )


def _series(fit: TrialFit, columns: Sequence[str], in_space: bool) -> Figure:
    """Return the outputs over time, one below the other, and their error as the last."""
    count = len(columns) + 1
    figure = Figure(figsize=(10.0, 1.7 * count + 0.6), layout="constrained")
    panels = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
    chosen = np.any([np.isfinite(fit.measured.columns[name]) for name in columns], axis=0)
    for axes, column in zip(panels, columns, strict=False):
        for stage, table in (("before", fit.before), ("after", fit.after)):
            axes.plot(
                *_broken(fit.time_s[chosen], table.columns[column][chosen]),
                color=_COLOURS[stage],
                linewidth=1.2,
                label=stage,
            )
        axes.plot(
            fit.time_s[chosen],
            fit.measured.columns[column][chosen],
            linestyle="none",
            marker=".",
            markersize=3.0,
            color=_COLOURS["measured"],
            label="measured",
        )
        axes.set_ylabel(axis_label(column), fontsize=9)
        _plain(axes)
    for stage in STAGES:
        error = errors_of(fit, columns, stage)
        size = np.sqrt((error**2).sum(axis=0)) if in_space else np.sqrt((error**2).mean(axis=0))
        panels[-1].plot(
            *_broken(fit.time_s[chosen], size[chosen]), color=_COLOURS[stage], linewidth=1.2, label=stage
        )
    what = "distance" if in_space else "error"
    panels[-1].set_ylabel(f"{what} [{unit_of(columns[0])}]", fontsize=9)
    panels[-1].set_ylim(bottom=0.0)
    _plain(panels[-1])
    panels[-1].set_xlabel("time in the trial [s]", fontsize=9)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper right", ncols=3, **_LEGEND)
    return figure


def _loops(fit: TrialFit, columns: Sequence[str], name: str, values: Array) -> Figure:
    """Return the outputs against the one input `name`, side by side."""
    count = len(columns)
    figure = Figure(figsize=(10.0, 4.4 if count < 3 else 3.8), layout="constrained")
    panels = figure.subplots(1, count, squeeze=False)[0]
    chosen = np.any([np.isfinite(fit.measured.columns[column]) for column in columns], axis=0)
    for axes, column in zip(panels, columns, strict=True):
        for stage, table in (("before", fit.before), ("after", fit.after)):
            axes.plot(
                values[chosen],
                table.columns[column][chosen],
                color=_COLOURS[stage],
                linewidth=1.4,
                label=stage,
            )
        axes.plot(
            values[chosen],
            fit.measured.columns[column][chosen],
            linestyle="none",
            marker=".",
            markersize=3.5,
            color=_COLOURS["measured"],
            label="measured",
        )
        axes.set_xlabel(axis_label(name), fontsize=9)
        axes.set_ylabel(axis_label(column), fontsize=9)
        _plain(axes)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper right", ncols=3, **_LEGEND)
    return figure


def _error_picture(diagnosis: Diagnosis) -> Picture:
    """Return how often an error of a given size or less occurs, on the held-out rows."""
    fits = [fit for fit in diagnosis.fits if fit.role == "heldout"] or list(diagnosis.fits)
    which = "held-out rows" if fits[0].role == "heldout" else "rows"
    unit = diagnosis.unit
    columns = [name for name in diagnosis.dataset.output_channels if unit_of(name) == unit]
    in_space = unit == "mm" and _is_point(columns)
    columns = list(_TIP) if in_space else columns
    figure = Figure(figsize=(6.4, 3.0), layout="constrained")
    axes = figure.subplots()
    for stage in STAGES:
        errors = []
        for fit in fits:
            residual = errors_of(fit, columns, stage)
            errors.append(np.sqrt((residual**2).sum(axis=0)) if in_space else np.abs(residual).ravel())
        ordered = np.sort(np.concatenate(errors))
        ordered = ordered[np.isfinite(ordered)]
        if len(ordered):
            share = 100.0 * np.arange(1, len(ordered) + 1) / len(ordered)
            axes.plot(ordered, share, color=_COLOURS[stage], linewidth=1.6, label=stage)
    what = "distance of the tip" if in_space else "size of the residual"
    axes.set_xlabel(f"{what}, measured to computed [{unit}]", fontsize=9)
    axes.set_ylabel(f"share of {which} at or below [%]", fontsize=9)
    axes.set_xlim(left=0.0)
    axes.set_ylim(0.0, 100.0)
    axes.legend(**_LEGEND)
    _plain(axes)
    return Picture("errors", f"How large the errors are: the share of {which} by error.", _png(figure))


def _plain(axes: Any) -> None:
    axes.tick_params(labelsize=8)
    axes.grid(color="0.92", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def _broken(time_s: Array, values: Array) -> tuple[Array, Array]:
    """Return the series with a NaN put into every long pause, so that no line crosses it."""
    if len(time_s) < 3:
        return time_s, values
    steps = np.diff(time_s)
    pauses = np.flatnonzero(steps > _GAP * np.median(steps)) + 1
    return np.insert(time_s, pauses, np.nan), np.insert(values, pauses, np.nan)


def _png(figure: Figure) -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=_DPI)
    return stream.getvalue()


def percent(value: float) -> str:
    """Return a share in words: none below zero, no figure where it could not be judged."""
    if not np.isfinite(value):
        return "an unknown part"
    return "nothing" if value < 0.5 else f"{value:.0f} %"


def _limits(curves: Sequence[BinnedMean]) -> tuple[float, float]:
    """Return the range to show: all means, and the bars as far as they do not dwarf them.

    The interval of a mean over two or three cycles can be many times the mean.
    """
    means = np.concatenate([curve.mean for curve in curves])
    bars = np.concatenate([np.nan_to_num(curve.half_width) for curve in curves])
    size = max(float(np.abs(means).max(initial=0.0)), float(np.median(bars)) if len(bars) else 0.0, 1e-9)
    bars = np.minimum(bars, size)
    low, high = float((means - bars).min(initial=0.0)), float((means + bars).max(initial=0.0))
    return low - 0.08 * size, high + 0.08 * size


def _pick(residuals: Residuals, score: ViewScore) -> tuple[str, Array]:
    coordinates = residuals.coordinates[score.view]
    name = score.coordinate if score.coordinate in coordinates else next(iter(coordinates))
    return name, coordinates[name]
