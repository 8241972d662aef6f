"""Inputs beyond what a robot can follow, said before they are simulated: its numbers mean nothing there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from catheter_sim.channels import channel_inputs, drives_of
from catheter_sim.core.inputs import Inputs, row_name
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError
from catheter_sim.robots import face_of
from catheter_sim.units import si_factor

_ROUNDING = 1e-6


def beyond_limits(robot: RobotSpec, inputs: Inputs) -> Iterator[str]:
    """Yield a line for each input column that goes beyond what the robot can follow, with its first such row.

    A robot of which no limit is known gets none.
    """
    driven = replace(robot, actuation=inputs.actuation)
    try:
        limits = face_of(robot, "steering", "limit").input_limits(driven, inputs.actuation)
    except InputError:
        return
    values = channel_inputs(robot, inputs)
    for drive, asked, least, most in zip(
        drives_of(robot, inputs.actuation), values.T, limits.least, limits.most, strict=True
    ):
        rows = np.flatnonzero((asked > most * (1.0 + _ROUNDING)) | (asked < least * (1.0 + _ROUNDING)))
        if not len(rows):
            continue
        row, unit = int(rows[0]), si_factor(drive.column)
        end = most if asked[row] > most else least
        yield (
            f"{row_name(inputs, row)}: {drive.column} = {asked[row] / unit:.4g} is beyond {end / unit:.4g}: "
            f"{limits.why}"
        )
