"""Is this catheter possible? One line says which number is not."""

from __future__ import annotations

import math
from functools import partial

from catheter_sim.core.requirements import MAX_LINKS, check_counts, check_name, need, positive
from catheter_sim.core.shared_checks import check_shared
from catheter_sim.errors import InputError, unknown
from catheter_sim.kinds.catheter.drives import ACTUATIONS
from catheter_sim.kinds.catheter.layout import closing_angle_rad
from catheter_sim.kinds.catheter.spec import (
    RESISTANCES,
    TENDON_LAWS,
    CatheterRobot,
    CatheterSegment,
    TendonPair,
)

# What each kind of joint has besides a length, an outer radius and a mass.
_NUMBERS = {
    "torsion": ("limit_rad", "tendon_radius_m", "wrap_rad", "wrap_height_m"),
    "bending": (
        "limit_rad",
        "rings",
        "half_gap_m",
        "arm_m",
        "rim_radius_m",
        "bending_stiffness_N_m_per_rad",
        "rest_rad",
    ),
    "prismatic": ("stroke_m", "tube_stiffness_N_m2", "tube_curvature_x_per_m", "tube_curvature_y_per_m"),
    "rigid": (),
}
_MAY_BE_ZERO = ("wrap_height_m", "bending_stiffness_N_m_per_rad")
_EITHER_SIDE = ("rest_rad", "tube_curvature_x_per_m", "tube_curvature_y_per_m")
_MAY_BE_INFINITE = ("tube_stiffness_N_m2",)
_ALL = tuple(dict.fromkeys(name for names in _NUMBERS.values() for name in names))


def check(robot: CatheterRobot, where: str) -> None:
    """Raise `InputError` where a number of `robot` is impossible.

    Args:
        robot: the robot.
        where: what to call it in the message (file or robot id).
    """
    top = f"{where}: "
    if robot.kind != "catheter":
        raise InputError(f"{top}kind = {robot.kind!r}: must be catheter; it cannot be set")
    if robot.actuation not in ACTUATIONS:
        raise unknown("actuation", robot.actuation, ACTUATIONS, where)
    check_counts(robot.segments, robot.tendons, where)
    _check_names(robot, where)
    need(robot, "path_rad", top, lambda turn: 0 <= turn < math.inf, "must not be negative")
    for segment in robot.segments:
        _check_segment(segment, f"{top}segments.{segment.name}.")
    rings = sum(segment.rings for segment in robot.segments)
    if rings > MAX_LINKS:
        raise InputError(f"{top}rings = {rings} in all: more than {MAX_LINKS}")
    for pair in robot.tendons:
        _check_pair(pair, robot, f"{top}tendons.{pair.name}.")
    for segment in robot.segments:
        movers = [pair.name for pair in robot.tendons if pair.moves == segment.name]
        wanted = 0 if segment.joint == "rigid" else 1
        if len(movers) != wanted:
            by = ", ".join(movers) or "none"
            raise InputError(f"{top}segments.{segment.name}: moved by {wanted} of the tendons, not by {by}")
    check_shared(robot, where)


def _check_names(robot: CatheterRobot, where: str) -> None:
    for kind, names in (
        ("segment", [segment.name for segment in robot.segments]),
        ("tendon", [pair.name for pair in robot.tendons]),
    ):
        for name in names:
            check_name(name, f"{where}: {kind}")
            if names.count(name) > 1:
                raise InputError(f"{where}: {kind} {name!r} stands twice")


