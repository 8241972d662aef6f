"""What a continuum robot is, as a value: frozen data, SI units, no behaviour.

`statics/` and `mjcf/` read the same value, so that they cannot disagree about a number. The unit
stands at the end of each field's name; where a number comes from stands in `ContinuumRobot.sources`
under the field's dotted file name (`segments.distal.length_mm`).

Geometry. Along +z lie the segments, each cut into `disks` equal subsegments ("cells" where the
robot is made of cells); a disk stands at the distal end of every subsegment, and one more, fixed,
at z = 0. Each subsegment bends at `links_per_subsegment` hinges, each of which stands for an equal length
of backbone: with `hinges` = "even" at the middles of as many equal links, with "rod" moved apart toward the
disks, to where the chain between two disks shortens with its bend as a rod does (two hinges or more:
`layout.hinge_places`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Segment:
    """A stretch of equal subsegments with one set of tendons fixed at its end."""

    name: str
    length_m: float
    disks: int  # subsegments, each with a disk at its distal end
    outer_radius_m: float  # of the disks or cells
    bending_stiffness_N_m2: float  # EI of the backbone
    mass_kg: float  # whole segment, lumped at the disks
    bending_axes: str = "xy"  # "x": bends in the xz plane only; "xy": in any direction
    torsion_stiffness_N_m2: float = math.inf  # GJ; inf: cannot twist
    axial_stiffness_N: float = math.inf  # EA; inf: cannot stretch; rods' statics only, not the simulation
    shear_stiffness_N: float = math.inf  # GA; inf: cannot shear; the same
    # Elastic law M = EI (k + c3 k^3 + c5 k^5) of the curvature k: c3 [m^2], c5 [m^4].
    stiffness_cubic_m2: float = 0.0
    stiffness_quintic_m4: float = 0.0
    rest_curvature_x_per_m: float = 0.0  # of the unloaded backbone, bending toward +x
    rest_curvature_y_per_m: float = 0.0  # toward +y
    rest_twist_rad_per_m: float = 0.0  # of the tendons' holes about the backbone


@dataclass(frozen=True)
class Tendon:
    """A tendon through every disk from the base to the last disk of the segment `ends_at`."""

    name: str
    radius_m: float  # distance of its holes from the backbone
    angle_rad: float  # of its holes about +z, from +x
    ends_at: str  # name of a segment
    channel: str = ""  # tendons with the same channel share its input; "": its own name
    stiffness_N_per_m: float = math.inf  # of the whole tendon and its drive; inf: inextensible
    pretension_N: float = 0.0  # of a displacement-driven tendon at zero displacement


@dataclass(frozen=True)
class Friction:
    """Dry friction of the tendons at every hole, the base's included."""

    mu: float  # capstan (Coulomb) coefficient


@dataclass(frozen=True)
class Mount:
    """What holds the base. `axial_stiffness_N_per_m` = inf is a rigid mount."""

    axial_stiffness_N_per_m: float = math.inf


@dataclass(frozen=True)
class Dynamics:
    """What sets the motion between two equilibria, but no equilibrium.

    A hinge of stiffness K gets the damping K * relaxation_time_s and the armature
    K * inertia_time_s**2, so that the approach to rest is overdamped alike for stiff and soft
    robots: dry friction remembers an overshoot.
    """

    timestep_s: float = 0.005
    relaxation_time_s: float = 0.05
    inertia_time_s: float = 0.01


@dataclass(frozen=True)
class ContinuumRobot:
    """A tendon-driven continuum robot."""

    name: str
    description: str
    segments: tuple[Segment, ...]
    tendons: tuple[Tendon, ...]
    friction: Friction
    mount: Mount = Mount()
    dynamics: Dynamics = Dynamics()
    actuation: str = "tension"  # default input: "tension" or "displacement"
    appearance: str = "spacer_disks"  # which meshes: "spacer_disks" or "wire_guides"
    channel_radius_m: float = 0.0  # of the free inner channel; 0: none
    stiffness_scale: float = 1.0  # multiplies every stiffness of every segment's backbone
    links_per_subsegment: int = 1
    hinges: str = "even"  # where they are in a subsegment: "even" or "rod"
    disks_per_segment: int = 0  # 0: as each segment says; otherwise of every segment
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)  # in file units
    sources: Mapping[str, str] = field(default_factory=dict)  # dotted file name -> source
