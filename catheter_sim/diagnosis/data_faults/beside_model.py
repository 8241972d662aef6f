"""Measurements beside what the calibrated model says of them: what checks of the data look at."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.data.columns import points_of, unit_of
from catheter_sim.diagnosis.data.trials import Trial, all_inputs, measured_of
from catheter_sim.diagnosis.data_faults.model_error import relative_error
from catheter_sim.diagnosis.thresholds import MOVES_SHARE, NO_EQUILIBRIUM_ERROR


@dataclass(frozen=True)
class BesideModel:
    """All trials, the held-out ones too, measured and computed.

    Attributes:
        trials: all.
        columns: outputs.
        models: what the calibrated model says, shape (r, o) each.
        noise: of each unit.
        moving: whether the robot moved while it was measured.
    """

    trials: Sequence[Trial]
    columns: Sequence[str]
    models: Sequence[Array]
    noise: Mapping[str, float]
    moving: bool = False

    @cached_property
    def measured(self) -> tuple[Array, ...]:
        """Outputs, shape (r, o) each; NaN: missing."""
        return tuple(measured_of(trial, self.columns) for trial in self.trials)

    @cached_property
    def errors(self) -> tuple[Array, ...]:
        """Measured less computed, shape (r, o) each."""
        return tuple(a - b for a, b in zip(self.measured, self.models, strict=True))

    @cached_property
    def scaled_models(self) -> tuple[Array, ...]:
        """The models, each output scaled and shifted as it fits all trials best."""
        measured, models = np.concatenate(self.measured), np.concatenate(list(self.models))
        line = []
        for shown, computed in zip(measured.T, models.T, strict=True):
            known = np.isfinite(shown) & np.isfinite(computed)
            moves = known.any() and float(np.ptp(computed[known])) > 0.0
            line.append(np.polyfit(computed[known], shown[known], 1) if moves else np.array([1.0, 0.0]))
        scale, offset = np.array(line).T
        return tuple(model * scale + offset for model in self.models)

    @cached_property
    def drives(self) -> tuple[Array, ...]:
        """Inputs over their ranges in all trials, shape (r, i) each; those that never change are left out."""
        given = [all_inputs(trial.inputs) for trial in self.trials]
        span = np.ptp(np.concatenate(given), axis=0)
        return tuple(item[:, span > 0.0] / span[span > 0.0] for item in given)

    @cached_property
    def points(self) -> tuple[list[int], ...]:
        """Indices of each point's coordinates, all with the same axes as the first one."""
        found = list(points_of(self.columns).values())
        return tuple(list(axes.values()) for axes in found if found and list(axes) == list(found[0]))

    @cached_property
    def noise_mm(self) -> float:
        """Noise of positions."""
        return max(self.noise.get("mm", 0.0), 1e-9)

    @cached_property
    def moves(self) -> tuple[int, ...]:
        """Indices of the outputs that the model moves by a fair share of the largest motion of their unit."""
        spread = np.nanstd(np.concatenate(list(self.models)), axis=0)
        units = [unit_of(name) for name in self.columns]
        most = {unit: max(s for s, u in zip(spread, units, strict=True) if u == unit) for unit in set(units)}
        return tuple(
            k for k, unit in enumerate(units) if spread[k] > MOVES_SHARE * most[unit] and most[unit] > 0.0
        )

    @cached_property
    def error_shares(self) -> Array:
        """Each trial's error over the spread of what the model says of all trials, shape (t,)."""
        return np.array([self.error_share(number, model) for number, model in enumerate(self.models)])

    def error_share(self, number: int, model: Array) -> float:
        """Return the same of one trial, for another model of it (r, o); very large: no posture."""
        everything = np.concatenate(list(self.models))
        share = relative_error([model], [self.measured[number]], self.columns, False, beside=everything)
        return share if np.isfinite(share) else NO_EQUILIBRIUM_ERROR

    @cached_property
    def motions(self) -> Array:
        """How far the model moves in each trial, root mean square over noise, shape (t,)."""
        noise = np.array([self.noise_of(column) for column in self.moves])
        return np.array(
            [
                float(np.sqrt(np.mean((np.std(model[:, list(self.moves)], axis=0) / noise) ** 2)))
                if self.moves
                else 0.0
                for model in self.models
            ]
        )

    def noise_of(self, column: int) -> float:
        """Return the noise of an output."""
        return max(self.noise.get(unit_of(self.columns[column]), 0.0), 1e-9)
