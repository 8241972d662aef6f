"""A tracker that takes something else for its marker, over some rows at a time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.data_faults.beside_model import BesideModel
from catheter_sim.diagnosis.report.result import DataFault
from catheter_sim.diagnosis.thresholds import (
    AWAY_BACK_SHARE,
    AWAY_LONGEST_SHARE,
    AWAY_NOISE,
    AWAY_REACH_SHARE,
    AWAY_ROWS,
    AWAY_STEPS,
    AWAY_STEPS_NEAR,
)


@dataclass(frozen=True)
class Excursion:
    """Rows over which a point is measured far from where it was, and comes back.

    Attributes:
        trial, point: indices.
        start, end: first row away, and first row back.
    """

    trial: int
    point: int
    start: int
    end: int

    def __len__(self) -> int:
        return self.end - self.start


def jumps_elsewhere(seen: BesideModel) -> tuple[DataFault, ...]:
    """Return where a point leaps away from one row to the next, and back some rows later.

    No robot does that: the leap is larger than any motion that the model expects of it thereabouts, and a
    fair share of all its motion, as no slip is. Single rows are outliers, which every tracker has.
    """
    found = [
        item
        for trial in range(len(seen.trials))
        for point in range(len(seen.points))
        for item in _excursions(seen, trial, point)
    ]
    found = [item for item in found if len(item) > 1]
    if sum(len(item) for item in found) < AWAY_ROWS:
        return ()
    faults = []
    for number in dict.fromkeys(item.trial for item in found):
        mine = [item for item in found if item.trial == number]
        points = dict.fromkeys(seen.columns[seen.points[item.point][0]].rsplit("_", 2)[0] for item in mine)
        rows = len({row for item in mine for row in range(item.start, item.end)})
        spans = dict.fromkeys(f"{item.start + 1} to {item.end}" for item in mine)
        faults.append(
            DataFault(
                f"{', '.join(points)} leaps away and comes back ({rows} rows: {', '.join([*spans][:5])}"
                f"{', ...' if len(spans) > 5 else ''}). Did the tracker lose it, or follow something else? "
                "Leave these cells empty.",
                seen.trials[number].file,
                (min(item.start for item in mine) + 1, max(item.end for item in mine)),
            )
        )
    return tuple(faults)


def _excursions(seen: BesideModel, trial: int, point: int) -> list[Excursion]:
    columns = seen.points[point]
    error, model = seen.errors[trial][:, columns], seen.models[trial][:, columns]
    known = np.flatnonzero(np.isfinite(error).all(axis=1))
    if len(known) < AWAY_ROWS:
        return []
    error = error[known]
    steps = np.maximum(
        _nearby(_steps(model), np.max)[known], _nearby(_steps(error + model[known]), np.median)
    )
    places = np.concatenate([item[:, columns] for item in seen.models])
    reach = float(np.linalg.norm(np.nanmax(places, axis=0) - np.nanmin(places, axis=0)))
    most = np.maximum(AWAY_STEPS * steps + AWAY_NOISE * seen.noise_mm, AWAY_REACH_SHARE * reach)
    longest = max(AWAY_ROWS, round(AWAY_LONGEST_SHARE * len(known)))
    found, row = [], 1
    while row < len(known):
        size = float(np.linalg.norm(error[row] - error[row - 1]))
        end = _way_back(error, row, size, longest) if size > most[row] else None
        if end is not None:
            found.append(Excursion(trial, point, int(known[row]), int(known[end - 1]) + 1))
        row = end + 1 if end is not None else row + 1
    return found


def _way_back(error: Array, start: int, size: float, longest: int) -> int | None:
    """Return the first row at which the error is back where it was before `start`, None: it never is."""
    away = np.linalg.norm(error[start : start + longest + 1] - error[start - 1], axis=1)
    back = np.flatnonzero(away < AWAY_BACK_SHARE * size)
    if not len(back) or (away[: back[0]] < 0.5 * size).any():
        return None
    return start + int(back[0])


def _steps(points: Array) -> Array:
    """Return by how much a point has moved since the row before, shape (r,)."""
    return np.concatenate([[0.0], np.linalg.norm(np.diff(points, axis=0), axis=1)])


def _nearby(values: Array, of: Callable[..., Array]) -> Array:
    """Return a figure of the values within some rows of each row, shape (r,)."""
    padded = np.pad(values, AWAY_STEPS_NEAR, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * AWAY_STEPS_NEAR + 1)
    return np.asarray(of(windows, axis=1))
