"""The laws of many copies of a catheter."""

from __future__ import annotations

from catheter_sim.core.law import CopiesControls, CopiesLaw, CopyArrays, RobotInModel
from catheter_sim.robots.catheter.description import bending_tubes
from catheter_sim.robots.catheter.laws import (
    PairControls,
    PairCopies,
    TorsionCopies,
    TorsionPairs,
    measured_joints,
    stretching,
)
from catheter_sim.robots.catheter.spec import CatheterRobot


def covers(robot: CatheterRobot) -> bool:
    """Return whether all laws but friction are known for copies: not measured ones, nor tubes that bend."""
    return not (stretching(robot) or measured_joints(robot) or bending_tubes(robot))


def rubs(robot: CatheterRobot) -> bool:
    """Return whether friction is known for copies: that of pairs is not."""
    return False


def laws(robot: CatheterRobot, place: RobotInModel, arrays: CopyArrays) -> tuple[CopiesLaw, ...]:
    """Return the laws but friction."""
    return (TorsionCopies(TorsionPairs(robot, place), arrays),)


def controls(robot: CatheterRobot, place: RobotInModel, arrays: CopyArrays) -> CopiesControls:
    """Return what stands between the pairs' displacements and the actuators: plays and antagonists."""
    return PairCopies(PairControls(robot, place), arrays)
