"""Is this rolling-joint robot possible? One line says which number is not."""

from __future__ import annotations

import math
import operator
from functools import partial

import numpy as np

from catheter_sim.core.requirements import MAX_LINKS, check_counts, check_name, need, positive
from catheter_sim.core.shared_checks import check_shared
from catheter_sim.errors import InputError, unknown
from catheter_sim.kinds.rolling.drives import ACTUATIONS
from catheter_sim.kinds.rolling.layout import hole_position, last_joint, rolling_joints
from catheter_sim.kinds.rolling.spec import Rod, RollingRobot, RollingSegment

_ON_THE_LINE_M = 1e-6  # nearer to a joint's line a rod has no length between two mouths that do not lie back


def check(robot: RollingRobot, where: str) -> None:
    """Raise `InputError` where a number of `robot` is impossible.

    Args:
        robot: the robot.
        where: what to call it in the message (file or robot id).
    """
    top = f"{where}: "
    if robot.kind != "rolling":
        raise InputError(f"{top}kind = {robot.kind!r}: must be rolling; it cannot be set")
    if robot.actuation not in ACTUATIONS:
        raise unknown("actuation", robot.actuation, ACTUATIONS, where)
    check_counts(robot.segments, (*robot.tendons, *robot.passive_rods), where)
    _check_names(robot, where)
    count = sum(segment.joints for segment in robot.segments)
    if count > MAX_LINKS:
        raise InputError(f"{top}joints = {count} in all: more than {MAX_LINKS}")
    for segment in robot.segments:
        _check_segment(segment, f"{top}segments.{segment.name}.")
    smallest_m = min(segment.outer_radius_m for segment in robot.segments)
    check_shared(robot, where)
    for kind, group in (("tendons", robot.tendons), ("passive_rods", robot.passive_rods)):
        for rod in group:
            _check_rod(rod, robot, f"{top}{kind}.{rod.name}.")
    need(
        robot,
        "clearance_m",
        top,
        lambda gap: 0 <= gap < smallest_m,
        f"must lie in 0 to the smallest outer radius, {smallest_m * 1e3:g} mm",
    )
    for name in ("bending_stiffness_N_m2", "inner_radius_m", "outer_radius_m"):
        need(robot.sleeve, name, f"{top}sleeve.", lambda value: 0 <= value < math.inf, "must not be negative")


def _check_names(robot: RollingRobot, where: str) -> None:
    for kind, names in (
        ("segment", [segment.name for segment in robot.segments]),
        ("rod", [rod.name for rod in (*robot.tendons, *robot.passive_rods)]),
    ):
        for name in names:
            check_name(name, f"{where}: {kind}")
            if names.count(name) > 1:
                raise InputError(f"{where}: {kind} {name!r} stands twice")
    for rod in robot.tendons:
        if rod.channel:
            check_name(rod.channel, f"{where}: tendons.{rod.name}.channel")
    for rod in robot.passive_rods:
        if rod.channel:
            raise InputError(f"{where}: passive_rods.{rod.name}.channel = {rod.channel!r}: nothing pulls it")


def _check_segment(segment: RollingSegment, prefix: str) -> None:
    for name in (
        "length_m",
        "outer_radius_m",
        "mass_kg",
        "larger_radius_m",
        "smaller_radius_m",
        "larger_arm_m",
        "smaller_arm_m",
    ):
        positive(segment, name, prefix)
    positive(segment, "link_modulus_Pa", prefix, finite=False)
    need(segment, "joints", prefix, lambda count: count >= 1, "must be 1 or more")
    length = segment.length_m / segment.joints
    need(
        segment,
        "centre_of_mass_depth_m",
        prefix,
        lambda depth: 0 <= depth <= length,
        f"must lie in 0 to the links' length, {length * 1e3:g} mm",
    )
    for key, choices in (("bending_axes", ("x", "xy")), ("larger_arm_side", ("alternate", "positive"))):
        if getattr(segment, key) not in choices:
            raise unknown(key, getattr(segment, key), choices, prefix.removesuffix("."))
    for name in ("stiffness_cubic_m2", "stiffness_quintic_m4"):
        need(segment, name, prefix, math.isfinite, "must be finite")
    arcs = (
        ("larger_arm_m", segment.larger_radius_m),
        ("smaller_arm_m", segment.smaller_radius_m),
    )
    for name, radius_m in arcs:
        what = f"must be below its arc's radius, {radius_m * 1e3:g} mm"
        need(segment, name, prefix, partial(operator.gt, radius_m), what)
    # A joint must not have closed a gap before any load does.
    closing = min(math.asin(getattr(segment, name) / radius_m) for name, radius_m in arcs)
    limit = closing / length
    for name in ("rest_curvature_x_per_m", "rest_curvature_y_per_m"):
        what = f"would close the joints' gaps, must stay below {limit:g}"
        need(segment, name, prefix, lambda value: abs(value) < limit, what)
    if segment.bending_axes == "x":
        need(
            segment,
            "rest_curvature_y_per_m",
            prefix,
            lambda value: value == 0,
            "must be 0 where bending_axes is x",
        )


def _check_rod(rod: Rod, robot: RollingRobot, prefix: str) -> None:
    names = [segment.name for segment in robot.segments]
    if rod.ends_at not in names:
        raise unknown("segment", rod.ends_at, names, f"{prefix}ends_at")
    if rod.side not in ("+x", "-x", "+y", "-y"):
        raise unknown("side", rod.side, ("+x", "-x", "+y", "-y"), f"{prefix}side")
    positive(rod, "rod_radius_m", prefix)
    need(rod, "bending_stiffness_N_m2", prefix, lambda value: 0 <= value < math.inf, "must not be negative")
    need(rod, "lateral_m", prefix, math.isfinite, "must be finite")
    passed = rolling_joints(robot)[: last_joint(robot, rod)]
    half_m = 0.5 * min(joint.link_length_m for joint in passed)
    need(
        rod,
        "countersink_m",
        prefix,
        lambda depth: 0 <= depth < half_m,
        f"must lie in 0 to half a link's length, {half_m * 1e3:g} mm",
    )
    for joint in passed:
        segment = joint.segment
        place = hole_position(rod, segment)
        distance = float(np.hypot(*place))
        what = f"of segment {segment.name}, {distance * 1e3:g} mm from the axis"
        if distance + rod.rod_radius_m > segment.outer_radius_m:
            raise InputError(f"{prefix}rod_radius_mm = {rod.rod_radius_m * 1e3:g}: leaves the links {what}")
        if distance - rod.rod_radius_m < robot.channel_radius_m:
            raise InputError(
                f"{prefix}rod_radius_mm = {rod.rod_radius_m * 1e3:g}: reaches into the free channel {what}"
            )
        arm = place[joint.axis] - joint.line_m
        if abs(arm) < _ON_THE_LINE_M and rod.countersink_m == 0.0:
            raise InputError(
                f"{prefix}countersink_mm = 0: must be above zero, since the rod crosses the line of joint "
                f"{joint.index} in segment {segment.name}, where the links touch"
            )
        radius = joint.radius_positive_m if arm > 0 else joint.radius_negative_m
        if abs(arm) >= radius:
            raise InputError(
                f"{prefix}side: its hole lies {abs(arm) * 1e3:g} mm from the line of joint {joint.index}, "
                f"off the arc of {radius * 1e3:g} mm in segment {segment.name}"
            )
