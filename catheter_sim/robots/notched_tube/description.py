"""What follows from a notched tube's data: where everything lies, whether it is possible, what drives it."""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass, replace
from functools import lru_cache, partial

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
from catheter_sim.core.robot import MAX_LINKS, check_counts, check_name, check_shared, need, positive
from catheter_sim.errors import InputError, unknown
from catheter_sim.robots.notched_tube.section import closing_angle, section
from catheter_sim.robots.notched_tube.spec import NotchedSegment, NotchedTubeRobot, Superelastic, WallTendon

# ----------------------------------------------------------------------------------------------------
# Where everything of a straight notched tube lies: notches, elements, tendon. Derived.
#
# Element k, from 1 at the base, is notch k and the uncut tube after it. Its distal face is the uncut
# piece's.

HINGES = "xyt"  # a notch's hinges: toward +x, toward +y, about the tube


@dataclass(frozen=True)
class Notch:
    """One notch and the uncut tube after it.

    Attributes:
        index: 1 at the base.
        segment: to which it belongs.
        low_z_m: height of its lower edge in the straight tube [m].
        uncut_m: length of the uncut tube after it [m].
        mass_kg: of both.
    """

    index: int
    segment: NotchedSegment
    low_z_m: float
    uncut_m: float
    mass_kg: float

    @property
    def pitch_m(self) -> float:
        """Length of the element: notch and uncut tube [m]."""
        return self.segment.notch_height_m + self.uncut_m

    @property
    def face_z_m(self) -> float:
        """Height of the element's distal face in the straight tube [m]."""
        return self.low_z_m + self.pitch_m


def notches(robot: NotchedTubeRobot) -> list[Notch]:
    """Return the robot's notches, base to tip."""
    result: list[Notch] = []
    z = 0.0
    last = robot.segments[-1]
    for segment in robot.segments:
        for k in range(segment.notches):
            at_tip = segment is last and k == segment.notches - 1
            uncut = robot.tip_length_m if at_tip else segment.spacing_m
            result.append(Notch(len(result) + 1, segment, z, uncut, segment.mass_kg / segment.notches))
            z = result[-1].face_z_m
    return result


def length_m(robot: NotchedTubeRobot) -> float:
    """Return the straight tube's length from its lowest notch to its tip [m]."""
    return notches(robot)[-1].face_z_m


def joint_names(robot: NotchedTubeRobot) -> list[str]:
    """Return the notches' angles by name: `x<k>` toward +x, `y<k>` toward +y, `t<k>` about the tube."""
    count = sum(segment.notches for segment in robot.segments)
    letters = HINGES if robot.bending_axes == "xy" else HINGES[:1]
    return [f"{letter}{k}" for letter in letters for k in range(1, count + 1)]


def uncut_mass_kg(segment: NotchedSegment, density_kg_per_m3: float, notch_area_m2: float) -> float:
    """Return a segment's mass from its metal's density and the area that a notch leaves [kg]."""
    ring = math.pi * (segment.outer_radius_m**2 - segment.inner_radius_m**2)
    volume = notch_area_m2 * segment.notch_height_m + ring * segment.spacing_m
    return density_kg_per_m3 * volume * segment.notches


def rest_angles(notch: Notch) -> tuple[float, float, float]:
    """Return the angles of an unloaded notch toward +x, toward +y and about the tube [rad]."""
    segment = notch.segment
    x, y = segment.rest_curvature_x_per_m, segment.rest_curvature_y_per_m
    return x * notch.pitch_m, y * notch.pitch_m, segment.rest_twist_rad_per_m * notch.pitch_m


# ----------------------------------------------------------------------------------------------------
# How much of its tendon a notched tube can take in: until all notches are closed.


def span(notch: Notch, tendon_radius_m: float, bend_rad: float) -> float:
    """Return the tendon's straight way between the edges of a notch that is bent toward +x [m].

    The strip's neutral plane is an arc of the notch's height; the tendon runs inside of it.
    """
    arm = tendon_radius_m + section(notch.segment).centroid_m
    half = 0.5 * bend_rad
    chord = notch.segment.notch_height_m * (math.sin(half) / half if half else 1.0)
    return chord - 2.0 * arm * math.sin(half)


def closing_displacement(robot: NotchedTubeRobot) -> float:
    """Return by how much the tendon is shorter where all notches are closed [m]; inf: it can stretch."""
    tendon = robot.tendons[0]
    if math.isfinite(tendon.stiffness_N_per_m):
        return math.inf
    total = 0.0
    for notch in notches(robot):
        rest = notch.segment.rest_curvature_x_per_m * notch.pitch_m
        total += span(notch, tendon.radius_m, rest)
        total -= span(notch, tendon.radius_m, closing_angle(notch.segment))
    return total


