"""Pictures of one trial: outputs over time, or over the one input that is driven."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.report.drawing import COLOURS, LEGEND, errors_of, tidy_axes, with_pauses
from catheter_sim.diagnosis.report.result import TrialFit
from catheter_sim.diagnosis.report.wording import axis_label
from catheter_sim.diagnosis.residuals.coordinates import STAGES
from catheter_sim.pictures.figures import entitle, panels_of


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
        for stage, table in (("before", fit.before), ("after", fit.after)):
            axes.plot(
                *with_pauses(fit.time_s[chosen], table.columns[column][chosen]),
                color=COLOURS[stage],
                linewidth=1.2,
                label=stage,
            )
        axes.plot(
            fit.time_s[chosen],
            fit.measured.columns[column][chosen],
            linestyle="none",
            marker=".",
            markersize=3.0,
            color=COLOURS["measured"],
            label="measured",
        )
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


def loops_figure(fit: TrialFit, columns: Sequence[str], name: str, values: Array) -> Figure:
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
                color=COLOURS[stage],
                linewidth=1.4,
                label=stage,
            )
        axes.plot(
            values[chosen],
            fit.measured.columns[column][chosen],
            linestyle="none",
            marker=".",
            markersize=3.5,
            color=COLOURS["measured"],
            label="measured",
        )
        axes.set_xlabel(axis_label(name), fontsize=9)
        axes.set_ylabel(axis_label(column), fontsize=9)
        tidy_axes(axes)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper right", ncols=3, **LEGEND)
    return figure
