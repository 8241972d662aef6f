"""What every robot is, of whatever kind: a value of frozen data, SI units, no behaviour.

A kind adds its own numbers (`kinds/<kind>/spec.py`). Statics, MJCF and effects read the same value, so that
they cannot disagree about a number. The unit stands at the end of each field's name; where a number comes
from stands in `RobotSpec.sources` under the field's dotted file name (`segments.distal.length_mm`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar, cast

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

    Aids for coming to rest, which act only where rows are held: a hinge of stiffness K gets the damping
    K * relaxation_time_s and the armature K * inertia_time_s**2, so that the approach to rest is overdamped
    alike for stiff and soft robots: dry friction remembers an overshoot.

    Physical damping, which acts only in motion; none by default, a robot that is to move as a real one
    states its own: material that is strained at a rate resists as Kelvin and Voigt's, stress = E (strain +
    damping_time_s * rate), so that a hinge of stiffness K gets the damping K * damping_time_s; a tendon's
    channel resists by a force along the tendon; a servo follows its command by a first-order lag.
    `core.motion` makes of these what the integrator needs.
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
