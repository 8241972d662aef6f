"""The laws of many copies of a continuum robot."""

from __future__ import annotations

from catheter_sim.core.law import CopiesControls, CopiesLaw, CopyArrays, RobotInModel, StraightCopies
from catheter_sim.robots.continuum.laws import ElasticCopies, ElasticRemainder, PlasticCopies, PlasticParts
from catheter_sim.robots.continuum.spec import ContinuumRobot


def covers(robot: ContinuumRobot) -> bool:
    """Return whether all laws but friction are known for copies: always."""
    return True


def rubs(robot: ContinuumRobot) -> bool:
    """Return whether friction is known for copies: always."""
    return True


def laws(robot: ContinuumRobot, place: RobotInModel, arrays: CopyArrays) -> tuple[CopiesLaw, ...]:
    """Return the laws but friction."""
    remainder, plastic = ElasticRemainder(robot, place), PlasticParts(robot, place)
    found: list[CopiesLaw] = [ElasticCopies(remainder, arrays)] if remainder.needed else []
    return (*found, PlasticCopies(plastic, arrays)) if plastic.needed else tuple(found)


def controls(robot: ContinuumRobot, place: RobotInModel, arrays: CopyArrays) -> CopiesControls:
    """Return what stands between inputs and actuators: nothing."""
    return StraightCopies(arrays)
