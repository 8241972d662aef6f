"""What follows from a rolling-joint robot's data: its layout, whether it is possible, what drives it."""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass, fields, replace
from functools import lru_cache, partial
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
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
from catheter_sim.robots.rolling import joint as geometry
from catheter_sim.robots.rolling.spec import Rod, RollingRobot, RollingSegment

# ----------------------------------------------------------------------------------------------------
# Where everything of a rolling-joint robot lies when it is straight: joints, arcs, rods. Derived.
#
# Joints and links are counted from 1 at the base; link k carries joint k's profile. In a joint's own plane,
# positions are measured along its bending direction (+x or +y) from the robot's axis.

_AXIS_OF_SIDE = {"+x": (0, 1.0), "-x": (0, -1.0), "+y": (1, 1.0), "-y": (1, -1.0)}


@dataclass(frozen=True)
class RollingJoint:
    """One rolling joint.

    Attributes:
        index: 1 at the base.
        segment: the segment of the link whose profile rolls.
        axis: 0: bends toward +x; 1: toward +y.
        radius_positive_m, radius_negative_m: of the arc on which it rolls bending toward + and - [m].
        line_m: position of the joint's line, where the two arcs meet [m].
        link_length_m: from the joint's line at rest to the link's flat top [m].
        face_z_m: height of the link's flat top in the straight robot [m].
    """

    index: int
    segment: RollingSegment
    axis: int
    radius_positive_m: float
    radius_negative_m: float
    line_m: float
    link_length_m: float
    face_z_m: float

    @property
    def name(self) -> str:
        """The joint's name: `x<k>` bends toward +x, `y<k>` toward +y."""
        return f"{'xy'[self.axis]}{self.index}"


def rolling_joints(robot: RollingRobot) -> list[RollingJoint]:
    """Return the robot's joints, base to tip."""
    result: list[RollingJoint] = []
    z = 0.0
    for segment in robot.segments:
        length = segment.length_m / segment.joints
        axes = len(segment.bending_axes)
        for j in range(segment.joints):
            in_plane = j // axes  # how many joints of this segment bend in the same plane before
            positive = segment.larger_arm_side == "positive" or in_plane % 2 == 0
            radii = (segment.larger_radius_m, segment.smaller_radius_m)
            shift = 0.5 * (segment.smaller_arm_m - segment.larger_arm_m)
            result.append(
                RollingJoint(
                    index=len(result) + 1,
                    segment=segment,
                    axis=j % axes,
                    radius_positive_m=radii[0] if positive else radii[1],
                    radius_negative_m=radii[1] if positive else radii[0],
                    line_m=shift if positive else -shift,
                    link_length_m=length,
                    face_z_m=z + (j + 1) * length,
                )
            )
        z += segment.length_m
    return result


def rods(robot: RollingRobot) -> tuple[Rod, ...]:
    """Return every rod, the pulled ones first."""
    return (*robot.tendons, *robot.passive_rods)


def last_joint(robot: RollingRobot, rod: Rod) -> int:
    """Return the number of the last joint that `rod` passes."""
    count = 0
    for segment in robot.segments:
        count += segment.joints
        if segment.name == rod.ends_at:
            break
    return count


def hole_position(rod: Rod, segment: RollingSegment) -> Array:
    """Return x and y of a rod's holes in the links of a segment, shape (2,) [m]."""
    axis, sign = _AXIS_OF_SIDE[rod.side]
    position = np.full(2, rod.lateral_m)
    position[axis] = sign * 0.5 * (segment.larger_arm_m + segment.smaller_arm_m)
    return position


def side_of(rod: Rod) -> tuple[float, float]:
    """Return the unit vector from the axis toward a rod's holes, which it bends the robot to."""
    axis, sign = _AXIS_OF_SIDE[rod.side]
    return (sign, 0.0) if axis == 0 else (0.0, sign)


def rest_angle(joint: RollingJoint) -> float:
    """Return the joint's angle without load [rad]."""
    segment = joint.segment
    curvature = (segment.rest_curvature_x_per_m, segment.rest_curvature_y_per_m)[joint.axis]
    return curvature * joint.link_length_m


def link_section_m2(robot: RollingRobot, segment: RollingSegment) -> float:
    """Return the area of a link's cross-section that carries compression, the lumen left out [m^2]."""
    return math.pi * (segment.outer_radius_m**2 - robot.channel_radius_m**2)


# ----------------------------------------------------------------------------------------------------
# A rolling-joint robot as the static models read it: arrays over joints and rods, base to tip.
#
# This is the one place where they check what they are asked.

OPEN_SHARE = 1.0 - 1e-6  # of the way to a closed gap, where a rod's stiffness becomes infinite


