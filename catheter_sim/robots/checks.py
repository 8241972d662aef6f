"""Is this robot possible? One line says which number is not, before anything is built from it."""

from __future__ import annotations

import math
from collections.abc import Callable

from catheter_sim.errors import InputError, unknown
from catheter_sim.robots.specification import ContinuumRobot, Segment, Tendon

_MAX_LINKS = 2000  # beyond it MuJoCo's build takes minutes; no robot of this kind has as many


def check_robot(robot: ContinuumRobot, where: str) -> None:
    """Raise `InputError` where a number of `robot` is impossible.

    Args:
        robot: the robot.
        where: what to call it in the message (file or robot id).
    """

    def need(condition: bool, key: str, value: object, what: str) -> None:
        if not condition:
            raise InputError(f"{where}: {key} = {value}: {what}")

    def positive(value: float, key: str, finite: bool = True) -> None:
        need(value > 0 and (not finite or math.isfinite(value)), key, value, "must be above zero")

    _check_names(robot, where)
    for segment in robot.segments:
        _check_segment(segment, f"segments.{segment.name}", need, positive)
    names = [segment.name for segment in robot.segments]
    for tendon in robot.tendons:
        if tendon.ends_at not in names:
            raise unknown("segment", tendon.ends_at, names, f"{where}: tendons.{tendon.name}.ends_at")
        _check_tendon(tendon, robot, need, positive)
    need(0 <= robot.friction.mu < 10, "friction.mu", robot.friction.mu, "must lie in 0 to 10")
    positive(robot.mount.axial_stiffness_N_per_m, "mount.axial_stiffness_N_per_mm", finite=False)
    positive(robot.stiffness_scale, "stiffness_scale")
    need(
        robot.links_per_subsegment >= 1,
        "links_per_subsegment",
        robot.links_per_subsegment,
        "must be 1 or more",
    )
    need(robot.disks_per_segment >= 0, "disks_per_segment", robot.disks_per_segment, "must not be negative")
    links = sum(disks(robot, segment) for segment in robot.segments) * robot.links_per_subsegment
    need(links <= _MAX_LINKS, "disks times links_per_subsegment", links, f"more than {_MAX_LINKS} links")
    for key in ("timestep_s", "relaxation_time_s", "inertia_time_s"):
        positive(getattr(robot.dynamics, key), f"dynamics.{key}")
    for key, value, choices in (
        ("actuation", robot.actuation, ("tension", "displacement")),
        ("appearance", robot.appearance, ("spacer_disks", "wire_guides")),
    ):
        if value not in choices:
            raise unknown(key, value, choices, where)


def disks(robot: ContinuumRobot, segment: Segment) -> int:
    """Return how many subsegments `segment` has (`disks_per_segment` rules where it is set)."""
    return robot.disks_per_segment or segment.disks


def _check_names(robot: ContinuumRobot, where: str) -> None:
    for kind, names in (
        ("segment", [segment.name for segment in robot.segments]),
        ("tendon", [tendon.name for tendon in robot.tendons]),
    ):
        for name in names:
            if not name or not name.replace("_", "").isalnum():
                raise InputError(f"{where}: {kind} {name!r}: a name needs letters, digits and _ only")
            if names.count(name) > 1:
                raise InputError(f"{where}: {kind} {name!r} stands twice")


def _check_segment(
    segment: Segment, key: str, need: Callable[..., None], positive: Callable[..., None]
) -> None:
    positive(segment.length_m, f"{key}.length_mm")
    positive(segment.outer_radius_m, f"{key}.outer_radius_mm")
    positive(segment.bending_stiffness_N_m2, f"{key}.bending_stiffness_N_mm2")
    positive(segment.torsion_stiffness_N_m2, f"{key}.torsion_stiffness_N_mm2", finite=False)
    positive(segment.mass_kg, f"{key}.mass_g")
    need(segment.disks >= 1, f"{key}.disks", segment.disks, "must be 1 or more")
    need(segment.bending_axes in ("x", "xy"), f"{key}.bending_axes", segment.bending_axes, "must be x or xy")
    for name in ("rest_curvature_x_per_m", "rest_curvature_y_per_m", "rest_twist_rad_per_m"):
        value = getattr(segment, name)
        need(math.isfinite(value), f"{key}.{name}", value, "must be finite")
        limit = 4.0 * math.pi / segment.length_m
        need(abs(value) <= limit, f"{key}.{name}", value, "more than two turns along the segment")


def _check_tendon(
    tendon: Tendon, robot: ContinuumRobot, need: Callable[..., None], positive: Callable[..., None]
) -> None:
    key = f"tendons.{tendon.name}"
    positive(tendon.radius_m, f"{key}.radius_mm")
    need(math.isfinite(tendon.angle_rad), f"{key}.angle_deg", tendon.angle_rad, "must be finite")
    positive(tendon.stiffness_N_per_m, f"{key}.stiffness_N_per_mm", finite=False)
    need(
        0 <= tendon.pretension_N < math.inf,
        f"{key}.pretension_N",
        tendon.pretension_N,
        "must not be negative",
    )
    for segment in robot.segments:
        if tendon.radius_m >= segment.outer_radius_m:
            raise InputError(
                f"{key}.radius_mm = {tendon.radius_m * 1e3:g}: the tendon lies outside the disks of "
                f"segment {segment.name} (outer radius {segment.outer_radius_m * 1e3:g} mm)"
            )
        if segment.name == tendon.ends_at:
            break