# ----------------------------------------------------------------------------------------------------
# What drives a notched tube, by its tendon's tension or displacement, and what it reports.

ACTUATIONS = ("tension", "displacement")
# Share of the displacement that closes all notches of a metal that the tendon does not compress: a closed
# tube gives way too little for the rest.
_LARGEST_SHARE = 0.98


def actuations(robot: NotchedTubeRobot) -> tuple[str, ...]:
    """Return the kinds of actuator inputs that `robot` takes."""
    return ACTUATIONS


def drives(robot: NotchedTubeRobot, actuation: str) -> tuple[Drive, ...]:
    """Return the tendon's column under `actuation`; a displacement is at most what its notches can close."""
    tendon = robot.tendons[0]
    (drive,) = of_tendons(((tendon.channel or tendon.name, robot.segments[-1].name, (1.0, 0.0)),), actuation)
    if actuation == "tension":
        return (drive,)
    return (replace(drive, most=largest_displacement_m(robot)),)


def largest_displacement_m(robot: NotchedTubeRobot) -> float:
    """Return the largest displacement that the tendon is asked for [m]; inf where it can stretch."""
    return _LARGEST_SHARE * closing_displacement(robot)


def outputs(robot: NotchedTubeRobot) -> Outputs:
    """Return what the output columns are: an element for each notch, the notches' angles, the tendon."""
    return Outputs(len(notches(robot)), tuple(joint_names(robot)), {0: robot.tendons[0].name})


# ----------------------------------------------------------------------------------------------------
# Is this notched tube possible? One line says which number is not.


def check(robot: NotchedTubeRobot, where: str) -> None:
    """Raise `InputError` where a number of `robot` is impossible.

    `where`: what to call it in the message (file or robot id).
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


# ----------------------------------------------------------------------------------------------------
# Where causes of error may act on a notched tube, and what is large for it.

Parts = tuple[tuple[str, float, str], ...]  # name, length [m] and bending axes of each segment


def handles(robot: NotchedTubeRobot) -> tuple[Handle, ...]:
    """Return the places at which causes may act.

    A tube whose notches bend any way twists; of another each notch may be cut turned against the last.
    """
    lengths = {segment.name: 0.0 for segment in robot.segments}
    for item in notches(robot):
        lengths[item.segment.name] += item.pitch_m
    segments = tuple((name, length, robot.bending_axes) for name, length in lengths.items())
    pulled = robot.actuation == "tension"  # a tension arrives whatever the tendon's length
    return _handles(segments, "" if pulled else robot.tendons[0].name)


@lru_cache(maxsize=64)  # a diagnosis asks for the same few, robot by robot
def _handles(segments: Parts, tendon: str) -> tuple[Handle, ...]:
    found = [
        Handle(Role.ELASTIC_SCALE, "stiffness_scale"),
        DAMPING,
        Handle(Role.FRICTION, "friction.mu"),
        Handle(Role.MOUNT, "mount.axial_stiffness_N_per_mm"),
        Handle(Role.ELASTIC_CONSTANT, "material.modulus_Pa"),
    ]
    for name, _, axes in segments:
        found.append(Handle(Role.CUBIC, f"segments.{name}.stiffness_cubic_mm2"))
        found.append(Handle(Role.QUINTIC, f"segments.{name}.stiffness_quintic_mm4"))
        if axes == "xy":
            found.append(Handle(Role.HOLE_TWIST, f"segments.{name}.rest_twist_deg_per_m"))
    if any(axes != "xy" for _, _, axes in segments):
        found.append(Handle(Role.ELEMENT_TURN, ""))
    if tendon:
        found.append(Handle(Role.TENDON_STIFFNESS, f"tendons.{tendon}.stiffness_N_per_mm"))
    return (*found, *curvature_handles(segments), *tip_forces(segments))


def movers(robot: NotchedTubeRobot) -> tuple[Mover, ...]:
    """Return what the one channel moves: the tube toward its notches, up to the last segment."""
    (tendon,) = robot.tendons
    return (Mover(tendon.channel or tendon.name, robot.segments[-1].name, (1.0, 0.0)),)


def sizes(robot: NotchedTubeRobot) -> Sizes:
    """Return what bends `robot` by a radian, as if its metal were linear; it bends half as far as it can."""
    row = notches(robot)
    modulus = robot.material.modulus_Pa * robot.stiffness_scale
    shapes = [section(item.segment) for item in row]
    stiffness = [
        modulus * shape.second_moment_m4 / item.segment.notch_height_m * item.pitch_m
        for item, shape in zip(row, shapes, strict=True)
    ]
    return sizes_of_softest(
        length_m(robot),
        min(stiffness),
        robot.tendons[0].radius_m + max(shape.centroid_m for shape in shapes),
        max(0.5 * closing_angle(item.segment) / item.pitch_m for item in row),
    )
