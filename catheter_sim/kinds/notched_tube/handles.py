"""Where causes of error may act on a notched tube, and what is large for it."""

from __future__ import annotations

from functools import lru_cache

from catheter_sim.core.bends import DAMPING, curvature_handles, tip_forces
from catheter_sim.core.effect import Handle, Mover, Role, Sizes, sizes_of_softest
from catheter_sim.kinds.notched_tube.layout import length_m, notches
from catheter_sim.kinds.notched_tube.spec import NotchedTubeRobot
from catheter_sim.kinds.notched_tube.theory.section import closing_angle, section

Parts = tuple[tuple[str, float, str], ...]  # name, length [m] and bending axes of each segment


def handles(robot: NotchedTubeRobot) -> tuple[Handle, ...]:
    """Return the places at which causes may act.

    A tube whose notches bend any way twists; of another each notch may be cut turned against the last.
    """
    lengths = {segment.name: 0.0 for segment in robot.segments}
    for item in notches(robot):
        lengths[item.segment.name] += item.pitch_m
    segments = tuple((name, length, robot.bending_axes) for name, length in lengths.items())
    pulled = robot.actuation == "tension"  # a tension arrives whatever the tendon's length
    return _handles(segments, "" if pulled else robot.tendons[0].name)


@lru_cache(maxsize=64)  # a diagnosis asks for the same few, robot by robot
def _handles(segments: Parts, tendon: str) -> tuple[Handle, ...]:
    found = [
        Handle(Role.ELASTIC_SCALE, "stiffness_scale"),
        DAMPING,
        Handle(Role.FRICTION, "friction.mu"),
        Handle(Role.MOUNT, "mount.axial_stiffness_N_per_mm"),
        Handle(Role.ELASTIC_CONSTANT, "material.modulus_Pa"),
    ]
    for name, _, axes in segments:
        found.append(Handle(Role.CUBIC, f"segments.{name}.stiffness_cubic_mm2"))
        found.append(Handle(Role.QUINTIC, f"segments.{name}.stiffness_quintic_mm4"))
        if axes == "xy":
            found.append(Handle(Role.HOLE_TWIST, f"segments.{name}.rest_twist_deg_per_m"))
    if any(axes != "xy" for _, _, axes in segments):
        found.append(Handle(Role.ELEMENT_TURN, ""))
    if tendon:
        found.append(Handle(Role.TENDON_STIFFNESS, f"tendons.{tendon}.stiffness_N_per_mm"))
    return (*found, *curvature_handles(segments), *tip_forces(segments))


def movers(robot: NotchedTubeRobot) -> tuple[Mover, ...]:
    """Return what the one channel moves: the tube toward its notches, up to the last segment."""
    (tendon,) = robot.tendons
    return (Mover(tendon.channel or tendon.name, robot.segments[-1].name, (1.0, 0.0)),)


def sizes(robot: NotchedTubeRobot) -> Sizes:
    """Return what bends `robot` by a radian, as if its metal were linear; it bends half as far as it can."""
    row = notches(robot)
    modulus = robot.material.modulus_Pa * robot.stiffness_scale
    shapes = [section(item.segment) for item in row]
    stiffness = [
        modulus * shape.second_moment_m4 / item.segment.notch_height_m * item.pitch_m
        for item, shape in zip(row, shapes, strict=True)
    ]
    return sizes_of_softest(
        length_m(robot),
        min(stiffness),
        robot.tendons[0].radius_m + max(shape.centroid_m for shape in shapes),
        max(0.5 * closing_angle(item.segment) / item.pitch_m for item in row),
    )
