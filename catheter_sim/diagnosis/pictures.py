"""The pictures of a report."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from catheter_sim.arrays import Array
from catheter_sim.core.effect import Parameter
from catheter_sim.core.variation import MARK, OF_SIDES, SHAPES, Variation, axis_of_variation, variation_of
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
from catheter_sim.diagnosis.result import DiagnosisResult, FittedParameter, TrialFit
from catheter_sim.diagnosis.trials import TIP, Dataset, place_along, points_of, unit_of
from catheter_sim.diagnosis.words import axis_label, before_model, errors_of
from catheter_sim.diagnosis.workers import SERIAL, Workers, map_calls, workers
from catheter_sim.effects import EFFECTS
from catheter_sim.errors import InputError
from catheter_sim.pictures.curves import COLOURS, LEGEND, entitle, panels_of, png_of, tidy_axes
from catheter_sim.tables import Table

SHOWN_MOTION_SHARE = 0.02
"""[share of the motion of the output that moves most] An output that moves less is not drawn. Why: it shows
nothing."""
LEAP_SHARE = 0.2
"""[share of a path's range, from row to row] Beyond it, rows are drawn as places that no line joins. Why: two
postures in random order lie a third of the range apart or more. Two of a path of twenty rows lie a tenth
apart."""
PAUSE_FACTOR = 5.0
"""[times the median step] A longer pause breaks a line. Why: no line may cross rows that were left out."""

# ----------------------------------------------------------------------------------------------------
# The picture of one view of the residuals: their mean along a coordinate, before and after.


def view_figure(
    dataset: Dataset, fits: Sequence[TrialFit], score: ViewScore, columns: Sequence[str], subject: str
) -> Figure:
    """Return the picture of one view: mean residual of each of `columns` along the coordinate.

    `subject` says in the title which trials these are ("held-out trials").
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
                color=COLOURS[stage],
                label=stage,
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
        f"Residuals against {VIEWS[score.view]}, {subject}: explains {percent(score.before_percent)} before, "
        f"{percent(score.after_percent)} after",
        fontsize=10,
    )
    return figure


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


# ----------------------------------------------------------------------------------------------------
# Pictures of one trial: outputs over time, or over the one input that is driven.


_DOTS: dict[str, Any] = {
    "linestyle": "none",
    "marker": ".",
    "markersize": 3.5,
    "color": COLOURS["measured"],
}


def with_pauses(time_s: Array, values: Array) -> tuple[Array, Array]:
    """Return the series with a NaN put into every long pause, so that no line crosses it."""
    if len(time_s) < 3:
        return time_s, values
    steps = np.diff(time_s)
    pauses = np.flatnonzero(steps > PAUSE_FACTOR * np.median(steps)) + 1
    return np.insert(time_s, pauses, np.nan), np.insert(values, pauses, np.nan)


def series_figure(
    fit: TrialFit, columns: Sequence[str], in_space: bool, ax: Any = None, title: str = ""
) -> Figure:
    """Return the outputs over time, one below the other, and their error as the last; into `ax` if given."""
    count = len(columns) + 1
    figure, grid = panels_of(ax, count, 1, (10.0, 1.7 * count + 0.6), sharex=True)
    panels = grid[:, 0]
    if title:
        entitle(figure, grid, title)
    chosen = np.any([np.isfinite(fit.measured.columns[name]) for name in columns], axis=0)
    for axes, column in zip(panels, columns, strict=False):
        _draw_column(axes, fit, column, chosen, fit.time_s, pauses=True)
        axes.set_ylabel(axis_label(column), fontsize=9)
        tidy_axes(axes)
    for stage in STAGES:
        error = errors_of(fit, columns, stage)
        size = np.sqrt((error**2).sum(axis=0)) if in_space else np.sqrt((error**2).mean(axis=0))
        panels[-1].plot(
            *with_pauses(fit.time_s[chosen], size[chosen]), color=COLOURS[stage], linewidth=1.2, label=stage
        )
    what = "distance" if in_space else "error"
    panels[-1].set_ylabel(f"{what} [{unit_of(columns[0])}]", fontsize=9)
    panels[-1].set_ylim(bottom=0.0)
    tidy_axes(panels[-1])
    panels[-1].set_xlabel("time in the trial [s]", fontsize=9)
    if ax is None:
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper right", ncols=3, **LEGEND)
    else:
        panels[0].legend(ncols=3, **LEGEND)
    return figure


