"""Where causes of error may act on a continuum robot, and what is large for it."""

from __future__ import annotations

import math
from functools import lru_cache

from catheter_sim.core.bends import DAMPING, curvature_handles, tip_forces
from catheter_sim.core.effect import Handle, Mover, Role, Sizes, sizes_of_softest
from catheter_sim.core.remembered import by_identity
from catheter_sim.kinds.continuum.layout import axes_of
from catheter_sim.kinds.continuum.spec import ContinuumRobot, Tendon

Parts = tuple[tuple[str, float, str], ...]  # name, length [m] and bending axes of each segment


def handles(robot: ContinuumRobot) -> tuple[Handle, ...]:
    """Return the places at which causes may act.

    Where a robot bends in any direction its tendons' holes turn; elsewhere whole cells do.
    """
    segments = tuple((item.name, item.length_m, axes_of(item)) for item in robot.segments if axes_of(item))
    if robot.actuation == "tension":  # it arrives whatever the tendon's length
        return _handles(segments, ())
    return (*_handles(segments, tuple(item.name for item in robot.tendons)), *_slack(robot.tendons))


@by_identity(1)
def _slack(tendons: tuple[Tendon, ...]) -> tuple[Handle, ...]:
    """Return the slack of tendons whose channel pulls some of them and lets others out.

    It is one number of all, or one of each such channel. A tendon with its own channel has a zero instead.
    """
    gains: dict[str, list[float]] = {}
    for tendon in tendons:
        gains.setdefault(tendon.channel or tendon.name, []).append(tendon.channel_gain)
    both_ways = [channel for channel, own in gains.items() if min(own) < 0.0 < max(own)]
    names: dict[str, tuple[str, ...]] = dict.fromkeys(both_ways, ("slack_mm",))
    if len(both_ways) > 1:
        names = {channel: ("slack_mm", f"slack_{channel}_mm") for channel in both_ways}
    return tuple(
        Handle(Role.SLACK, f"tendons.{tendon.name}.slack_mm", name, group="each" if k else "all")
        for tendon in tendons
        for k, name in enumerate(names.get(tendon.channel or tendon.name, ()))
    )


@lru_cache(maxsize=64)  # a diagnosis asks for the same few, robot by robot
def _handles(segments: Parts, tendons: tuple[str, ...]) -> tuple[Handle, ...]:
    spatial = all(axes == "xy" for _, _, axes in segments)
    found = [
        Handle(Role.ELASTIC_SCALE, "stiffness_scale"),
        DAMPING,
        Handle(Role.FRICTION, "friction.mu"),
        Handle(Role.MOUNT, "mount.axial_stiffness_N_per_mm"),
    ]
    for name, _, _ in segments:
        found.append(
            Handle(Role.ELASTIC_CONSTANT, f"segments.{name}.bending_stiffness_N_mm2", f"scale_{name}")
        )
        found.append(Handle(Role.CUBIC, f"segments.{name}.stiffness_cubic_mm2"))
        found.append(Handle(Role.QUINTIC, f"segments.{name}.stiffness_quintic_mm4"))
        if spatial:
            found.append(Handle(Role.HOLE_TWIST, f"segments.{name}.rest_twist_deg_per_m"))
    if not spatial:
        found.append(Handle(Role.ELEMENT_TURN, ""))
    for name in tendons:
        found.append(Handle(Role.TENDON_STIFFNESS, f"tendons.{name}.stiffness_N_per_mm"))
    return (*found, *curvature_handles(segments), *tip_forces(segments))


def movers(robot: ContinuumRobot) -> tuple[Mover, ...]:
    """Return what each channel moves: the section at which its tendons end, toward their side."""
    return _movers(robot.tendons)


@by_identity(1)
def _movers(tendons: tuple[Tendon, ...]) -> tuple[Mover, ...]:
    sides: dict[str, tuple[float, float]] = {}
    parts: dict[str, str] = {}
    for tendon in tendons:
        channel = tendon.channel or tendon.name
        x, y = sides.get(channel, (0.0, 0.0))
        gain = tendon.channel_gain
        sides[channel] = x + gain * math.cos(tendon.angle_rad), y + gain * math.sin(tendon.angle_rad)
        parts[channel] = tendon.ends_at
    return tuple(Mover(channel, parts[channel], side) for channel, side in sides.items())


def sizes(robot: ContinuumRobot) -> Sizes:
    """Return what bends `robot` by a radian; it is made for a radian over its shortest segment."""
    arm_m = max((tendon.radius_m for tendon in robot.tendons), default=robot.segments[0].outer_radius_m)
    stiffness = robot.stiffness_scale * min(
        segment.bending_stiffness_N_m2 for segment in robot.segments if axes_of(segment)
    )
    length_m = float(sum(segment.length_m for segment in robot.segments))
    return sizes_of_softest(
        length_m, stiffness, arm_m, 1.0 / min(segment.length_m for segment in robot.segments)
    )
