"""What a catheter brings to the delivery of an implant: the clip that its last module holds."""

from __future__ import annotations

from catheter_sim.robots.catheter.picture import IMPLANT_M, holder_length_m
from catheter_sim.robots.catheter.spec import CatheterRobot


def middle_ahead_m(robot: CatheterRobot) -> float:
    """Return how far the clip's middle lies ahead of the robot's tip, along its axis [m]."""
    return holder_length_m(robot) + 0.5 * IMPLANT_M - robot.segments[-1].length_m
