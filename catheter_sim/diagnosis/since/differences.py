"""A later recording without what it shares with an earlier one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.base_frame.move import registered
from catheter_sim.diagnosis.base_frame.registration import unmoved
from catheter_sim.diagnosis.data.frozen_readings import without_frozen_readings
from catheter_sim.diagnosis.data.parting import split
from catheter_sim.diagnosis.data.resolution import resolution_of, rounding_of
from catheter_sim.diagnosis.data.trials import Dataset, Trial, measured_of
from catheter_sim.diagnosis.since.baseline import Baseline, by_unit, smooth_errors
from catheter_sim.diagnosis.since.pairing import Pairs, paired
from catheter_sim.diagnosis.since.reachable import untold_share
from catheter_sim.diagnosis.stages.prepare import Prepared, lacking_in
from catheter_sim.diagnosis.thresholds import MODEL_SHARE, NEAR_NOISE
from catheter_sim.tables import Table


@dataclass(frozen=True)
class Differences:
    """A later recording without what both share.

    Attributes:
        prepared: it, as it can be fitted; its robot is the earlier recording's.
        rows: of the later recording, those with a measured value.
        paired_rows: of these, how many pair with rows of the earlier one.
    """

    prepared: Prepared
    rows: int
    paired_rows: int


def differences(dataset: Dataset, base: Baseline) -> Differences:
    """Return a later recording without what it shares with an earlier one.

    From each measured value the error that the earlier recording's model had at the paired rows is taken; at
    rows without a pair, the smooth error that it had in general. What is left can be explained by the earlier
    robot, and by what changed. One recording's scatter stays in it, since no one row tells it from a change.
    """
    rounded = replace(dataset, resolution=resolution_of(dataset))
    readings, frozen = without_frozen_readings(registered(rounded, base.registration))
    moving = readings.motion.moving
    pairs = [paired(trial.inputs, base.inputs, base.errors, moving) for trial in readings.trials]
    smooth = smooth_errors(base, replace(base.problem, trials=_unmeasured(readings), every=1))
    trials = tuple(
        _without(trial, base.columns, np.where(np.isfinite(item.error), item.error, other))
        for trial, item, other in zip(readings.trials, pairs, smooth, strict=True)
    )
    made = replace(
        readings,
        robot=base.robot,
        trials=trials,
        calibration=(),
        repeatability=_repeatability(base, pairs, smooth, readings),
        model_share=MODEL_SHARE if base.misfit > NEAR_NOISE else 0.0,
    )
    train, heldout = split(made)
    if moving and made.model_share:
        change = replace(base.problem, trials=train, every=1)
        made = replace(made, model_share=max(made.model_share, untold_share(change, base.robot)))
    prepared = Prepared(
        made,
        train,
        heldout,
        unmoved(base.registration),
        base.twin,
        (*readings.notes, *base.notes, *frozen),
        lacking=lacking_in(made, train, heldout),
    )
    rows = _measured_rows(readings)
    with_pair = [mine & (item.count > 0) for mine, item in zip(rows, pairs, strict=True)]
    return Differences(prepared, _number(rows), _number(with_pair))


def _number(rows: Sequence[np.ndarray]) -> int:
    return sum(int(mine.sum()) for mine in rows)


def _measured_rows(dataset: Dataset) -> list[np.ndarray]:
    """Return which rows of each trial have a measured value, shape (r,)."""
    columns = dataset.output_channels
    return [np.isfinite(measured_of(trial, columns)).sum(axis=1) > 0 for trial in dataset.trials]


def _repeatability(
    base: Baseline, pairs: Sequence[Pairs], smooth: Sequence[Array], readings: Dataset
) -> dict[str, float]:
    """Return by how much the later recording would differ where nothing changed, by unit.

    Of rows that pair with several, the scatter of these; else what the smooth error leaves of the earlier
    recording, at least its noise. No less than what rounding leaves of both.
    """
    measured = _measured_rows(readings)
    spread = np.concatenate([item.spread for item in pairs])
    scatter = by_unit(base.columns, np.sqrt(spread))
    own = smooth_errors(base, replace(base.problem, trials=_unmeasured_of(base), every=1))
    left = by_unit(
        base.columns, np.concatenate([error - part for error, part in zip(base.errors, own, strict=True)])
    )
    whole = np.concatenate(
        [np.isfinite(item.error[mine]).all(axis=1) for item, mine in zip(pairs, measured, strict=True)]
    )
    found = dict(scatter)
    if not whole.all():
        share = float(whole.mean())
        found = {
            unit: float(np.sqrt(share * scatter.get(unit, 0.0) ** 2 + (1.0 - share) * value**2))
            for unit, value in left.items()
        }
    first, second = (rounding_of(base.columns, resolution_of(item)) for item in (base.dataset, readings))
    return {unit: max(size, float(np.hypot(first[unit], second[unit]))) for unit, size in found.items()}


def _without(trial: Trial, columns: Sequence[str], error: Array) -> Trial:
    values = measured_of(trial, columns) - error
    outputs = {name: values[:, index] for index, name in enumerate(columns)}
    return replace(trial, outputs=replace(trial.outputs, columns=outputs))


def _unmeasured(dataset: Dataset) -> tuple[Trial, ...]:
    """Return trials in which every output has a value, so that every row is predicted."""
    return tuple(_filled(trial, dataset.output_channels) for trial in dataset.trials)


def _unmeasured_of(base: Baseline) -> tuple[Trial, ...]:
    return tuple(_filled(trial, base.columns) for trial in base.problem.trials)


def _filled(trial: Trial, columns: Sequence[str]) -> Trial:
    zeros = {name: np.zeros(len(trial.inputs)) for name in columns}
    return replace(trial, outputs=Table(trial.inputs.time_s, zeros, trial.outputs.where))
