"""Where causes of error may act on a catheter, and what is large for it."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

from catheter_sim.core.bends import DAMPING, curvature_handle, tip_forces
from catheter_sim.core.effect import Handle, Mover, Role, Sizes, sizes_of_softest
from catheter_sim.kinds.catheter.layout import (
    bent_by,
    beside_springs,
    carries_load,
    closing_angle_rad,
    is_extensible,
    joint_stiffness,
    moved_segment,
)
from catheter_sim.kinds.catheter.spec import CatheterRobot, CatheterSegment

_MOST_REST_DEG = 30.0
_REST_SCALE_DEG = 1.0  # as 0.02 over a length is for a curvature

Joints = tuple[tuple[str, str], ...]  # a pair's name, and its segment's


def handles(robot: CatheterRobot) -> tuple[Handle, ...]:
    """Return the places at which causes may act.

    Its joints' angles follow its tendons' lengths, so that an elastic law does nothing else than its scale;
    its statics carry a mount that gives way beside springs alone, and a load on the tip beside springs that
    may rub, but beside no law that was measured, and a search with it would take a quarter of an hour; and
    inextensible tendons move their joints whether they rub
    or not.
    """
    bending = bent_by(robot)
    tubes = tuple((item.name, item.stroke_m) for item in robot.segments if item.joint == "prismatic")
    return _handles(
        tuple((pair.name, bending[pair.name].name if pair.name in bending else "") for pair in robot.tendons),
        tubes,
        any(is_extensible(pair) for pair in robot.tendons if pair.name in bending),
        bool(bending) and not beside_springs(robot),
        carries_load(robot),
        all(_stays_in_plane(item) for item in robot.segments),
    )


@lru_cache(maxsize=64)  # a diagnosis asks for the same few, robot by robot
def _handles(
    pairs: Joints,
    tubes: tuple[tuple[str, float], ...],
    extensible: bool,
    gives_way: bool,
    loaded: bool,
    planar: bool,
) -> tuple[Handle, ...]:
    found = [Handle(Role.ELASTIC_SCALE, "stiffness_scale"), DAMPING]
    if gives_way:
        found.append(Handle(Role.MOUNT, "mount.axial_stiffness_N_per_mm"))
    if loaded:
        found += [replace(item, tried=False) for item in tip_forces([("", 0.0, "x" if planar else "xy")])]
    if extensible:
        found += [Handle(Role.FRICTION, "friction.mu"), Handle(Role.PATH, "path_deg", "path_deg")]
    stroke = max((length for _, length in tubes), default=0.0)
    if stroke:
        found += [
            curvature_handle(f"segments.{name}.tube_{parameter}", parameter, "tube", stroke)
            for parameter in ("curvature_x_per_m", "curvature_y_per_m")
            for name, _ in tubes
        ]
    for pair, segment in pairs:
        key = f"tendons.{pair}"
        found.append(Handle(Role.DRIVE_PLAY, f"{key}.play_mm", f"width_{pair}_mm"))
        if not segment:  # a torsion joint needs no tension
            found.append(Handle(Role.DRIVE_STIFFNESS, f"{key}.stiffness_N_per_mm"))
            continue
        found += [
            Handle(Role.TENDON_STIFFNESS, f"{key}.stiffness_N_per_mm"),
            Handle(Role.SLACK, f"{key}.slack_mm", f"slack_{pair}_mm"),
            Handle(Role.TENDON_LENGTH, f"{key}.length_mm", along={f"{key}.law": "uhmwpe"}),
            Handle(
                Role.REST_BEND,
                f"segments.{segment}.rest_deg",
                f"{segment}_deg",
                "joints",
                _REST_SCALE_DEG,
                -_MOST_REST_DEG,
                _MOST_REST_DEG,
            ),
        ]
    return tuple(found)


def _stays_in_plane(segment: CatheterSegment) -> bool:
    """Return whether a segment leaves the robot in its xz plane, whatever acts within that."""
    if segment.joint == "bending":
        return segment.bends_toward == "x"
    if segment.joint == "prismatic":
        return math.isinf(segment.tube_stiffness_N_m2) and segment.tube_curvature_y_per_m == 0.0
    return segment.joint == "rigid"


def movers(robot: CatheterRobot) -> tuple[Mover, ...]:
    """Return what each channel moves: a joint, either way, called as its pair."""
    joints = [robot.segments[moved_segment(robot, index)].joint for index in range(len(robot.tendons))]
    return tuple(
        Mover(pair.name, pair.name, advances=joint == "prismatic")
        for pair, joint in zip(robot.tendons, joints, strict=True)
    )


def sizes(robot: CatheterRobot) -> Sizes:
    """Return what bends its softest bending joint by a radian; it is made to bend until its gaps close.

    Infinite forces where nothing bends.
    """
    bending = list(bent_by(robot).values())
    return sizes_of_softest(
        float(sum(segment.length_m for segment in robot.segments)),
        min((joint_stiffness(robot, item) * item.length_m for item in bending), default=math.inf),
        max((item.arm_m for item in bending), default=1.0),
        max((closing_angle_rad(item) / item.length_m for item in bending), default=math.inf),
    )