@dataclass(frozen=True)
class RollingChain:
    """A robot of rolling joints, base to tip: n joints, m rods, the first t of them pulled.

    Attributes:
        robot: the specification that this was read from.
        axis: 0: the joint bends toward +x, 1: toward +y, shape (n,).
        radius_positive, radius_negative: of the arcs, shape (n,) [m].
        line: of the joint, from the robot's axis along its bending direction, shape (n,) [m].
        link_length: shape (n,) [m].
        link_stiffness: axial, E A / L; inf: rigid, shape (n,) [N/m].
        mass: of each link, shape (n,) [kg].
        mass_height: of its centre of mass, on the axis above the joint's line, shape (n,) [m].
        rest_angle: without load, shape (n,) [rad].
        sleeve_stiffness: of the outer tube at the joint, EI / L, shape (n,) [N m/rad].
        cubic, quintic: of the rods' elastic law, shape (n,) [m^2] and [m^4].
        low, high: bend angles that keep every gap open, shape (n,) [rad].
        pulled: number t of pulled rods.
        last: number of the last joint that a rod passes, shape (m,).
        passes: whether a rod passes a joint, shape (m, n).
        position: x and y of a rod's holes, shape (m, n, 2) [m].
        offset: of its holes from the joint's line along the bending direction, shape (m, n) [m].
        mouth: height of its upper mouth above the line, countersink included, shape (m, n) [m].
        side: +1, -1 or 0: its holes lie on the positive or negative side or in the neutral plane.
            Shape (m, n).
        countersink: of its holes, shape (m, n) [m].
        stiffness: EI, `stiffness_scale` included, shape (m,) [N m^2].
        rest_curvature: of a rod in the gap at the rest angle, shape (m, n) [1/m].
        rest_stiffness: of each joint about its rest angle, rods and sleeve, shape (n,) [N m/rad].
        clearance: between rod and hole [m].
        mu: friction coefficient.
    """

    robot: RollingRobot
    axis: np.ndarray
    radius_positive: Array
    radius_negative: Array
    line: Array
    link_length: Array
    link_stiffness: Array
    mass: Array
    mass_height: Array
    rest_angle: Array
    sleeve_stiffness: Array
    cubic: Array
    quintic: Array
    low: Array
    high: Array
    pulled: int
    last: np.ndarray
    passes: np.ndarray
    position: Array
    offset: Array
    mouth: Array
    side: Array
    countersink: Array
    stiffness: Array
    rest_curvature: Array
    rest_stiffness: Array
    clearance: float
    mu: float

    @property
    def joints(self) -> int:
        """Number n of joints."""
        return len(self.axis)


# Fields of a robot that change no array; they are the only ones without a hash.
_NO_ARRAYS = ("effects", "sources")
_READ = tuple(item.name for item in fields(RollingRobot) if item.name not in _NO_ARRAYS)


def rolling_chain(robot: RollingRobot) -> RollingChain:
    """Return `robot` as arrays, which are not to be changed: calls for equal robots share them."""
    return replace(_chain_of(*(getattr(robot, name) for name in _READ)), robot=robot)


