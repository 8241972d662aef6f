"""What follows from a continuum robot's data: its layout, whether it is possible, what drives it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from catheter_sim.core.effect import (
    DAMPING,
    Handle,
    Mover,
    Role,
    Sizes,
    curvature_handles,
    sizes_of_softest,
    tip_forces,
)
from catheter_sim.core.inputs import Drive, Outputs, of_tendons
from catheter_sim.core.robot import (
    MAX_LINKS,
    by_identity,
    check_counts,
    check_name,
    check_shared,
    need,
    positive,
)
from catheter_sim.errors import InputError, unknown
from catheter_sim.robots.continuum.spec import ContinuumRobot, Segment, Tendon

# ----------------------------------------------------------------------------------------------------
# Where everything of a robot lies when it is straight: links, disks, holes. Derived from the data.
#
# Links are counted from 1 at the base, disks from 1 (0 is the fixed one at z = 0), holes like disks. The
# hinge of a link stands at its middle, or where `hinge_places` says; a disk at the distal face of every
# `links_per_subsegment`-th link.


@dataclass(frozen=True)
class Link:
    """One rigid link: the far half of its own hinge's length and the near half of the next one's.

    Attributes:
        index: 1 at the base.
        segment: the segment that its hinge belongs to.
        length_m: backbone length that its hinge stands for [m].
        hinge_z_m, face_z_m: height of its hinge and of its distal face in the straight robot [m].
        disk: number of the disk at its distal face, 0 where there is none.
    """

    index: int
    segment: Segment
    length_m: float
    hinge_z_m: float
    face_z_m: float
    disk: int


def disks(robot: ContinuumRobot, segment: Segment) -> int:
    """Return how many subsegments `segment` has (`disks_per_segment` rules where it is set)."""
    return robot.disks_per_segment or segment.disks


def links(robot: ContinuumRobot) -> list[Link]:
    """Return the robot's links, base to tip."""
    result: list[Link] = []
    z, disk = 0.0, 0
    for segment in robot.segments:
        count = disks(robot, segment) * robot.links_per_subsegment
        length = segment.length_m / count
        places = hinge_places(robot, segment)
        for i in range(count):
            carries_disk = (i + 1) % robot.links_per_subsegment == 0
            disk += carries_disk
            start = z + i * length
            hinge_z = start + length / 2.0
            if robot.hinges == "rod" or segment.hinge_share != 0.5:
                within = i % robot.links_per_subsegment
                hinge_z = start + (places[within] * robot.links_per_subsegment - within) * length
            result.append(
                Link(
                    index=len(result) + 1,
                    segment=segment,
                    length_m=length,
                    hinge_z_m=hinge_z,
                    face_z_m=start + length,
                    disk=disk if carries_disk else 0,
                )
            )
        z += segment.length_m
    return result


def per_link(robot: ContinuumRobot, value: Callable[[Segment], float]) -> np.ndarray:
    """Return a number of each link's segment, base to tip, shape (n,)."""
    counts = [disks(robot, segment) * robot.links_per_subsegment for segment in robot.segments]
    return np.repeat([value(segment) for segment in robot.segments], counts)


def link_lengths(robot: ContinuumRobot) -> np.ndarray:
    """Return the backbone length that each link's hinge stands for, base to tip, shape (n,) [m]."""
    return per_link(
        robot, lambda segment: segment.length_m / (disks(robot, segment) * robot.links_per_subsegment)
    )


def axes_of(segment: Segment) -> str:
    """Return the letters of the directions in which a segment bends, "" for none."""
    return "" if segment.bending_axes == "none" else segment.bending_axes


def is_centred(robot: ContinuumRobot) -> bool:
    """Return whether no segment's hinges stand elsewhere than in the middles of its subsegments."""
    return all(segment.hinge_share == 0.5 for segment in robot.segments)


def hinge_places(robot: ContinuumRobot, segment: Segment | None = None) -> list[float]:
    """Return where the hinges of a subsegment are, as shares of its length, rising; default: of the first's.

    Bent by a small t at n hinges of equal turns, a subsegment of length h is shorter between its disks by
    h t^2 / 2 times the variance of the turn along it. At the middles of equal links that is 1/12 (1 + 2/n^2),
    of an arc 1/12. "rod" gives the n hinges equal distances, and leaves 1 / 2(n + 1) at either end: 1/12.
    """
    count = robot.links_per_subsegment
    if count == 1:
        return [(segment or robot.segments[0]).hinge_share]
    if robot.hinges == "even":
        return [(k + 0.5) / count for k in range(count)]
    end = 0.5 / (count + 1)
    return [end + k * (1.0 - 2.0 * end) / (count - 1) for k in range(count)]


