"""Is this continuum robot possible? One line says which number is not, before anything is built from it."""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.core.requirements import MAX_LINKS, check_counts, check_name, need, positive
from catheter_sim.core.shared_checks import check_shared
from catheter_sim.errors import InputError, unknown
from catheter_sim.kinds.continuum.drives import ACTUATIONS, actuations
from catheter_sim.kinds.continuum.layout import axes_of, disks, is_centred, links
from catheter_sim.kinds.continuum.spec import ContinuumRobot, Segment, Tendon

_GAINS = (1e-3, 1e3)  # sizes of a tendon's displacement over its channel's
_AXES = ("x", "y", "xy", "none")
_SHARES = (-4.0, 5.0)  # of a subsegment's length: where its hinge may stand
_MAX_HOLES = 10_000  # of all tendons in all links; beyond it the model takes minutes to build


def check(robot: ContinuumRobot, where: str) -> None:
    """Raise `InputError` where a number of `robot` is impossible.

    Args:
        robot: the robot.
        where: what to call it in the message (file or robot id).
    """
    check_counts(robot.segments, robot.tendons, where)
    _check_names(robot, where)
    for segment in robot.segments:
        _check_segment(segment, f"{where}: segments.{segment.name}.")
    names = [segment.name for segment in robot.segments]
    for tendon in robot.tendons:
        if tendon.ends_at not in names:
            raise unknown("segment", tendon.ends_at, names, f"{where}: tendons.{tendon.name}.ends_at")
        _check_tendon(tendon, robot, f"{where}: tendons.{tendon.name}.")
    top = f"{where}: "
    check_shared(robot, where)
    need(robot, "links_per_subsegment", top, lambda count: count >= 1, "must be 1 or more")
    need(robot, "disks_per_segment", top, lambda count: count >= 0, "must not be negative")
    count = sum(disks(robot, segment) for segment in robot.segments) * robot.links_per_subsegment
    if count > MAX_LINKS:
        raise InputError(f"{top}disks times links_per_subsegment = {count}: more than {MAX_LINKS} links")
    _check_row(robot, where)
    holes = count * len(robot.tendons)
    if holes > _MAX_HOLES:
        raise InputError(f"{top}links times tendons = {holes}: more than {_MAX_HOLES} holes")
    for key, value, choices in (
        ("actuation", robot.actuation, ACTUATIONS),
        ("appearance", robot.appearance, ("spacer_disks", "wire_guides")),
        ("hinges", robot.hinges, ("even", "rod")),
        ("masses", robot.masses, ("along", "faces")),
    ):
        if value not in choices:
            raise unknown(key, value, choices, where)
    if robot.actuation not in actuations(robot):
        other = next(tendon for tendon in robot.tendons if tendon.channel_gain != 1.0)
        raise InputError(
            f"{top}tendons.{other.name}.channel_gain = {other.channel_gain:g}: takes displacements, "
            f'not tensions; actuation = "displacement" is needed'
        )


def _check_row(robot: ContinuumRobot, where: str) -> None:
    """Raise `InputError` where nothing bends, or hinges are not one after another."""
    if not any(axes_of(segment) for segment in robot.segments):
        raise InputError(f"{where}: bending_axes is none in every segment: nothing bends")
    if is_centred(robot):
        return
    for key, value in (("links_per_subsegment", 1), ("appearance", "spacer_disks")):
        if getattr(robot, key) != value:
            raise InputError(f"{where}: {key} must be {value} where a hinge_share is not 0.5")
    heights = [link.hinge_z_m for link in links(robot) if axes_of(link.segment)]
    if heights[0] < 0.0 or min(np.diff(heights), default=1.0) <= 0.0:
        raise InputError(f"{where}: hinge_share: hinges must follow one another from base to tip")


def _check_names(robot: ContinuumRobot, where: str) -> None:
    for kind, names in (
        ("segment", [segment.name for segment in robot.segments]),
        ("tendon", [tendon.name for tendon in robot.tendons]),
    ):
        for name in names:
            check_name(name, f"{where}: {kind}")
            if names.count(name) > 1:
                raise InputError(f"{where}: {kind} {name!r} stands twice")
    for tendon in robot.tendons:
        if tendon.channel:
            check_name(tendon.channel, f"{where}: tendons.{tendon.name}.channel")


def _check_segment(segment: Segment, prefix: str) -> None:
    for name in ("length_m", "outer_radius_m", "bending_stiffness_N_m2", "mass_kg"):
        positive(segment, name, prefix)
    for name in ("torsion_stiffness_N_m2", "axial_stiffness_N", "shear_stiffness_N"):
        positive(segment, name, prefix, finite=False)
    need(segment, "disks", prefix, lambda count: count >= 1, "must be 1 or more")
    need(segment, "bending_axes", prefix, lambda axes: axes in _AXES, "must be x, y, xy or none")
    for name in ("stiffness_cubic_m2", "stiffness_quintic_m4"):
        need(segment, name, prefix, math.isfinite, "must be finite")
    limit = 4.0 * math.pi / segment.length_m
    for name in ("rest_curvature_x_per_m", "rest_curvature_y_per_m", "rest_twist_rad_per_m"):
        need(
            segment, name, prefix, lambda value: abs(value) <= limit, "more than two turns along the segment"
        )
    for axis in "xy":
        if axis not in axes_of(segment):
            what = f"must be 0 where bending_axes is {segment.bending_axes}"
            need(segment, f"rest_curvature_{axis}_per_m", prefix, lambda value: value == 0, what)
    _check_hinge(segment, prefix)


def _check_hinge(segment: Segment, prefix: str) -> None:
    low, high = _SHARES
    need(segment, "hinge_share", prefix, lambda at: low <= at <= high, f"must be from {low:g} to {high:g}")
    if segment.rest_twist_rad_per_m:
        what = "must be 0.5 where rest_twist_deg_per_m is not 0"
        need(segment, "hinge_share", prefix, lambda at: at == 0.5, what)


def _check_tendon(tendon: Tendon, robot: ContinuumRobot, prefix: str) -> None:
    positive(tendon, "radius_m", prefix)
    need(tendon, "angle_rad", prefix, math.isfinite, "must be finite")
    positive(tendon, "stiffness_N_per_m", prefix, finite=False)
    for name in ("pretension_N", "slack_m"):
        need(tendon, name, prefix, lambda value: 0 <= value < math.inf, "must not be negative")
    low, high = _GAINS
    what = f"a size of {low:g} to {high:g} is needed, -1 for a tendon that its channel lets out"
    need(tendon, "channel_gain", prefix, lambda gain: low <= abs(gain) <= high, what)
    channel_m = robot.channel_radius_m
    need(
        tendon,
        "radius_m",
        prefix,
        lambda radius: radius > channel_m,
        f"the tendon lies in the free channel (radius {channel_m * 1e3:g} mm)",
    )
    for segment in robot.segments:
        outer_m = segment.outer_radius_m
        if tendon.radius_m >= outer_m:
            raise InputError(
                f"{prefix}radius_mm = {tendon.radius_m * 1e3:g}: the tendon lies outside the disks of "
                f"segment {segment.name} (outer radius {outer_m * 1e3:g} mm)"
            )
        if segment.name == tendon.ends_at:
            break
