"""Columns of measured values that are empty, or not in their unit."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.data.trials import Trial
from catheter_sim.diagnosis.thresholds import LONGEST_WAY_LENGTHS, MOST_QUATERNION, MOST_TURN_DEG
from catheter_sim.errors import InputError


def check_outputs(robot: RobotSpec, trials: Iterable[Trial], outputs: Sequence[str], where: str) -> None:
    """Refuse columns that are empty, or whose size shows that they are not in their unit.

    A tracker has an origin of its own, so that a position's range counts, not its value. Whether positions
    are in metres is seen later, beside the robot's motion (`base_frame.register`).
    """
    length_mm = 1e3 * sum(segment.length_m for segment in robot.segments)
    for name in outputs:
        largest, file = -math.inf, ""
        lowest, highest = math.inf, -math.inf
        for trial in trials:
            values = trial.outputs.columns[name]
            if np.isnan(values).all():
                continue
            lowest, highest = min(lowest, float(np.nanmin(values))), max(highest, float(np.nanmax(values)))
            if float(np.nanmax(np.abs(values))) > largest:
                largest, file = float(np.nanmax(np.abs(values))), trial.outputs.where
        if not file:
            raise InputError(f"{where}: channels.outputs: {name} has no value in any trial")
        unit = unit_of(name)
        if unit == "mm" and highest - lowest > LONGEST_WAY_LENGTHS * length_mm:
            raise InputError(
                f"{file}: {name} moves over {highest - lowest:g}, but the robot is {length_mm:g} mm long; "
                "is the column in mm?"
            )
        for its_unit, limit, why in (
            ("deg", MOST_TURN_DEG, "more than two turns"),
            ("1", MOST_QUATERNION, "part of a unit quaternion"),
        ):
            if unit == its_unit and largest > limit:
                raise InputError(f"{file}: {name} reaches {largest:g}, but {why}; is the column in {unit}?")
