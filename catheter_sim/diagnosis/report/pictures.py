"""The pictures of a diagnosis: measured and computed series, how large the errors are, what they depend
on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from catheter_sim.diagnosis.data.columns import TIP, unit_of
from catheter_sim.diagnosis.report.drawing import COLOURS, LEGEND, errors_of, png_of, tidy_axes
from catheter_sim.diagnosis.report.paths_picture import paths_figure
from catheter_sim.diagnosis.report.result import Diagnosis, TrialFit
from catheter_sim.diagnosis.report.rows import before_model
from catheter_sim.diagnosis.report.series_picture import loops_figure, series_figure
from catheter_sim.diagnosis.report.view_picture import view_figure
from catheter_sim.diagnosis.report.wording import axis_label
from catheter_sim.diagnosis.residuals.coordinates import STAGES, VIEWS, fits_to_judge, input_columns
from catheter_sim.diagnosis.residuals.views import ViewScore, score_views
from catheter_sim.diagnosis.thresholds import SHOWN_MOTION_SHARE

PATHS = "paths"  # the picture of the paths in space
_MOST_COLUMNS = 3  # panels in one picture


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
    """Return the report's pictures; the first is the one at its top: the paths in space, if there are any.

    Where no model was fitted there is one: what was measured.
    """
    if not diagnosis.was_fitted:
        return (_headline_picture(diagnosis),)
    pictures = [*_paths_picture(diagnosis), _headline_picture(diagnosis), _error_picture(diagnosis)]
    fits, subject = judged(diagnosis)
    columns = shown_columns(diagnosis, fits)
    for score in score_views(diagnosis.dataset, fits, diagnosis.unit):
        if not score.coordinate:
            continue
        figure = view_figure(diagnosis.dataset, fits, score, columns, subject)
        caption = f"Mean residual against {VIEWS[score.view]}, with its 95 % interval."
        pictures.append(Picture(f"residuals_{score.view}", caption, png_of(figure), score))
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
    least = SHOWN_MOTION_SHARE * max(ranges.values())
    most = sorted(pool, key=lambda name: -ranges[name])[:_MOST_COLUMNS]
    return [name for name in pool if name in most and ranges[name] >= least]


def is_point(columns: Sequence[str]) -> bool:
    """Return whether the tip's three coordinates are among `columns`, so that it has a distance."""
    return all(name in columns for name in TIP)


def judged(diagnosis: Diagnosis) -> tuple[tuple[TrialFit, ...], str]:
    """Return the trials by which the residual views are judged, and what to call them."""
    fits = fits_to_judge(diagnosis.dataset, diagnosis.fits)
    only_heldout = all(fit.role == "heldout" for fit in fits)
    return fits, "held-out data" if only_heldout else "all data"


def _shown_fit(diagnosis: Diagnosis, columns: Sequence[str]) -> TrialFit:
    """Return the held-out trial with the most rows measured, of any trial where none is held out."""
    return max(
        _heldout(diagnosis), key=lambda item: int(np.isfinite(item.measured.columns[columns[0]]).sum())
    )


def _heldout(diagnosis: Diagnosis) -> list[TrialFit]:
    return [fit for fit in diagnosis.fits if fit.role == "heldout"] or list(diagnosis.fits)


def _paths_picture(diagnosis: Diagnosis) -> list[Picture]:
    fit = _shown_fit(diagnosis, shown_columns(diagnosis, _heldout(diagnosis)))
    figure = paths_figure(fit)
    if figure is None:
        return []
    which = "held-out trial" if fit.role == "heldout" else "training trial"
    caption = (
        f"Paths in space in the {which} {fit.file}. {_stages_words(diagnosis)} Thin lines join each measured "
        "point to the one computed after."
    )
    return [Picture(PATHS, caption, png_of(figure))]


def _stages_words(diagnosis: Diagnosis) -> str:
    """Return which models the pictures show as before and after."""
    before = f"Before is the {before_model(diagnosis, 'fast model')}"
    return f"{before}, after the corrected one." if diagnosis.is_corrected else f"{before}; so is after."


def _headline_picture(diagnosis: Diagnosis) -> Picture:
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
        seen = f"against {axis_label(name)}"
        last = ""
    else:
        figure = series_figure(fit, columns, in_space=is_point(columns))
        seen = "over time"
        last = " The last panel is the error."
    said = f"{_stages_words(diagnosis)}{last}" if diagnosis.was_fitted else "No model was fitted."
    return Picture(
        "headline",
        f"The {which} {fit.file} {seen}. {said}",
        png_of(figure),
    )


def _error_picture(diagnosis: Diagnosis) -> Picture:
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
    return Picture("errors", f"The share of {which} with at most this error.", png_of(figure))
