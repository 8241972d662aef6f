"""Robots that hardly move at all: everything in metres where millimetres are meant."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.data.trials import Trial, measured_of
from catheter_sim.diagnosis.report.result import DataFault
from catheter_sim.diagnosis.thresholds import HARDLY_MOVED_SHARE
from catheter_sim.robots import kind_of


def hardly_moved(
    robot: RobotSpec, trials: Sequence[Trial], columns: Sequence[str], models: Sequence[Array]
) -> tuple[DataFault, ...]:
    """Return that no position moves by more than next to nothing, neither as measured nor as computed.

    Inputs and outputs that are both 1000 times too small agree with one another.

    Args:
        robot: as specified.
        trials: all.
        columns: of outputs.
        models: what the calibrated model computes, by trial, shape (r, o).
    """
    length_mm = 1e3 * kind_of(robot).model.length_m(robot)
    places = [index for index, name in enumerate(columns) if name.endswith("_mm")]
    if not places:
        return ()
    measured = _widest([measured_of(trial, columns)[:, places] for trial in trials])
    computed = _widest([values[:, places] for values in models])
    if max(measured, computed) > HARDLY_MOVED_SHARE * length_mm:
        return ()
    return (
        DataFault(
            f"The robot hardly moves: by {measured:.2g} mm as measured and by {computed:.2g} mm as computed, "
            f"of its {length_mm:.4g} mm. Are inputs and outputs in another unit, such as m for mm?"
        ),
    )


def _widest(parts: Sequence[Array]) -> float:
    """Return the largest range of a column within a part, 0 of columns without a value."""
    widest = 0.0
    for values in parts:
        for column in values.T:
            known = column[np.isfinite(column)]
            widest = max(widest, float(np.ptp(known)) if len(known) else 0.0)
    return widest
