"""Which forces run beside a continuum robot's step: the elastic law beyond its hinges' own, and friction."""

from __future__ import annotations

from catheter_sim.core.law import Controls, FrictionLaw, Law, RobotInModel, StraightControls, TendonPaths
from catheter_sim.kinds.continuum.forces.elastic_law import ElasticRemainder
from catheter_sim.kinds.continuum.forces.nested_friction import NestedFriction
from catheter_sim.kinds.continuum.forces.paths import paths, span_ends
from catheter_sim.kinds.continuum.spec import ContinuumRobot


def controls(robot: ContinuumRobot, place: RobotInModel) -> Controls:
    """Return what stands between inputs and actuators: nothing."""
    return StraightControls(place, span_ends(robot))


def laws(robot: ContinuumRobot, place: RobotInModel) -> tuple[Law, ...]:
    """Return the laws but friction: none where the hinges hold the whole elastic law."""
    remainder = ElasticRemainder(robot, place)
    return (remainder,) if remainder.needed else ()


def tendon_paths(robot: ContinuumRobot, place: RobotInModel) -> TendonPaths:
    """Return where the tendons rub: at the holes of the disks."""
    return paths(robot, place)


def sliding_joints(robot: ContinuumRobot) -> list[str]:
    """Return the joints that must stand still besides the hinges: none."""
    return []


def reference_friction(robot: ContinuumRobot, place: RobotInModel) -> FrictionLaw:
    """Return the reference law of friction; the model needs its tails (`mjcf.friction_tails`)."""
    return NestedFriction(robot, place)
