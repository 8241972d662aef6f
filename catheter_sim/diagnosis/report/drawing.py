"""How the pictures of a diagnosis are drawn: colours, axes, gaps."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.report.result import TrialFit
from catheter_sim.diagnosis.thresholds import PAUSE_FACTOR

_DPI = 150


COLOURS = {"measured": "#222222", "before": "#b5532a", "after": "#1f5f8b"}


LEGEND: dict[str, Any] = {"fontsize": 9, "frameon": False}


def tidy_axes(axes: Any) -> None:
    axes.tick_params(labelsize=8)
    axes.grid(color="0.92", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def with_pauses(time_s: Array, values: Array) -> tuple[Array, Array]:
    """Return the series with a NaN put into every long pause, so that no line crosses it."""
    if len(time_s) < 3:
        return time_s, values
    steps = np.diff(time_s)
    pauses = np.flatnonzero(steps > PAUSE_FACTOR * np.median(steps)) + 1
    return np.insert(time_s, pauses, np.nan), np.insert(values, pauses, np.nan)


def png_of(figure: Figure) -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=_DPI)
    return stream.getvalue()


def errors_of(fit: TrialFit, columns: Sequence[str], stage: str) -> Array:
    """Return measured minus computed, shape (columns, r); NaN where nothing was measured."""
    table = fit.before if stage == "before" else fit.after
    return np.array([fit.measured.columns[name] - table.columns[name] for name in columns])
