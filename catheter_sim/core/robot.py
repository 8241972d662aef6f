"""What every robot is, of whatever kind: frozen data in SI units, and what is checked of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import wraps
from numbers import Integral, Real
from typing import Any, TypeVar, cast

import numpy as np

from catheter_sim.errors import InputError, shown
from catheter_sim.units import file_name

# ----------------------------------------------------------------------------------------------------
# How a check says which value is impossible: of a robot, its key and value as files have them.
#
# Arguments in Python go through `number_of`, `whole_of` and `flag_of`: NumPy's scalars are taken as
# Python's are, and a boolean is no number.

MAX_LINKS = 400  # in a row: MuJoCo reads files nested 500 deep at most
MAX_TENDONS = 100
_SMALLEST, _LARGEST = 1e-18, 1e18  # in SI units, of what must be above zero
_LONGEST_NAME = 60  # characters; names stand in columns


def need(holder: Any, name: str, prefix: str, holds: Callable[[Any], bool], what: str) -> None:
    """Raise `InputError`, with the key and value as files have them, unless `holds` of the field."""
    value = getattr(holder, name)
    if not holds(value):
        key, factor = file_name(name)
        text = f"{value * factor:g}" if isinstance(value, int | float) else shown(value)
        raise InputError(f"{prefix}{key} = {text}: {what}")


def positive(holder: Any, name: str, prefix: str, finite: bool = True) -> None:
    """Raise `InputError` unless the field is above zero, and finite where that is asked.

    A finite number whose square or fourth power would be no number any more is refused as well.
    """
    what = "must be above zero and finite" if finite else "must be above zero"
    need(holder, name, prefix, lambda value: value > 0 and (not finite or math.isfinite(value)), what)
    what = "too small or too large to compute with"
    need(holder, name, prefix, lambda value: math.isinf(value) or _SMALLEST <= value <= _LARGEST, what)


def number_of(
    value: Any, where: str, needed: str = "a finite number", holds: Callable[[float], bool] = math.isfinite
) -> float:
    """Return an argument as a number.

    `needed` says what would be right, with its article; `holds`, whether a number is.

    Raises:
        InputError: it is no number, or `holds` is false of it.
    """
    number = as_number(value)
    if number is not None and holds(number):
        return number
    raise InputError(f"{where} = {shown(value)}: {needed} is needed")


def as_number(value: Any) -> float | None:
    """Return a number of Python's or of NumPy's as a float; None: it is none, or a boolean."""
    item = _scalar(value)
    if isinstance(item, bool) or not isinstance(item, Real):
        return None
    try:
        return float(item)
    except OverflowError:
        return math.copysign(math.inf, item)


def whole_of(value: Any, where: str, needed: str, least: int, most: float = math.inf) -> int:
    """Return an argument as a whole number of `least` to `most`; the others as of `number_of`.

    Raises:
        InputError: it is none.
    """
    item = _scalar(value)
    if isinstance(item, Integral) and not isinstance(item, bool) and least <= int(item) <= most:
        return int(item)
    raise InputError(f"{where} = {shown(value)}: {needed} is needed")


def flag_of(value: Any, where: str) -> bool:
    """Return an argument as True or False; 1 and 0 are taken for them.

    Raises:
        InputError: it is none of these.
    """
    item = _scalar(value)
    if isinstance(item, Integral) and item in (0, 1):
        return bool(item)
    raise InputError(f"{where} = {shown(value)}: True or False is needed")


def _scalar(value: Any) -> Any:
    """Return one number or boolean of NumPy's as Python's; what is none stays what it is."""
    one = isinstance(value, np.generic | np.ndarray) and value.ndim == 0
    return value.item() if one else value


def check_name(name: str, what: str) -> None:
    """Raise `InputError` unless `name` can stand in a column and a dotted key."""
    if not name or not name.replace("_", "").isalnum():
        raise InputError(f"{what} {shown(name)}: a name needs letters, digits and _ only")
    if len(name) > _LONGEST_NAME:
        raise InputError(f"{what} {shown(name)}: a name has at most {_LONGEST_NAME} characters")


def check_counts(segments: Sequence[Any], tendons: Sequence[Any], where: str) -> None:
    """Raise `InputError` where a robot has more segments or tendons than can be built in seconds."""
    for what, found, most in (("segments", segments, MAX_LINKS), ("tendons", tendons, MAX_TENDONS)):
        if len(found) > most:
            raise InputError(f"{where}: {len(found)} {what}: more than {most}")


# ----------------------------------------------------------------------------------------------------
# What every robot is, of whatever kind: a value of frozen data, SI units, no behaviour.
#
# A kind adds its own numbers (`robots/<kind>/spec.py`). Statics, MJCF and effects read the same value, so
# that they cannot disagree about a number. The unit stands at the end of each field's name; where a number
# comes from stands in `RobotSpec.sources` under the field's dotted file name (`segments.distal.length_mm`).

DAMPING_TIME_S = 0.005  # assumed where no damping is published: that of a polymer, 3 to 5 ms
DYNAMICS_ASSUMED = "assumed: held rows come to rest without overshoot; in motion damped as a polymer"


@dataclass(frozen=True)
class Friction:
    """Dry friction of the tendons or rods at every hole, the base's included."""

    mu: float  # capstan (Coulomb) coefficient


