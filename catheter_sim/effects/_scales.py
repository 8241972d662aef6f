"""Sizes that matter for a robot, whatever its kind: what bends it, and how sharply it is made to bend."""

from __future__ import annotations

from functools import singledispatch

from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.rolling import RollingRobot
from catheter_sim.robots.specification import ContinuumRobot
from catheter_sim.statics.rolling.chain import rolling_chain


def length_m(robot: Robot) -> float:
    """Return the length of the straight robot [m]."""
    return float(sum(segment.length_m for segment in robot.segments))


def tip_force_N(robot: Robot) -> float:
    """Return the force across the tip that bends a robot of its softest part by a radian: F L^2 / 2 = EI."""
    return 2.0 * softest_bending_N_m2(robot) / length_m(robot) ** 2


@singledispatch
def softest_bending_N_m2(robot: Robot) -> float:
    """Return the bending stiffness of the softest part, a joint's over its link's length [N m^2]."""
    raise TypeError(f"no sizes for a {type(robot).__name__}")


@softest_bending_N_m2.register
def _(robot: ContinuumRobot) -> float:
    return robot.stiffness_scale * min(segment.bending_stiffness_N_m2 for segment in robot.segments)


@softest_bending_N_m2.register
def _(robot: RollingRobot) -> float:
    chain = rolling_chain(robot)
    return float((chain.rest_stiffness * chain.link_length).min())


def tension_N(robot: Robot) -> float:
    """Return the tension that bends a robot of its softest part by a radian in all: T r L = EI [N]."""
    return softest_bending_N_m2(robot) / (longest_arm_m(robot) * length_m(robot))


@singledispatch
def longest_arm_m(robot: Robot) -> float:
    """Return the largest arm with which a tendon bends the straight robot [m]."""
    raise TypeError(f"no sizes for a {type(robot).__name__}")


@longest_arm_m.register
def _(robot: ContinuumRobot) -> float:
    return max((tendon.radius_m for tendon in robot.tendons), default=robot.segments[0].outer_radius_m)


@longest_arm_m.register
def _(robot: RollingRobot) -> float:
    return max(segment.larger_arm_m for segment in robot.segments)


@singledispatch
def sharpest_curvature_per_m(robot: Robot) -> float:
    """Return the bend per length that such a robot is made for [1/m]."""
    raise TypeError(f"no sizes for a {type(robot).__name__}")


@sharpest_curvature_per_m.register
def _(robot: ContinuumRobot) -> float:
    return 1.0 / min(segment.length_m for segment in robot.segments)  # a radian over a segment


@sharpest_curvature_per_m.register
def _(robot: RollingRobot) -> float:
    chain = rolling_chain(robot)
    return float((0.5 * chain.high / chain.link_length).max())  # halfway to a closed gap
