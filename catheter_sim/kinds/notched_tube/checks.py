"""Is this notched tube possible? One line says which number is not."""

from __future__ import annotations

import math
import operator
from functools import partial

from catheter_sim.core.requirements import MAX_LINKS, check_counts, check_name, need, positive
from catheter_sim.core.shared_checks import check_shared
from catheter_sim.errors import InputError, unknown
from catheter_sim.kinds.notched_tube.drives import ACTUATIONS
from catheter_sim.kinds.notched_tube.spec import NotchedSegment, NotchedTubeRobot, Superelastic, WallTendon


def check(robot: NotchedTubeRobot, where: str) -> None:
    """Raise `InputError` where a number of `robot` is impossible.

    Args:
        robot: the robot.
        where: what to call it in the message (file or robot id).
    """
    top = f"{where}: "
    if robot.kind != "notched_tube":
        raise InputError(f"{top}kind = {robot.kind!r}: must be notched_tube; it cannot be set")
    for key, value, choices in (
        ("actuation", robot.actuation, ACTUATIONS),
        ("bending_axes", robot.bending_axes, ("x", "xy")),
    ):
        if value not in choices:
            raise unknown(key, value, choices, where)
    check_counts(robot.segments, robot.tendons, where)
    if len(robot.tendons) != 1:
        raise InputError(f"{top}{len(robot.tendons)} tendons: a notched tube has one")
    names = [segment.name for segment in robot.segments]
    for name in names:
        check_name(name, f"{top}segment")
        if names.count(name) > 1:
            raise InputError(f"{top}segment {name!r} stands twice")
    for segment in robot.segments:
        _check_segment(segment, f"{top}segments.{segment.name}.")
    count = sum(segment.notches for segment in robot.segments)
    if count > MAX_LINKS:
        raise InputError(f"{top}notches = {count} in all: more than {MAX_LINKS}")
    check_shared(robot, where)
    _check_material(robot.material, f"{top}material.")
    positive(robot, "tip_length_m", top)
    _check_tendon(robot.tendons[0], robot, f"{top}tendons.{robot.tendons[0].name}.")


def _check_segment(segment: NotchedSegment, prefix: str) -> None:
    lengths = ("outer_radius_m", "inner_radius_m", "notch_height_m", "notch_depth_m", "spacing_m", "mass_kg")
    for name in lengths:
        positive(segment, name, prefix)
    need(segment, "notches", prefix, lambda count: count >= 1, "must be 1 or more")
    outer = segment.outer_radius_m
    what = f"must be below the outer radius, {outer * 1e3:g} mm"
    need(segment, "inner_radius_m", prefix, lambda radius: radius < outer, what)
    what = f"must be below the tube's diameter, {2e3 * outer:g} mm"
    need(segment, "notch_depth_m", prefix, lambda depth: depth < 2.0 * outer, what)
    if segment.cut not in ("flat", "radial"):
        raise unknown("cut", segment.cut, ("flat", "radial"), prefix.removesuffix("."))
    for name in ("stiffness_cubic_m2", "stiffness_quintic_m4"):
        need(segment, name, prefix, math.isfinite, "must be finite")
    pitch = segment.notch_height_m + segment.spacing_m
    for name in ("rest_curvature_x_per_m", "rest_curvature_y_per_m", "rest_twist_rad_per_m"):
        what = "more than half a radian a notch"
        need(segment, name, prefix, lambda value: abs(value) * pitch <= 0.5, what)


def _check_material(material: Superelastic, prefix: str) -> None:
    positive(material, "modulus_Pa", prefix)
    for name in ("tension_plateau_Pa", "compression_plateau_Pa"):
        positive(material, name, prefix, finite=False)
    need(material, "plateau_slope", prefix, lambda slope: 0 <= slope <= 1, "must lie in 0 to 1")
    need(material, "poisson_ratio", prefix, lambda ratio: -1 < ratio <= 0.5, "must lie in -1 to 0.5")


def _check_tendon(tendon: WallTendon, robot: NotchedTubeRobot, prefix: str) -> None:
    check_name(tendon.name, f"{prefix.removesuffix('.')}")
    if tendon.channel:
        check_name(tendon.channel, f"{prefix}channel")
    positive(tendon, "radius_m", prefix)
    positive(tendon, "stiffness_N_per_m", prefix, finite=False)
    need(tendon, "pretension_N", prefix, lambda force: 0 <= force < math.inf, "must not be negative")
    for segment in robot.segments:
        what = f"outside the tube of segment {segment.name} (radius {segment.outer_radius_m * 1e3:g} mm)"
        need(tendon, "radius_m", prefix, partial(operator.ge, segment.outer_radius_m), what)
        if tendon.radius_m <= robot.channel_radius_m:
            free = f"the tendon lies in the free channel (radius {robot.channel_radius_m * 1e3:g} mm)"
            raise InputError(f"{prefix}radius_mm = {tendon.radius_m * 1e3:g}: {free}")
