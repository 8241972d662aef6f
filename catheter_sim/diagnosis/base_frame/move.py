"""Measured positions, and the tip's orientation, moved into the robot's base frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.base_frame.registration import Registration
from catheter_sim.diagnosis.data.columns import QUATERNION, points_of
from catheter_sim.diagnosis.data.trials import Dataset, measured_of


def registered(dataset: Dataset, registration: Registration) -> Dataset:
    """Return the data set with its measured positions, and the tip's orientation, in the base frame."""
    if not registration.applied:
        return dataset
    trials = []
    for trial in dataset.trials:
        values = measured_of(trial, dataset.output_channels)
        moved = _moved_values(values, dataset.output_channels, registration)
        outputs = {name: moved[:, index] for index, name in enumerate(dataset.output_channels)}
        trials.append(replace(trial, outputs=replace(trial.outputs, columns=outputs)))
    return replace(dataset, trials=tuple(trials))


def _moved_values(values: Array, columns: Sequence[str], registration: Registration) -> Array:
    """Return measured outputs (r, o) in the base frame."""
    moved = np.array(values)
    for found in points_of(columns).values():
        from_file = {axis: registration.factor * values[:, index] for axis, index in found.items()}
        for axis, index in found.items():
            row = registration.R_bt["xyz".index(axis)]
            total = np.zeros(len(values))
            for other, weight in zip("xyz", row, strict=True):
                if weight != 0.0:  # a missing value of another axis must not spoil this one
                    total += weight * (from_file[other] - registration.shift_mm["xyz".index(other)])
            moved[:, index] = total
    places = [list(columns).index(name) for name in QUATERNION if name in columns]
    if registration.turned and len(places) == 4:
        moved[:, places] = turned_quaternions(values[:, places], Rotation.from_matrix(registration.R_bt))
    return moved


def turned_quaternions(values: Array, turn: Rotation) -> Array:
    """Return unit quaternions w, x, y, z turned, shape (r, 4), w never negative; NaN where one is missing."""
    turned = np.full_like(values, np.nan)
    known = np.isfinite(values).all(axis=1) & (np.linalg.norm(values, axis=1) > 0.0)
    if known.any():
        found = turn * Rotation.from_quat(values[known], scalar_first=True)
        turned[known] = found.as_quat(canonical=True, scalar_first=True)
    return turned