@dataclass(frozen=True)
class Piece:
    """What moves as one rigid body: its mass and moments of inertia as of solid cylinders.

    Attributes:
        mass_kg: of it.
        centre_z_m: height of its centre of mass in the straight robot [m].
        transverse_kg_m2, axial_kg_m2: about its centre, across the robot's axis and about it.
    """

    mass_kg: float
    centre_z_m: float
    transverse_kg_m2: float
    axial_kg_m2: float


def pieces(robot: ContinuumRobot) -> list[Piece]:
    """Return what lies below the first hinge (the first piece), and what each link carries.

    With masses "along" the robot a piece reaches from its own hinge to the next one, so that all together
    have the mass, the centre and the second moments of the unbent robot. With "faces" each link carries the
    mass of the length that its hinge stands for, in the middle of its distal face, and nothing is below.
    """
    row = links(robot)
    if robot.masses == "faces":
        return [
            Piece(0.0, 0.0, 0.0, 0.0),
            *(_at(link.segment, link.length_m, link.face_z_m) for link in row),
        ]
    ends = [0.0, *(link.hinge_z_m for link in row), sum(segment.length_m for segment in robot.segments)]
    return [_between(robot, low, high) for low, high in pairwise(ends)]


def _at(segment: Segment, length: float, centre: float) -> Piece:
    """Return a piece of one segment of a length [m], its centre at a height [m]."""
    mass, radius = segment.mass_kg * length / segment.length_m, segment.outer_radius_m
    return Piece(mass, centre, mass * (radius**2 / 4.0 + length**2 / 12.0), mass * radius**2 / 2.0)


def _between(robot: ContinuumRobot, low: float, high: float) -> Piece:
    """Return the piece between two heights [m], which may lie in several segments."""
    parts: list[Piece] = []
    start = 0.0
    for segment in robot.segments:
        bottom, top = max(low, start), min(high, start + segment.length_m)
        if top > bottom:
            parts.append(_at(segment, top - bottom, 0.5 * (top + bottom)))
        start += segment.length_m
    mass = sum(part.mass_kg for part in parts)
    centre = sum(part.mass_kg * part.centre_z_m for part in parts) / mass
    transverse = sum(part.transverse_kg_m2 + part.mass_kg * (part.centre_z_m - centre) ** 2 for part in parts)
    return Piece(mass, centre, transverse, sum(part.axial_kg_m2 for part in parts))


def disk_masses(robot: ContinuumRobot) -> np.ndarray:
    """Return the mass that statics put at each disk, the base's fixed one left out, shape (n,) [kg].

    With "faces" that of the subsegment below it; of masses "along" the robot half of either neighbour's,
    which bends the robot alike to second order in a subsegment's length.
    """
    counts = [disks(robot, segment) for segment in robot.segments]
    each = [segment.mass_kg / count for segment, count in zip(robot.segments, counts, strict=True)]
    return _at_faces(robot, np.repeat(each, counts))


def face_masses(robot: ContinuumRobot) -> np.ndarray:
    """Return the mass that statics put at each link's distal face, as `disk_masses` does, shape (n,) [kg]."""
    per_length = per_link(robot, lambda segment: segment.mass_kg / segment.length_m)
    return _at_faces(robot, per_length * link_lengths(robot))


def _at_faces(robot: ContinuumRobot, own: np.ndarray) -> np.ndarray:
    """Return masses at the distal faces of stretches that have the masses `own`, shape (n,) [kg]."""
    if robot.masses == "faces":
        return own
    return 0.5 * (own + np.append(own[1:], 0.0))


def segment_ends(robot: ContinuumRobot) -> dict[str, int]:
    """Return, by segment name, the number of the disk at its end."""
    ends: dict[str, int] = {}
    count = 0
    for segment in robot.segments:
        count += disks(robot, segment)
        ends[segment.name] = count
    return ends


def last_disk(robot: ContinuumRobot, tendon: Tendon) -> int:
    """Return the number of the disk in which `tendon` is fixed."""
    return segment_ends(robot)[tendon.ends_at]


def disk_heights(robot: ContinuumRobot) -> np.ndarray:
    """Return the heights of the disks in the straight robot, the base's first, shape (n + 1,) [m]."""
    return np.array([0.0, *(link.face_z_m for link in links(robot) if link.disk)])


def hole_angle_rad(robot: ContinuumRobot, tendon: Tendon, height_m: float) -> float:
    """Return the angle of a tendon's hole about +z at a height, with the segments' rest twist [rad]."""
    angle, z = routing(robot, tendon, height_m)[1], 0.0
    for segment in robot.segments:
        angle += segment.rest_twist_rad_per_m * min(max(height_m - z, 0.0), segment.length_m)
        z += segment.length_m
    return angle


def hole_xy_m(robot: ContinuumRobot, tendon: Tendon, height_m: float) -> tuple[float, float]:
    """Return where a tendon's hole is in a disk at a height of the straight robot, in its frame [m]."""
    radius, _ = routing(robot, tendon, height_m)
    angle = hole_angle_rad(robot, tendon, height_m)
    return radius * math.cos(angle), radius * math.sin(angle)


