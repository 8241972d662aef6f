"""What drives a continuum robot, by tension or by displacement, and what it reports."""

from __future__ import annotations

import math
from functools import lru_cache

from catheter_sim.core.drive import Drive, Outputs, of_tendons
from catheter_sim.core.remembered import by_identity
from catheter_sim.kinds.continuum.layout import axes_of
from catheter_sim.kinds.continuum.spec import ContinuumRobot, Segment, Tendon

ACTUATIONS = ("tension", "displacement")


def actuations(robot: ContinuumRobot) -> tuple[str, ...]:
    """Return the kinds of actuator inputs that `robot` takes: no tensions where a channel has gains."""
    return ACTUATIONS[1:] if has_gains(robot.tendons) else ACTUATIONS


def has_gains(tendons: tuple[Tendon, ...]) -> bool:
    """Return whether a tendon moves otherwise than its channel: farther, less far, or the other way."""
    return any(tendon.channel_gain != 1.0 for tendon in tendons)


def drives(robot: ContinuumRobot, actuation: str) -> tuple[Drive, ...]:
    """Return the input columns under `actuation`; the tendons of one channel share its column."""
    return _drives(robot.tendons, actuation)


def outputs(robot: ContinuumRobot) -> Outputs:
    """Return what the output columns are: disks, hinges, tendons."""
    return _outputs(robot.segments, robot.tendons, robot.disks_per_segment, robot.links_per_subsegment)


@by_identity(1)
def _drives(tendons: tuple[Tendon, ...], actuation: str) -> tuple[Drive, ...]:
    return of_tendons(
        tuple(
            (
                tendon.channel or tendon.name,
                tendon.ends_at,
                (math.cos(tendon.angle_rad), math.sin(tendon.angle_rad)),
            )
            for tendon in tendons
        ),
        actuation,
        tuple(tendon.channel_gain for tendon in tendons) if has_gains(tendons) else (),
    )


@by_identity(2)
def _outputs(
    segments: tuple[Segment, ...], tendons: tuple[Tendon, ...], disks_per_segment: int, links: int
) -> Outputs:
    return _outputs_of(
        tuple(
            (
                disks_per_segment or item.disks,
                axes_of(item),
                math.isfinite(item.torsion_stiffness_N_m2),
            )
            for item in segments
        ),
        links,
        tuple(tendon.name for tendon in tendons),
    )


@lru_cache(maxsize=64)  # a fit's robots differ in numbers that change nothing here
def _outputs_of(segments: tuple[tuple[int, str, bool], ...], links: int, tendons: tuple[str, ...]) -> Outputs:
    """Return the outputs of segments of given disks and axes, some of which twist.

    Joints: `x<k>` bends toward +x, `y<k>` toward +y, `t<k>` twists; k is the link's number from 1.
    """
    joints: list[str] = []
    link = 0
    for count, axes, twists in segments:
        for _ in range(count * links):
            link += 1
            joints += [f"{letter}{link}" for letter in axes]
            joints += [f"t{link}"] * twists
    return Outputs(sum(count for count, _, _ in segments), tuple(joints), dict(enumerate(tendons)))