def _draw_column(
    axes: Any, fit: TrialFit, column: str, rows: np.ndarray, across: Array, pauses: bool = False
) -> None:
    """Draw an output, computed and measured, over `across`, shape (r,); lines end at `pauses` in time."""
    for stage, table in (("before", fit.before), ("after", fit.after)):
        x, y = across[rows], table.columns[column][rows]
        line = with_pauses(x, y) if pauses else (x, y)
        axes.plot(*line, color=COLOURS[stage], linewidth=1.4, label=stage)
    measured = fit.measured.columns[column][rows]
    axes.plot(across[rows], measured, **_DOTS, label="measured")


def loops_figure(fit: TrialFit, columns: Sequence[str], name: str, values: Array) -> Figure:
    """Return the outputs against the one input `name`, side by side."""
    count = len(columns)
    figure = Figure(figsize=(10.0, 4.4 if count < 3 else 3.8), layout="constrained")
    panels = figure.subplots(1, count, squeeze=False)[0]
    chosen = np.any([np.isfinite(fit.measured.columns[column]) for column in columns], axis=0)
    for axes, column in zip(panels, columns, strict=True):
        _draw_column(axes, fit, column, chosen, values)
        axes.set_xlabel(axis_label(name), fontsize=9)
        axes.set_ylabel(axis_label(column), fontsize=9)
        tidy_axes(axes)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper right", ncols=3, **LEGEND)
    return figure


# ----------------------------------------------------------------------------------------------------
# The picture of the paths in space: where measured points went, and where the model says they went.

_MOST_POINTS = 3  # of a robot, in one picture
_MOST_LINES = 60  # from measured to computed
_WIDTH, _LEAST_HEIGHT, _LARGEST_HEIGHT = 4.8, 1.3, 4.6  # [inch]: its letters can be read on a telephone
_SIDES = {"xz": "from the side", "yz": "from the front", "xy": "from above"}


def paths_figure(fit: TrialFit) -> Figure | None:
    """Return a trial's paths in space, seen in up to two planes; None: no point moves in two coordinates.

    The scale is one in both directions. Thin lines join a measured point to the one computed after.
    """
    points = shown_points(list(fit.measured.columns))
    planes = shown_planes(fit, points)
    if not planes:
        return None
    figure = Figure(layout="constrained")
    panels = figure.subplots(1, len(planes), squeeze=False)[0]
    tallest = 0.0
    for axes, plane in zip(panels, planes, strict=True):
        for point in points:
            if all(f"{point}_{axis}_mm" in fit.measured.columns for axis in plane):
                _draw(axes, fit, point, plane, faint=point != points[-1])
        axes.set_aspect("equal", adjustable="datalim" if len(planes) > 1 else "box")
        axes.set_xlabel(f"{plane[0]} [mm]", fontsize=10)
        axes.set_ylabel(f"{plane[1]} [mm]", fontsize=10)
        axes.set_title(_SIDES["".join(plane)], fontsize=10)
        tidy_axes(axes)
        tallest = max(tallest, float(np.ptp(axes.get_ylim()) / np.ptp(axes.get_xlim())))
    height = min(_LARGEST_HEIGHT, max(_LEAST_HEIGHT, tallest * _WIDTH / len(planes))) + 0.9
    figure.set_size_inches(_WIDTH, height)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, **LEGEND)
    return figure


def shown_points(columns: Sequence[str]) -> list[str]:
    """Return up to three points with two coordinates or more, evenly chosen, the farthest last.

    Markers, of which the names do not say where they are, come first.
    """
    found = [name for name, axes in points_of(columns).items() if len(axes) > 1]
    ordered = sorted(found, key=place_along)
    if len(ordered) <= _MOST_POINTS:
        return ordered
    return [ordered[round(k * len(ordered) / _MOST_POINTS) - 1] for k in range(1, _MOST_POINTS + 1)]


