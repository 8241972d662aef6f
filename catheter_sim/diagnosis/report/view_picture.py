"""The picture of one view of the residuals: their mean along a coordinate, before and after."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.data.trials import Dataset
from catheter_sim.diagnosis.report.drawing import COLOURS
from catheter_sim.diagnosis.report.result import TrialFit
from catheter_sim.diagnosis.report.wording import axis_label
from catheter_sim.diagnosis.residuals.coordinates import STAGES, VIEWS, Residuals, stack
from catheter_sim.diagnosis.residuals.views import BinnedMean, ViewScore, binned_mean


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