def _check_segment(segment: CatheterSegment, prefix: str) -> None:
    if segment.joint not in _NUMBERS:
        raise unknown("joint", segment.joint, _NUMBERS, prefix.removesuffix("."))
    own = _NUMBERS[segment.joint]
    for name in ("length_m", "outer_radius_m", *own):
        if name not in _MAY_BE_ZERO + _EITHER_SIDE:
            positive(segment, name, prefix, finite=name not in _MAY_BE_INFINITE)
    for name in (name for name in own if name in _EITHER_SIDE):
        need(segment, name, prefix, math.isfinite, "must be finite")
    for name in ("mass_kg", *(name for name in own if name in _MAY_BE_ZERO)):
        need(segment, name, prefix, lambda value: 0 <= value < math.inf, "must not be negative")
    for name in _ALL:
        if name not in own:
            what = f"must be 0 for a {segment.joint} joint"
            need(segment, name, prefix, lambda value: value == 0, what)
    if segment.bends_toward not in ("x", "y"):
        raise unknown("direction", segment.bends_toward, ("x", "y"), f"{prefix}bends_toward")
    choices = RESISTANCES if segment.joint == "bending" else RESISTANCES[:1]
    if segment.resistance not in choices:
        raise unknown("resistance", segment.resistance, choices, prefix.removesuffix("."))
    if segment.joint == "bending":
        _check_bending(segment, prefix)
    if segment.joint == "torsion":
        _check_limit(segment, segment.wrap_rad, "the tendon's wrap", prefix)
        # On the module's surface as printed, where a specimen's may lie a percent further out.
        within = partial(_at_most, 1.02 * segment.outer_radius_m)
        need(segment, "tendon_radius_m", prefix, within, "lies outside the module")


def _check_bending(segment: CatheterSegment, prefix: str) -> None:
    need(segment, "rings", prefix, lambda count: count <= MAX_LINKS, f"more than {MAX_LINKS}")
    gaps_m = 2.0 * segment.half_gap_m * (segment.rings + 1)
    what = f"nothing is left for the rings between gaps of {gaps_m * 1e3:g} mm in all"
    need(segment, "length_m", prefix, lambda length: length > gaps_m, what)
    for name in ("arm_m", "rim_radius_m"):
        need(segment, name, prefix, partial(_at_most, segment.outer_radius_m), "lies outside the rings")
    need(segment, "arm_m", prefix, partial(_at_most, segment.rim_radius_m), "lies outside rim_radius_mm")
    _check_limit(segment, closing_angle_rad(segment), "the bend that closes the gaps", prefix)
    bent = partial(_within, segment.limit_rad)
    need(segment, "rest_rad", prefix, bent, "lies beyond the joint's limit")
    if segment.resistance != RESISTANCES[0]:
        straight = "must be 0: the measured resistance is that of a joint straight at rest"
        need(segment, "rest_rad", prefix, lambda rest: rest == 0, straight)


def _check_limit(segment: CatheterSegment, most_rad: float, what: str, prefix: str) -> None:
    above = f"above {what}, {math.degrees(most_rad):.4g} deg"
    need(segment, "limit_rad", prefix, partial(_at_most, most_rad), above)


def _at_most(most: float, value: float) -> bool:
    return value <= most


def _within(most: float, value: float) -> bool:
    return abs(value) <= most


def _check_pair(pair: TendonPair, robot: CatheterRobot, prefix: str) -> None:
    names = [segment.name for segment in robot.segments]
    if pair.moves not in names:
        raise unknown("segment", pair.moves, names, f"{prefix}moves")
    need(pair, "length_m", prefix, lambda length: 0 <= length < math.inf, "must not be negative")
    positive(pair, "stiffness_N_per_m", prefix, finite=False)
    for name in ("slack_m", "play_m"):
        need(pair, name, prefix, lambda length: 0 <= length < math.inf, "must not be negative")
    bends = robot.segments[names.index(pair.moves)].joint == "bending"
    if not bends:
        need(pair, "slack_m", prefix, lambda length: length == 0, "must be 0: its joint does not bend")
    choices = TENDON_LAWS if bends else TENDON_LAWS[:1]
    if pair.law not in choices:
        raise unknown("law", pair.law, choices, prefix.removesuffix("."))
    if pair.law == "uhmwpe":
        what = "must be above 0: the law needs the tendon's length"
        need(pair, "length_m", prefix, lambda length: length > 0, what)
