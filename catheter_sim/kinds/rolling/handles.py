"""Where causes of error may act on a robot of rolling joints, and what is large for it."""

from __future__ import annotations

import math
from functools import lru_cache

from catheter_sim.core.bends import DAMPING, curvature_handles, tip_forces
from catheter_sim.core.effect import Handle, Mover, Role, Sizes, sizes_of_softest
from catheter_sim.kinds.rolling.spec import RollingRobot
from catheter_sim.kinds.rolling.theory.chain import rolling_chain

Parts = tuple[tuple[str, float, str], ...]  # name, length [m] and bending axes of each segment
_SIDE_RAD = {"+x": 0.0, "+y": math.pi / 2.0, "-x": math.pi, "-y": -math.pi / 2.0}


def handles(robot: RollingRobot) -> tuple[Handle, ...]:
    """Return the places at which causes may act; its holes are in its links, and turn with these."""
    segments = tuple((item.name, item.length_m, item.bending_axes) for item in robot.segments)
    rods = tuple(f"tendons.{item.name}" for item in robot.tendons)
    return _handles(segments, (*rods, *(f"passive_rods.{item.name}" for item in robot.passive_rods)))


@lru_cache(maxsize=64)  # a diagnosis asks for the same few, robot by robot
def _handles(segments: Parts, rods: tuple[str, ...]) -> tuple[Handle, ...]:
    found = [
        Handle(Role.ELASTIC_SCALE, "stiffness_scale"),
        DAMPING,
        Handle(Role.FRICTION, "friction.mu"),
        Handle(Role.MOUNT, "mount.axial_stiffness_N_per_mm"),
    ]
    found.append(Handle(Role.ELEMENT_TURN, ""))
    for key in (*rods, "sleeve"):
        found.append(Handle(Role.ELASTIC_CONSTANT, f"{key}.bending_stiffness_N_mm2"))
    for name, _, _ in segments:
        found.append(Handle(Role.CUBIC, f"segments.{name}.stiffness_cubic_mm2"))
        found.append(Handle(Role.QUINTIC, f"segments.{name}.stiffness_quintic_mm4"))
    return (*found, *curvature_handles(segments), *tip_forces(segments))


def movers(robot: RollingRobot) -> tuple[Mover, ...]:
    """Return what each channel moves: the section at which its rods end, toward their side."""
    sides: dict[str, tuple[float, float]] = {}
    parts: dict[str, str] = {}
    for rod in robot.tendons:
        channel, angle = rod.channel or rod.name, _SIDE_RAD[rod.side]
        x, y = sides.get(channel, (0.0, 0.0))
        sides[channel] = x + math.cos(angle), y + math.sin(angle)
        parts[channel] = rod.ends_at
    return tuple(Mover(channel, parts[channel], side) for channel, side in sides.items())


def sizes(robot: RollingRobot) -> Sizes:
    """Return what bends `robot` by a radian; it is made to bend halfway to a closed gap."""
    chain = rolling_chain(robot)
    return sizes_of_softest(
        float(sum(segment.length_m for segment in robot.segments)),
        float((chain.rest_stiffness * chain.link_length).min()),
        max(segment.larger_arm_m for segment in robot.segments),
        float((0.5 * chain.high / chain.link_length).max()),
    )
