"""Which forces run beside the step of a robot of rolling joints: rolling, elastic rods, inertia, friction."""

from __future__ import annotations

from catheter_sim.core.law import Controls, Law, RobotInModel, StraightControls, TendonPaths
from catheter_sim.kinds.rolling.forces.contact_motion import ContactMotion
from catheter_sim.kinds.rolling.forces.rods import RodElasticity, paths, span_ends
from catheter_sim.kinds.rolling.forces.rolling import Rolling
from catheter_sim.kinds.rolling.spec import RollingRobot


def controls(robot: RollingRobot, place: RobotInModel) -> Controls:
    """Return what stands between inputs and actuators: nothing."""
    return StraightControls(place, span_ends(robot))


def laws(robot: RollingRobot, place: RobotInModel) -> tuple[Law, ...]:
    """Return the laws but friction."""
    return Rolling(robot, place), RodElasticity(robot, place), ContactMotion(robot, place)


def tendon_paths(robot: RollingRobot, place: RobotInModel) -> TendonPaths:
    """Return where the pulled rods rub."""
    return paths(robot, place)


def sliding_joints(robot: RollingRobot) -> list[str]:
    """Return the joints that must stand still besides the hinges: none."""
    return []
