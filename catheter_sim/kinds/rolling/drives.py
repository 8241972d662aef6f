"""What drives a robot of rolling joints, tensions alone, and what it reports."""

from __future__ import annotations

from functools import lru_cache

from catheter_sim.core.drive import Drive, Outputs, of_tendons
from catheter_sim.core.remembered import by_identity
from catheter_sim.kinds.rolling.layout import side_of
from catheter_sim.kinds.rolling.spec import Rod, RollingRobot, RollingSegment

ACTUATIONS = ("tension",)


def actuations(robot: RollingRobot) -> tuple[str, ...]:
    """Return the kinds of actuator inputs that `robot` takes."""
    return ACTUATIONS


def drives(robot: RollingRobot, actuation: str) -> tuple[Drive, ...]:
    """Return the input columns; the pulled rods of one channel share its column."""
    return _drives(robot.tendons, actuation)


def outputs(robot: RollingRobot) -> Outputs:
    """Return what the output columns are: links, joints, pulled rods."""
    return _outputs(robot.segments, robot.tendons)


@by_identity(1)
def _drives(tendons: tuple[Rod, ...], actuation: str) -> tuple[Drive, ...]:
    return of_tendons(
        tuple((rod.channel or rod.name, rod.ends_at, side_of(rod)) for rod in tendons), actuation
    )


@by_identity(2)
def _outputs(segments: tuple[RollingSegment, ...], tendons: tuple[Rod, ...]) -> Outputs:
    return _outputs_of(
        tuple((item.joints, item.bending_axes) for item in segments), tuple(rod.name for rod in tendons)
    )


@lru_cache(maxsize=64)  # a fit's robots differ in numbers that change nothing here
def _outputs_of(segments: tuple[tuple[int, str], ...], rods: tuple[str, ...]) -> Outputs:
    """Return the outputs of segments of so many joints, whose axes follow each other in turn."""
    axes = [axes[joint % len(axes)] for count, axes in segments for joint in range(count)]
    joints = tuple(f"{axis}{number}" for number, axis in enumerate(axes, 1))
    return Outputs(len(joints), joints, dict(enumerate(rods)))