@dataclass(frozen=True)
class Mount:
    """What holds the base. `axial_stiffness_N_per_m` = inf is a rigid mount."""

    axial_stiffness_N_per_m: float = math.inf


@dataclass(frozen=True)
class Dynamics:
    """What sets the motion between two equilibria, but no equilibrium.

    Aids for coming to rest, which act only where rows are held. A hinge of stiffness K gets the damping
    K * relaxation_time_s and the armature K * inertia_time_s**2, so that the approach to rest is overdamped
    alike for stiff and soft robots: dry friction remembers an overshoot.

    Physical damping, which acts only in motion. There is none by default: a robot that is to move as a real
    one states its own. Material that is strained at a rate resists as Kelvin and Voigt's, stress = E
    (strain + damping_time_s * rate), so that a hinge of stiffness K gets the damping K * damping_time_s.
    A tendon's channel resists by a force along the tendon. A servo follows its command by a first-order
    lag. `core.motion` makes of these what the integrator needs.
    """

    timestep_s: float = 0.005  # of held rows
    relaxation_time_s: float = 0.05
    inertia_time_s: float = 0.01
    damping_time_s: float = 0.0  # eta / E of the material, bending and torsion alike
    tendon_damping_N_s_per_m: float = 0.0  # of each tendon in its channel, against its lengthening
    servo_lag_s: float = 0.0  # time constant between a command and what the actuator does
    motion_timestep_s: float = 0.0005  # longest step in motion; `timestep_s` where that is shorter


@dataclass(frozen=True)
class Marker:
    """A point that is measured: fixed to an element, where its frame's axes say.

    The frame lies at the centre of the element's distal face; z points along the robot, x and y are those of
    the base while the robot is straight. The point may lie outside: a marker beside a disk, the end of a
    rigid tool below the last one. It has no mass, and nothing pulls at it.
    """

    name: str
    element: int  # cell, link, ring or disk, from 1 at the base: that of `body_<element>_x_mm`
    offset_x_m: float = 0.0
    offset_y_m: float = 0.0
    offset_z_m: float = 0.0


@dataclass(frozen=True, kw_only=True)
class RobotSpec:
    """A robot of any kind: what all kinds have."""

    name: str
    description: str
    segments: tuple[Any, ...]  # along +z, base to tip: the kind's own
    tendons: tuple[Any, ...]  # what is pulled or advanced: the kind's own
    friction: Friction
    mount: Mount = Mount()
    dynamics: Dynamics = Dynamics()
    actuation: str = "tension"  # default input: "tension" or "displacement"
    channel_radius_m: float = 0.0  # of the free inner channel or lumen; 0: none
    tip_mass_kg: float = 0.0  # of a point-like load that is fixed to the tip
    stiffness_scale: float = 1.0  # multiplies every elastic constant that the kind says it does
    markers: tuple[Marker, ...] = ()  # points that are measured besides the elements' own
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)  # in file units
    sources: Mapping[str, str] = field(default_factory=dict)  # dotted file name -> source


R = TypeVar("R", bound=RobotSpec)


def with_segments(robot: R, changes: Iterable[Mapping[str, float]]) -> R:
    """Return `robot` with fields of its segments changed: by name, one mapping for each segment."""
    parts: Sequence[Any] = robot.segments
    segments = tuple(
        replace(part, **change) if change else part for part, change in zip(parts, changes, strict=True)
    )
    return cast(R, replace(robot, segments=segments))


def has_mount_slide(robot: RobotSpec) -> bool:
    """Return whether the mount gives way along the axis."""
    return math.isfinite(robot.mount.axial_stiffness_N_per_m)


# ----------------------------------------------------------------------------------------------------
# What every kind of robot must meet: friction, mount, stiffness scale, free channel, dynamics, markers.

_LONGEST_MARKER = 100  # characters
_TIMESTEP_S = (1e-5, 0.1)  # a held row takes 2 s and more: 200,000 steps, or 20
_MOST_N_S_PER_M = 1e6  # a tendon that cannot be moved
_MOST_AT_TIP_KG = 100.0  # no robot of these kinds holds as much
_SLOWEST_S = 1000.0  # a robot this slow never comes to rest
_MOST_MARKERS = 100
_FARTHEST_M = 10.0  # of a marker from its element


