"""Which forces run beside a catheter's step: tubes that bend, joints, pairs and tendons as measured."""

from __future__ import annotations

from catheter_sim.core.law import Law, RobotInModel, TendonPaths
from catheter_sim.kinds.catheter.forces.controls import PairControls
from catheter_sim.kinds.catheter.forces.paths import paths
from catheter_sim.kinds.catheter.forces.resistance import JointResistances, measured_joints
from catheter_sim.kinds.catheter.forces.stretch import StretchLaws, stretches
from catheter_sim.kinds.catheter.forces.torsion import TorsionPairs
from catheter_sim.kinds.catheter.forces.tube import Tubes
from catheter_sim.kinds.catheter.layout import bending_tubes, bent_by
from catheter_sim.kinds.catheter.mjcf.tube import tube_joint_names
from catheter_sim.kinds.catheter.spec import CatheterRobot


def controls(robot: CatheterRobot, place: RobotInModel) -> PairControls:
    """Return what stands between the pairs' displacements and the actuators: plays and antagonists."""
    return PairControls(robot, place)


def laws(robot: CatheterRobot, place: RobotInModel) -> tuple[Law, ...]:
    """Return the laws but friction."""
    result: list[Law] = []
    if bending_tubes(robot):
        result.append(Tubes(robot, place))
    if measured_joints(robot):
        result.append(JointResistances(robot, place))
    result.append(TorsionPairs(robot, place))
    if stretching(robot):
        result.append(StretchLaws(robot, place, PairControls(robot, place)))
    return tuple(result)


def tendon_paths(robot: CatheterRobot, place: RobotInModel) -> TendonPaths:
    """Return where the bending joints' tendons rub."""
    return paths(robot, place)


def sliding_joints(robot: CatheterRobot) -> list[str]:
    """Return the joints that must stand still besides the hinges: what slides, and the bending tubes'."""
    names = [segment.name for segment in robot.segments if segment.joint == "prismatic"]
    return names + [name for segment in bending_tubes(robot) for name in tube_joint_names(segment)]


def stretching(robot: CatheterRobot) -> bool:
    """Return whether tendons of a bending joint follow the measured law."""
    return any(stretches(pair) for pair in robot.tendons if pair.name in bent_by(robot))