@lru_cache(maxsize=64)  # a diagnosis asks for a few dozen robots again and again, trial by trial
def _chain_of(*values: Any) -> RollingChain:
    robot = RollingRobot(**dict(zip(_READ, values, strict=True)))
    joints = rolling_joints(robot)
    every = rods(robot)
    axis = np.array([joint.axis for joint in joints])
    positive = np.array([joint.radius_positive_m for joint in joints])
    negative = np.array([joint.radius_negative_m for joint in joints])
    line = np.array([joint.line_m for joint in joints])
    length = np.array([joint.link_length_m for joint in joints])
    rest = np.array([rest_angle(joint) for joint in joints])
    segments = [joint.segment for joint in joints]
    last = np.array([last_joint(robot, rod) for rod in every])
    passes = np.arange(len(joints))[None, :] < last[:, None]
    holes = np.array([[hole_position(rod, segment) for segment in robot.segments] for rod in every])
    position = np.repeat(holes, [segment.joints for segment in robot.segments], axis=1)
    along = np.take_along_axis(position, axis[None, :, None], axis=2)[:, :, 0]
    offset = along - line
    countersink = np.array([[rod.countersink_m] * len(joints) for rod in every])
    side = np.where(np.abs(along) < 1e-9, 0.0, np.sign(along))
    own_radius = np.where(offset >= 0.0, positive, negative)
    # A rod may end before a segment whose arcs its holes would not fit: there any number will do.
    mouth = np.where(
        passes,
        geometry.mouth_height(np.where(passes, offset, 0.0), own_radius) + countersink,
        length,
    )
    radius = geometry.active_radius(rest, positive, negative)
    at_rest = geometry.span(rest, radius, offset, mouth, countersink)
    rest_curvature, curving = geometry.rod_curvature(rest, at_rest.along, at_rest.along_slope)
    outer = np.array([segment.outer_radius_m for segment in segments])
    scale = robot.stiffness_scale
    stiffness = scale * np.array([rod.bending_stiffness_N_m2 for rod in every])
    sleeve_stiffness = scale * robot.sleeve.bending_stiffness_N_m2 / length
    modulus = np.array([segment.link_modulus_Pa for segment in segments])
    section = np.array([link_section_m2(robot, segment) for segment in segments])
    depth = np.array([segment.centre_of_mass_depth_m for segment in segments])

    def limit(radius: Array, toward: float) -> Array:
        """Return the bend to one side that closes the first gap or rolls off the link's edge."""
        closing = geometry.closing_angle(radius, toward * offset, mouth, countersink)
        edge = np.arcsin(np.minimum((outer - toward * line) / radius, 1.0))
        return np.minimum(np.where(passes, closing, np.inf).min(axis=0), edge) * OPEN_SHARE

    return RollingChain(
        robot=robot,
        axis=axis,
        radius_positive=positive,
        radius_negative=negative,
        line=line,
        link_length=length,
        link_stiffness=modulus * section / length,
        mass=np.array([segment.mass_kg / segment.joints for segment in segments]),
        mass_height=length - depth,
        rest_angle=rest,
        sleeve_stiffness=sleeve_stiffness,
        cubic=np.array([segment.stiffness_cubic_m2 for segment in segments]),
        quintic=np.array([segment.stiffness_quintic_m4 for segment in segments]),
        low=-limit(negative, -1.0),
        high=limit(positive, 1.0),
        pulled=len(robot.tendons),
        last=last,
        passes=passes,
        position=position,
        offset=offset,
        mouth=mouth,
        side=side,
        countersink=countersink,
        stiffness=stiffness,
        rest_curvature=np.where(passes, rest_curvature, 0.0),
        rest_stiffness=(np.where(passes, stiffness[:, None], 0.0) * curving).sum(axis=0) + sleeve_stiffness,
        clearance=robot.clearance_m,
        mu=robot.friction.mu,
    )


# ----------------------------------------------------------------------------------------------------
# What drives a robot of rolling joints, tensions alone, and what it reports.

ACTUATIONS = ("tension",)


def actuations(robot: RollingRobot) -> tuple[str, ...]:
    """Return the kinds of actuator inputs that `robot` takes."""
    return ACTUATIONS


def drives(robot: RollingRobot, actuation: str) -> tuple[Drive, ...]:
    """Return the input columns; the pulled rods of one channel share its column."""
    return _drives(robot.tendons, actuation)


def outputs(robot: RollingRobot) -> Outputs:
    """Return what the output columns are: links, joints, pulled rods."""
    return _outputs(robot.segments, robot.tendons)


@by_identity(1)
def _drives(tendons: tuple[Rod, ...], actuation: str) -> tuple[Drive, ...]:
    return of_tendons(
        tuple((rod.channel or rod.name, rod.ends_at, side_of(rod)) for rod in tendons), actuation
    )


@by_identity(2)
def _outputs(segments: tuple[RollingSegment, ...], tendons: tuple[Rod, ...]) -> Outputs:
    return _outputs_of(
        tuple((item.joints, item.bending_axes) for item in segments), tuple(rod.name for rod in tendons)
    )


@lru_cache(maxsize=64)  # a fit's robots differ in numbers that change nothing here
def _outputs_of(segments: tuple[tuple[int, str], ...], rods: tuple[str, ...]) -> Outputs:
    """Return the outputs of segments of so many joints, whose axes follow each other in turn."""
    axes = [axes[joint % len(axes)] for count, axes in segments for joint in range(count)]
    joints = tuple(f"{axis}{number}" for number, axis in enumerate(axes, 1))
    return Outputs(len(joints), joints, dict(enumerate(rods)))


# ----------------------------------------------------------------------------------------------------
# Is this rolling-joint robot possible? One line says which number is not.

_ON_THE_LINE_M = 1e-6  # nearer to a joint's line a rod has no length between two mouths that do not lie back


def check(robot: RollingRobot, where: str) -> None:
    """Raise `InputError` where a number of `robot` is impossible.

    `where`: what to call it in the message (file or robot id).
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


# ----------------------------------------------------------------------------------------------------
# Where causes of error may act on a robot of rolling joints, and what is large for it.

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