def check_shared(robot: RobotSpec, where: str) -> None:
    """Raise `InputError` where a number that robots of all kinds have is impossible.

    `where`: what to call it in the message (file or robot id).
    """
    top = f"{where}: "
    if not robot.name.strip() or not robot.name.isprintable() or len(robot.name) > _LONGEST_MARKER:
        text = f"1 to {_LONGEST_MARKER} characters that can be printed are needed"
        raise InputError(f"{top}name = {shown(robot.name)}: {text}")
    need(robot.friction, "mu", f"{top}friction.", lambda mu: 0 <= mu < 10, "must lie in 0 to 10")
    positive(robot.mount, "axial_stiffness_N_per_m", f"{top}mount.", finite=False)
    positive(robot, "stiffness_scale", top)
    what = f"must lie in 0 to {1e3 * _MOST_AT_TIP_KG:g} g"
    need(robot, "tip_mass_kg", top, lambda mass: 0.0 <= mass <= _MOST_AT_TIP_KG, what)
    smallest_m = min(segment.outer_radius_m for segment in robot.segments)
    what = f"must lie in 0 to the smallest outer radius, {smallest_m * 1e3:g} mm"
    need(robot, "channel_radius_m", top, lambda radius: 0 <= radius < smallest_m, what)
    for name in ("timestep_s", "relaxation_time_s", "inertia_time_s"):
        positive(robot.dynamics, name, f"{top}dynamics.")
    low_s, high_s = _TIMESTEP_S
    what = f"must lie in {low_s:g} to {high_s:g} s"
    need(robot.dynamics, "timestep_s", f"{top}dynamics.", lambda step: low_s <= step <= high_s, what)
    for name in ("relaxation_time_s", "inertia_time_s"):
        what = f"must be at most {_SLOWEST_S:g} s"
        need(robot.dynamics, name, f"{top}dynamics.", lambda time: time <= _SLOWEST_S, what)
    what = f"must lie in {low_s:g} to {high_s:g} s"
    need(robot.dynamics, "motion_timestep_s", f"{top}dynamics.", lambda step: low_s <= step <= high_s, what)
    for name in ("damping_time_s", "servo_lag_s"):
        what = f"must lie in 0 to {_SLOWEST_S:g} s"
        need(robot.dynamics, name, f"{top}dynamics.", lambda time: 0.0 <= time <= _SLOWEST_S, what)
    what = f"must lie in 0 to {_MOST_N_S_PER_M:g}"
    name = "tendon_damping_N_s_per_m"
    need(robot.dynamics, name, f"{top}dynamics.", lambda damping: 0.0 <= damping <= _MOST_N_S_PER_M, what)


def check_markers(robot: RobotSpec, elements: int, where: str) -> None:
    """Raise `InputError` where a marker is impossible.

    `elements`: how many cells, links, rings or disks it has; `where`: what to call it in the message.
    """
    if len(robot.markers) > _MOST_MARKERS:
        raise InputError(f"{where}: {len(robot.markers)} markers: more than {_MOST_MARKERS}")
    names = [marker.name for marker in robot.markers]
    for marker in robot.markers:
        check_name(marker.name, f"{where}: marker")
        if names.count(marker.name) > 1:
            raise InputError(f"{where}: marker {marker.name!r} stands twice")
        prefix = f"{where}: markers.{marker.name}."
        what = f"the robot's elements are 1 to {elements}"
        need(marker, "element", prefix, lambda element: 1 <= element <= elements, what)
        what = f"must lie within {1e3 * _FARTHEST_M:g} mm"
        for name in ("offset_x_m", "offset_y_m", "offset_z_m"):
            need(marker, name, prefix, lambda offset: abs(offset) <= _FARTHEST_M, what)


# ----------------------------------------------------------------------------------------------------
# What is worked out once for the same object: robots of a fit share their parts, slow to compare.

T = TypeVar("T")
KEPT = 256


def by_identity(count: int) -> Callable[[Callable[..., T]], Callable[..., T]]:
    """Return a decorator of functions that remember results by their first `count` arguments' identity.

    The others are compared by value. The arguments must never change: tuples of frozen values. At most `KEPT`
    results are kept, with the arguments that they belong to.
    """

    def decorate(function: Callable[..., T]) -> Callable[..., T]:
        known: dict[tuple[Any, ...], tuple[tuple[Any, ...], T]] = {}

        @wraps(function)
        def remembered(*arguments: Any) -> T:
            key = (*map(id, arguments[:count]), *arguments[count:])
            found = known.get(key)
            if found is None:
                if len(known) >= KEPT:
                    known.clear()
                found = known[key] = arguments, function(*arguments)
            return found[1]

        return remembered

    return decorate
