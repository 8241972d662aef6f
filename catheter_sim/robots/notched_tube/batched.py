"""The laws of many copies of a notched tube."""

from __future__ import annotations

from catheter_sim.core.law import (
    CopiesControls,
    CopiesLaw,
    CopyArrays,
    RobotInModel,
    StraightControls,
    StraightCopies,
)
from catheter_sim.robots.notched_tube.laws import NotchCopies, Notches, span_ends
from catheter_sim.robots.notched_tube.spec import NotchedTubeRobot


def covers(robot: NotchedTubeRobot) -> bool:
    """Return whether all laws but friction are known for copies: always."""
    return True


def rubs(robot: NotchedTubeRobot) -> bool:
    """Return whether friction is known for copies: always."""
    return True


def laws(robot: NotchedTubeRobot, place: RobotInModel, arrays: CopyArrays) -> tuple[CopiesLaw, ...]:
    """Return the laws but friction."""
    (pulling,) = StraightControls(place, span_ends(robot)).pulls
    drive = -float(place.model.actuator_biasprm[pulling, 1])
    return (NotchCopies(Notches(robot, place), arrays, drive),)


def controls(robot: NotchedTubeRobot, place: RobotInModel, arrays: CopyArrays) -> CopiesControls:
    """Return what stands between inputs and actuators: nothing."""
    return StraightCopies(arrays)