def routing(robot: ContinuumRobot, tendon: Tendon, height_m: float) -> tuple[float, float]:
    """Return a tendon's distance from the backbone [m] and its angle, without rest twist [rad], at a height.

    From the base to where it ends the distance goes from `radius_m` to `end_radius_m`, and the angle by
    `turn_rad`, both evenly.
    """
    along = height_m / _end_m(robot, tendon)
    farther = (tendon.end_radius_m or tendon.radius_m) - tendon.radius_m
    return tendon.radius_m + along * farther, tendon.angle_rad + along * tendon.turn_rad


def _end_m(robot: ContinuumRobot, tendon: Tendon) -> float:
    """Return the height at which a tendon ends in the straight robot [m]."""
    names = [segment.name for segment in robot.segments]
    return sum(segment.length_m for segment in robot.segments[: names.index(tendon.ends_at) + 1])


def winds_or_converges(robot: ContinuumRobot) -> bool:
    """Return whether a tendon's holes are not alike in all disks by its own routing."""
    return any(
        tendon.turn_rad != 0.0 or (tendon.end_radius_m or tendon.radius_m) != tendon.radius_m
        for tendon in robot.tendons
    )


def is_planar(robot: ContinuumRobot) -> bool:
    """Return whether every hinge bends in the xz plane and none twists."""
    return all(
        segment.bending_axes == "x" and not np.isfinite(segment.torsion_stiffness_N_m2)
        for segment in robot.segments
    )


# ----------------------------------------------------------------------------------------------------
# What drives a continuum robot, by tension or by displacement, and what it reports.

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


# ----------------------------------------------------------------------------------------------------
# Is this continuum robot possible? One line says which number is not, before anything is built from it.

_GAINS = (1e-3, 1e3)  # sizes of a tendon's displacement over its channel's
_AXES = ("x", "y", "xy", "none")
_SHARES = (-4.0, 5.0)  # of a subsegment's length: where its hinge may stand
_MAX_HOLES = 10_000  # of all tendons in all links; beyond it the model takes minutes to build


def check(robot: ContinuumRobot, where: str) -> None:
    """Raise `InputError` where a number of `robot` is impossible.

    `where`: what to call it in the message (file or robot id).
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
    need(segment, "plastic_share", prefix, lambda value: 0 <= value < math.inf, "must not be negative")
    positive(segment, "yield_curvature_per_m", prefix)
    if segment.bending_axes in ("x", "y"):
        what = "must be 0 where bending_axes is x or y"
        need(segment, "plastic_share", prefix, lambda value: value == 0, what)
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
    need(tendon, "end_radius_m", prefix, lambda radius: 0 <= radius < math.inf, "must not be negative")
    limit = 4.0 * math.pi
    need(
        tendon, "turn_rad", prefix, lambda turn: abs(turn) <= limit, "more than two turns about the backbone"
    )
    positive(tendon, "stiffness_N_per_m", prefix, finite=False)
    for name in ("pretension_N", "slack_m"):
        need(tendon, name, prefix, lambda value: 0 <= value < math.inf, "must not be negative")
    low, high = _GAINS
    what = f"a size of {low:g} to {high:g} is needed, -1 for a tendon that its channel lets out"
    need(tendon, "channel_gain", prefix, lambda gain: low <= abs(gain) <= high, what)
    channel_m = robot.channel_radius_m
    in_channel = f"the tendon lies in the free channel (radius {channel_m * 1e3:g} mm)"
    need(tendon, "radius_m", prefix, lambda radius: radius > channel_m, in_channel)
    need(tendon, "end_radius_m", prefix, lambda radius: not 0.0 < radius <= channel_m, in_channel)
    start_m = 0.0
    for segment in robot.segments:
        outer_m = segment.outer_radius_m
        widest = max(routing(robot, tendon, z)[0] for z in (start_m, start_m + segment.length_m))
        start_m += segment.length_m
        if widest >= outer_m:
            key = "end_radius_mm" if widest > tendon.radius_m else "radius_mm"
            raise InputError(
                f"{prefix}{key} = {getattr(tendon, key[:-2] + 'm') * 1e3:g}: the tendon lies outside the "
                f"disks of segment {segment.name} (outer radius {outer_m * 1e3:g} mm)"
            )
        if segment.name == tendon.ends_at:
            break


# ----------------------------------------------------------------------------------------------------
# Where causes of error may act on a continuum robot, and what is large for it.

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
            found.append(Handle(Role.PLASTIC_SHARE, f"segments.{name}.plastic_share"))
            found.append(Handle(Role.YIELD_CURVATURE, f"segments.{name}.yield_curvature_per_m"))
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
