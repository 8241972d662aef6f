"""The laws of many copies of a robot of rolling joints."""

from __future__ import annotations

import numpy as np

from catheter_sim.core.law import CopiesControls, CopiesLaw, CopyArrays, RobotInModel, StraightCopies
from catheter_sim.robots.rolling.description import rolling_chain
from catheter_sim.robots.rolling.laws import RodElasticity, Rolling, RollingCopies
from catheter_sim.robots.rolling.spec import RollingRobot


def covers(robot: RollingRobot) -> bool:
    """Return whether all laws but friction are known for copies: not where a link gives way."""
    return not bool(np.isfinite(rolling_chain(robot).link_stiffness).any())


def rubs(robot: RollingRobot) -> bool:
    """Return whether friction is known for copies: always."""
    return True


def laws(robot: RollingRobot, place: RobotInModel, arrays: CopyArrays) -> tuple[CopiesLaw, ...]:
    """Return the laws but friction."""
    return (RollingCopies(Rolling(robot, place), RodElasticity(robot, place), arrays),)


def controls(robot: RollingRobot, place: RobotInModel, arrays: CopyArrays) -> CopiesControls:
    """Return what stands between inputs and actuators: nothing."""
    return StraightCopies(arrays)
