"""How a catheter is steered in environments, and what its speed test plays."""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.quick_model import InputLimits, SpeedCase
from catheter_sim.kinds.catheter.layout import elements, moved_segment
from catheter_sim.kinds.catheter.rigid_model import CatheterModel, catheter_model
from catheter_sim.kinds.catheter.spec import CatheterRobot
from catheter_sim.kinds.catheter.theory.drive import input_range_m
from catheter_sim.kinds.catheter.theory.tendons import pulled_m

_BEND_RAD = 1.0  # that the speed test asks of each joint


def quick_model(robot: CatheterRobot, actuation: str, largest_bend_rad: float | None) -> CatheterModel:
    """Return the rigid rings and modules by which an environment steers; see `core.kind.Steering`."""
    return catheter_model(robot, largest_bend_rad)


def input_range(robot: CatheterRobot) -> tuple[Array, Array]:
    """Return the least and largest displacement of each pair that the simulation takes, (t,) each [m]."""
    return input_range_m(robot)


def input_limits(robot: CatheterRobot, actuation: str) -> InputLimits:
    """Return what brings each joint to the limit that the robot's file gives it."""
    own = catheter_model(robot, None).drives
    most = np.diag(own.tendon)
    why = "there the joint is at its limit (segments.<name>.limit_deg, or stroke_mm)"
    return InputLimits(own.lowest * most, most, why)


def speed_case(robot: CatheterRobot, levels: int) -> SpeedCase:
    """Return a cycle: pairs turn their joints by a radian to either side, a tube goes out by its stroke."""
    phase = np.linspace(0.0, 2.0 * np.pi, levels, endpoint=False)
    moved = [robot.segments[moved_segment(robot, pair)] for pair in range(len(robot.tendons))]
    out, turn = 0.5 * (1.0 - np.cos(phase)), _BEND_RAD * np.sin(phase)
    inputs = [part.stroke_m * out if part.joint == "prismatic" else pulled_m(part, turn) for part in moved]
    return SpeedCase(np.stack(inputs, axis=1), len(elements(robot)), rubs=False, follows=True)
