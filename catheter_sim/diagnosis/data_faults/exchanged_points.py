"""Two markers that change their labels over some rows."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from catheter_sim.diagnosis.data_faults.beside_model import BesideModel
from catheter_sim.diagnosis.report.result import DataFault
from catheter_sim.diagnosis.thresholds import AWAY_NOISE, EXCHANGED_ROWS, EXCHANGED_SHARE


def exchanged_points(seen: BesideModel) -> tuple[DataFault, ...]:
    """Return where two points of the robot lie near one another's computed places, and far from their own."""
    faults = []
    for number, (measured, model) in enumerate(zip(seen.measured, seen.models, strict=True)):
        for one, other in combinations(seen.points, 2):
            given = _apart(measured, model, one, one) + _apart(measured, model, other, other)
            put_right = _apart(measured, model, one, other) + _apart(measured, model, other, one)
            rows = (put_right < EXCHANGED_SHARE**2 * given) & (given > (AWAY_NOISE * seen.noise_mm) ** 2)
            index = np.flatnonzero(rows)
            if len(index) < EXCHANGED_ROWS:
                continue
            names = [seen.columns[point[0]].rsplit("_", 2)[0] for point in (one, other)]
            faults.append(
                DataFault(
                    f"{names[0]} and {names[1]} look exchanged in {len(index)} rows. Did the tracker confuse "
                    "two markers? Exchange them there, or leave these cells empty.",
                    seen.trials[number].file,
                    (int(index[0]) + 1, int(index[-1]) + 1),
                )
            )
    return tuple(faults)


def _apart(measured: np.ndarray, model: np.ndarray, one: list[int], other: list[int]) -> np.ndarray:
    """Return the squared distance of a measured point from a computed one, shape (r,) [mm^2]."""
    return np.asarray(((measured[:, one] - model[:, other]) ** 2).sum(axis=1))
