"""How a robot of rolling joints is steered in environments, and what its speed test plays."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.quick_model import (
    LARGEST_BEND_RAD,
    InputLimits,
    SpeedCase,
    pulled_in_turn,
    tension_shares,
)
from catheter_sim.kinds.rolling.drives import drives
from catheter_sim.kinds.rolling.rolling_model import RollingModel, rolling_model
from catheter_sim.kinds.rolling.spec import RollingRobot
from catheter_sim.kinds.rolling.theory.chain import rolling_chain
from catheter_sim.kinds.rolling.theory.rods import spans
from catheter_sim.mjcf.tendons import MAX_TENSION_N

_BEND_RAD = 1.0  # that the speed test asks of each segment: well away from straight


def quick_model(robot: RollingRobot, actuation: str, largest_bend_rad: float | None) -> RollingModel:
    """Return the complete statics by which an environment steers; see `core.kind.Steering`."""
    largest = LARGEST_BEND_RAD if largest_bend_rad is None else largest_bend_rad
    return rolling_model(robot, actuation, largest)


def input_range(robot: RollingRobot) -> tuple[Array, Array]:
    """Return the least and largest input of each rod that the simulation takes: any, shape (t,) each."""
    return np.full(len(robot.tendons), -math.inf), np.full(len(robot.tendons), math.inf)


def input_limits(robot: RollingRobot, actuation: str) -> InputLimits:
    """Return the largest tension of each column: joints stiffen until their gaps are closed."""
    share = tension_shares(robot, drives(robot, actuation))
    most = MAX_TENSION_N / share.max(axis=0)
    why = f"the model's actuators pull with {MAX_TENSION_N:g} N at most"
    return InputLimits(np.zeros(len(most)), most, why)


def speed_case(robot: RollingRobot, levels: int) -> SpeedCase:
    """Return a cycle to and fro; each rod's peak bends its last segment by about a radian.

    By MuJoCo alone links do not roll and rods do not resist: the model does not follow the inputs.
    """
    links = sum(segment.joints for segment in robot.segments)
    return SpeedCase(pulled_in_turn(_peaks(robot), levels), links, rubs=True, follows=False)


def _peaks(robot: RollingRobot) -> list[tuple[float, float]]:
    """Return each rod's tension that bends its last segment by a radian [N], and its side, 1 or -1.

    T sum(-dl/dtheta / K) = 1 rad over the segment's joints in the rod's plane, K at rest.
    """
    chain = rolling_chain(robot)
    span = spans(chain, chain.rest_angle)
    per_newton = -span.slope[: chain.pulled] / chain.rest_stiffness
    segment = np.repeat([item.name for item in robot.segments], [item.joints for item in robot.segments])
    peaks = []
    for index, rod in enumerate(robot.tendons):
        own = (segment == rod.ends_at) & (chain.axis == "xy".index(rod.side[1]))
        side = 1.0 if rod.side[0] == "+" else -1.0
        peaks.append((_BEND_RAD / abs(float(per_newton[index, own].sum())), side))
    return peaks
