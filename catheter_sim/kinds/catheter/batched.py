"""The laws of many copies of a catheter."""

from __future__ import annotations

from catheter_sim.core.law import RobotInModel
from catheter_sim.core.law_copies import CopiesControls, CopiesLaw, CopyArrays
from catheter_sim.kinds.catheter.forces.controls import PairControls, PairCopies
from catheter_sim.kinds.catheter.forces.resistance import measured_joints
from catheter_sim.kinds.catheter.forces.torsion import TorsionCopies, TorsionPairs
from catheter_sim.kinds.catheter.laws import stretching
from catheter_sim.kinds.catheter.layout import bending_tubes
from catheter_sim.kinds.catheter.spec import CatheterRobot


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
