"""How a continuum robot is steered in environments, and what its speed test plays."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.core.posture import Array
from catheter_sim.core.quick_model import LARGEST_BEND_RAD, SpeedCase, pulled_in_turn
from catheter_sim.kinds.continuum.arc_model import ArcModel, arc_model
from catheter_sim.kinds.continuum.layout import links
from catheter_sim.kinds.continuum.spec import ContinuumRobot

_BEND_RAD = 1.0  # that the speed test asks of each segment: well away from straight


def quick_model(robot: ContinuumRobot, actuation: str, largest_bend_rad: float | None) -> ArcModel:
    """Return the model of arcs by which an environment steers; see `core.kind.Steering`."""
    return arc_model(robot, actuation, LARGEST_BEND_RAD if largest_bend_rad is None else largest_bend_rad)


def input_range(robot: ContinuumRobot) -> tuple[Array, Array]:
    """Return the least and largest input of each tendon that the simulation takes: any, shape (t,) each."""
    return np.full(len(robot.tendons), -math.inf), np.full(len(robot.tendons), math.inf)


def speed_case(robot: ContinuumRobot, levels: int) -> SpeedCase:
    """Return a cycle to and fro; each tendon's peak bends its last segment by about a radian."""
    return SpeedCase(pulled_in_turn(_peaks(robot), levels), len(links(robot)), rubs=True, follows=True)


def _peaks(robot: ContinuumRobot) -> list[tuple[float, float]]:
    """Return each tendon's tension that bends its last segment by a radian [N], and its side, 1 or -1.

    T r = EI (1 rad) / length.
    """
    segments = {segment.name: segment for segment in robot.segments}
    peaks = []
    for tendon in robot.tendons:
        segment = segments[tendon.ends_at]
        stiffness = segment.bending_stiffness_N_m2 * robot.stiffness_scale
        side = 1.0 if np.cos(tendon.angle_rad) + np.sin(tendon.angle_rad) > 0 else -1.0
        peaks.append((stiffness * _BEND_RAD / segment.length_m / tendon.radius_m, side))
    return peaks
