"""The picture of the paths in space: where measured points went, and where the model says they went."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.data.columns import points_of
from catheter_sim.diagnosis.report.drawing import COLOURS, LEGEND, tidy_axes, with_pauses
from catheter_sim.diagnosis.report.result import TrialFit
from catheter_sim.diagnosis.thresholds import LEAP_SHARE, SHOWN_MOTION_SHARE
from catheter_sim.tables import Table

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
    ordered = sorted(found, key=_place_of)
    if len(ordered) <= _MOST_POINTS:
        return ordered
    return [ordered[round(k * len(ordered) / _MOST_POINTS) - 1] for k in range(1, _MOST_POINTS + 1)]


def _place_of(point: str) -> float:
    """Return a number that rises along the robot with bodies and the tip, and is 0 for markers."""
    if point == "tip":
        return np.inf
    return float(point.removeprefix("body_")) if point.startswith("body_") else 0.0


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
    seen = np.isfinite(measured[0]) & np.isfinite(measured[1])
    opacity = 0.45 if faint else 1.0
    style = (
        {"linestyle": "none", "marker": "x", "markersize": 4.0} if _leaps(measured) else {"linewidth": 1.5}
    )
    for stage, table in (("before", fit.before), ("after", fit.after)):
        computed = [with_pauses(fit.time_s[seen], values[seen])[1] for values in path(table)]
        label = "" if faint else stage  # the caption says which models these are
        axes.plot(*computed, color=COLOURS[stage], alpha=opacity, label=label, **style)
    rows = np.flatnonzero(seen)
    for row in rows[:: max(1, len(rows) // _MOST_LINES)]:
        ends = [[mine[row], theirs[row]] for mine, theirs in zip(measured, path(fit.after), strict=True)]
        axes.plot(*ends, color="0.75", linewidth=0.6, zorder=1)
    axes.plot(
        *(values[seen] for values in measured),
        linestyle="none",
        marker=".",
        markersize=3.5,
        alpha=opacity,
        color=COLOURS["measured"],
        label="" if faint else "measured",
    )


def _leaps(path: tuple[Array, Array]) -> bool:
    """Return whether most rows lie far from those before them."""
    places = np.stack(path, axis=1)
    places = places[np.isfinite(places).all(axis=1)]
    if len(places) < 2:
        return True
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return bool(np.median(steps) > LEAP_SHARE * np.ptp(places, axis=0).max())
