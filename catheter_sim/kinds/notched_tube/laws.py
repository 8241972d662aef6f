"""Which forces run beside a notched tube's step: its notches' arcs and metal, and friction at their edges."""

from __future__ import annotations

from catheter_sim.core.law import Controls, Law, RobotInModel, StraightControls, TendonPaths
from catheter_sim.kinds.notched_tube.forces.notches import Notches, paths, span_ends
from catheter_sim.kinds.notched_tube.spec import NotchedTubeRobot


def controls(robot: NotchedTubeRobot, place: RobotInModel) -> Controls:
    """Return what stands between inputs and actuators: nothing."""
    return StraightControls(place, span_ends(robot))


def laws(robot: NotchedTubeRobot, place: RobotInModel) -> tuple[Law, ...]:
    """Return the laws but friction."""
    return (Notches(robot, place),)


def tendon_paths(robot: NotchedTubeRobot, place: RobotInModel) -> TendonPaths:
    """Return where the tendon rubs."""
    return paths(robot, place)


def sliding_joints(robot: NotchedTubeRobot) -> list[str]:
    """Return the joints that must stand still besides the hinges: none."""
    return []