def shown_planes(fit: TrialFit, points: Sequence[str]) -> list[tuple[str, str]]:
    """Return up to two planes in which the farthest point moves, the one with most motion first.

    A coordinate that hardly moves (2 % of the one that moves most) shows nothing: its planes are left out.
    """
    ranges = _ranges(fit, points[-1]) if points else {}
    largest = max(ranges.values(), default=0.0)
    moving = [axis for axis, size in ranges.items() if size > 0.0 and size >= SHOWN_MOTION_SHARE * largest]
    planes = [pair for pair in combinations("xyz", 2) if all(axis in ranges for axis in pair)]
    lively = [pair for pair in planes if all(axis in moving for axis in pair)]
    chosen = lively or [pair for pair in planes if any(axis in moving for axis in pair)][:1]
    return sorted(chosen, key=lambda pair: -ranges[pair[0]] * ranges[pair[1]])[:2]


def _ranges(fit: TrialFit, point: str) -> Mapping[str, float]:
    found = {}
    for axis in "xyz":
        values = fit.measured.columns.get(f"{point}_{axis}_mm")
        if values is not None and np.isfinite(values).any():
            found[axis] = float(np.nanmax(values) - np.nanmin(values))
    return found


def _draw(axes: Any, fit: TrialFit, point: str, plane: tuple[str, str], faint: bool) -> None:
    def path(table: Table) -> tuple[Array, Array]:
        across, along = (table.columns[f"{point}_{axis}_mm"] for axis in plane)
        return across, along

    measured = path(fit.measured)
    known = np.isfinite(measured[0]) & np.isfinite(measured[1])
    opacity = 0.45 if faint else 1.0
    style = (
        {"linestyle": "none", "marker": "x", "markersize": 4.0} if _leaps(measured) else {"linewidth": 1.5}
    )
    for stage, table in (("before", fit.before), ("after", fit.after)):
        computed = [with_pauses(fit.time_s[known], values[known])[1] for values in path(table)]
        label = "" if faint else stage  # the caption says which models these are
        axes.plot(*computed, color=COLOURS[stage], alpha=opacity, label=label, **style)
    rows = np.flatnonzero(known)
    for row in rows[:: max(1, len(rows) // _MOST_LINES)]:
        ends = [[mine[row], theirs[row]] for mine, theirs in zip(measured, path(fit.after), strict=True)]
        axes.plot(*ends, color="0.75", linewidth=0.6, zorder=1)
    dots = (values[known] for values in measured)
    axes.plot(*dots, **_DOTS, alpha=opacity, label="" if faint else "measured")


def _leaps(path: tuple[Array, Array]) -> bool:
    """Return whether most rows lie far from those before them."""
    places = np.stack(path, axis=1)
    places = places[np.isfinite(places).all(axis=1)]
    if len(places) < 2:
        return True
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return bool(np.median(steps) > LEAP_SHARE * np.ptp(places, axis=0).max())


# ----------------------------------------------------------------------------------------------------
# How numbers of causes vary: over time, along the robot, with an input or its past.

VariedNumber = tuple[Variation, FittedParameter]


def variation_figure(diagnosis: DiagnosisResult) -> Figure | None:
    """Return a panel for each number that varies, by what it varies with; None where none does.

    The band is that of the variation's own 95 % intervals, ends together. Of two things at once the first is
    drawn, where the second is in full.
    """
    varied: dict[tuple[str, str, str, str], list[VariedNumber]] = {}
    causes = {cause.name: cause for cause in (*diagnosis.causes, *diagnosis.corrections)}
    for cause in causes.values():
        for name, item in cause.parameters.items():
            if MARK in name:
                way = variation_of(name)
                varied.setdefault((cause.name, way.number, way.along, way.channel), []).append((way, item))
    if not varied:
        return None
    figure = Figure(figsize=(3.6 * max(len(varied), 2), 3.1), layout="constrained")
    panels = figure.subplots(1, len(varied), squeeze=False)[0]
    for axes, ((effect, number, along, channel), ways) in zip(panels, varied.items(), strict=True):
        parameter = EFFECTS[effect].parameter(diagnosis.dataset.robot, number)
        assert parameter is not None  # it was fitted
        own = causes[effect].parameters.get(number)
        level = _levels(diagnosis, along, [way for way, _ in ways])
        _draw_variation(axes, parameter, parameter.null if own is None else own.value, level, ways)
        axes.set_xlabel(axis_of_variation(along, channel), fontsize=9)
        axes.set_title(f"{effect.replace('_', ' ')}: {number}", fontsize=9)
        tidy_axes(axes)
    return figure


def _draw_variation(
    axes: Any, parameter: Parameter, own: float, level: Array, ways: Sequence[VariedNumber]
) -> None:
    """Draw a number that is `own` where nothing varies, at levels (n,)."""
    courses = np.array([SHAPES[way.shape].of(level, way.at) for way, _ in ways])

    def values(sizes: Sequence[float]) -> Array:
        coordinates = parameter.to_fit(own) + np.array(sizes) @ courses
        return np.array([parameter.from_fit(value) for value in coordinates.tolist()])

    low, high = (values([item.ci95[end] for _, item in ways]) for end in (0, 1))
    axes.fill_between(level, low, high, color=COLOURS["after"], alpha=0.2, linewidth=0.0)
    axes.plot(level, values([item.value for _, item in ways]), color=COLOURS["after"])
    axes.axhline(parameter.null, color="0.75", linewidth=0.8, zorder=0)


def _levels(diagnosis: DiagnosisResult, along: str, ways: Sequence[Variation]) -> Array:
    """Return where a number that varies is drawn, shape (n,)."""
    if along in OF_SIDES:
        return np.linspace(-1.0, 1.0, 241)
    most = 1.0
    if along == "time":
        most = max(float(fit.time_s[-1] - fit.time_s[0]) for fit in diagnosis.fits)
    elif along != "place":
        most = 1.25 * max(way.at[-1] for way in ways)  # a little beyond its last bend
    return np.linspace(0.0, most, 241)


# ----------------------------------------------------------------------------------------------------
# The pictures of a diagnosis: measured and computed series, how large the errors are, what they depend on.

PATHS = "paths"  # the picture of the paths in space
VARIATIONS = "variations"  # the picture of how numbers vary
_MOST_COLUMNS = 3  # panels in one picture


@dataclass(frozen=True)
class ReportPicture:
    """A picture of the report.

    `name` is that of its file, without suffix; `score`, of a residual view, what it explains.
    """

    name: str
    caption: str
    png: bytes
    score: ViewScore | None = None


def figures(diagnosis: DiagnosisResult, place: Workers = SERIAL) -> tuple[ReportPicture, ...]:
    """Return the report's pictures; the first is the one at its top: the paths in space, if there are any.

    Where no model was fitted there is one: what was measured. They are drawn at `place`.
    """
    if not diagnosis.was_fitted:
        return _headline_picture(diagnosis)
    scores = [
        item
        for item in score_views(diagnosis.dataset, judged(diagnosis)[0], diagnosis.unit)
        if item.coordinate
    ]
    calls = [(diagnosis, name) for name in _DRAWN] + [(diagnosis, item) for item in scores]
    try:
        with workers(place) as pool:
            drawn = map_calls(pool, _drawn, calls)
    except InputError:  # its processes are killed, again and again: no reason to lose what was found
        drawn = map_calls(SERIAL, _drawn, calls)
    return tuple(picture for some in drawn for picture in some)


def _drawn(diagnosis: DiagnosisResult, what: str | ViewScore) -> tuple[ReportPicture, ...]:
    """Return a picture by its name or what it shows, none where a diagnosis has nothing to show there."""
    return _DRAWN[what](diagnosis) if isinstance(what, str) else _view_picture(diagnosis, what)


def _variation_picture(diagnosis: DiagnosisResult) -> tuple[ReportPicture, ...]:
    figure = variation_figure(diagnosis)
    if figure is None:
        return ()
    return (ReportPicture(VARIATIONS, "How numbers vary, with their 95 % bands.", png_of(figure)),)


def _view_picture(diagnosis: DiagnosisResult, score: ViewScore) -> tuple[ReportPicture, ...]:
    fits, subject = judged(diagnosis)
    columns = shown_columns(diagnosis, fits)
    figure = view_figure(diagnosis.dataset, fits, score, columns, subject)
    caption = f"Mean residual against {VIEWS[score.view]}, with its 95 % interval."
    return (ReportPicture(f"residuals_{score.view}", caption, png_of(figure), score),)


def shown_columns(diagnosis: DiagnosisResult, fits: Sequence[TrialFit]) -> list[str]:
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
    least = SHOWN_MOTION_SHARE * max(ranges.values())
    most = sorted(pool, key=lambda name: -ranges[name])[:_MOST_COLUMNS]
    return [name for name in pool if name in most and ranges[name] >= least]


def is_point(columns: Sequence[str]) -> bool:
    """Return whether the tip's three coordinates are among `columns`, so that it has a distance."""
    return all(name in columns for name in TIP)


def judged(diagnosis: DiagnosisResult) -> tuple[tuple[TrialFit, ...], str]:
    """Return the trials by which the residual views are judged, and what to call them."""
    fits = fits_to_judge(diagnosis.dataset, diagnosis.fits)
    only_heldout = all(fit.role == "heldout" for fit in fits)
    return fits, "held-out data" if only_heldout else "all data"


def _shown_fit(diagnosis: DiagnosisResult, columns: Sequence[str]) -> TrialFit:
    """Return the held-out trial with the most rows measured, of any trial where none is held out."""
    return max(
        _heldout(diagnosis), key=lambda item: int(np.isfinite(item.measured.columns[columns[0]]).sum())
    )


def _heldout(diagnosis: DiagnosisResult) -> list[TrialFit]:
    return [fit for fit in diagnosis.fits if fit.role == "heldout"] or list(diagnosis.fits)


def _paths_picture(diagnosis: DiagnosisResult) -> tuple[ReportPicture, ...]:
    fit = _shown_fit(diagnosis, shown_columns(diagnosis, _heldout(diagnosis)))
    figure = paths_figure(fit)
    if figure is None:
        return ()
    which = "held-out trial" if fit.role == "heldout" else "training trial"
    caption = (
        f"Paths in space in the {which} {fit.file}. {_stages_words(diagnosis)} Thin lines join each measured "
        "point to the one computed after."
    )
    return (ReportPicture(PATHS, caption, png_of(figure)),)


def _stages_words(diagnosis: DiagnosisResult) -> str:
    """Return which models the pictures show as before and after."""
    before = f"Before is the {before_model(diagnosis, 'fast model')}"
    return f"{before}, after the corrected one." if diagnosis.is_corrected else f"{before}; so is after."


def _headline_picture(diagnosis: DiagnosisResult) -> tuple[ReportPicture, ...]:
    columns = shown_columns(diagnosis, _heldout(diagnosis))
    fit = _shown_fit(diagnosis, columns)
    trial = next(item for item in diagnosis.dataset.trials if item.file == fit.file)
    driven = {
        name: values
        for name, values in input_columns(diagnosis.dataset, trial).items()
        if np.ptp(values) > 0.0
    }
    which = "held-out trial" if fit.role == "heldout" else "training trial"
    if len(driven) == 1:
        name, values = next(iter(driven.items()))
        figure = loops_figure(fit, columns, name, values[: len(fit.time_s)])
        against = f"against {axis_label(name)}"
        last = ""
    else:
        figure = series_figure(fit, columns, in_space=is_point(columns))
        against = "over time"
        last = " The last panel is the error."
    said = f"{_stages_words(diagnosis)}{last}" if diagnosis.was_fitted else "No model was fitted."
    caption = f"The {which} {fit.file} {against}. {said}"
    return (ReportPicture("headline", caption, png_of(figure)),)


def _error_picture(diagnosis: DiagnosisResult) -> tuple[ReportPicture, ...]:
    """Return how often an error of a given size or less occurs, on the held-out rows."""
    fits = _heldout(diagnosis)
    which = "held-out rows" if fits[0].role == "heldout" else "rows"
    unit = diagnosis.unit
    columns = [name for name in diagnosis.dataset.output_channels if unit_of(name) == unit]
    in_space = unit == "mm" and is_point(columns)
    columns = list(TIP) if in_space else columns
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
            axes.plot(ordered, share, color=COLOURS[stage], linewidth=1.6, label=stage)
    what = "distance of the tip" if in_space else "size of the residual"
    axes.set_xlabel(f"{what}, measured to computed [{unit}]", fontsize=9)
    axes.set_ylabel(f"share of {which} at or below [%]", fontsize=9)
    axes.set_xlim(left=0.0)
    axes.set_ylim(0.0, 100.0)
    axes.legend(**LEGEND)
    tidy_axes(axes)
    caption = f"The share of {which} with at most this error."
    return (ReportPicture("errors", caption, png_of(figure)),)


_DRAWN: Mapping[str, Callable[[DiagnosisResult], tuple[ReportPicture, ...]]] = {
    PATHS: _paths_picture,
    "headline": _headline_picture,
    "errors": _error_picture,
    VARIATIONS: _variation_picture,
}
