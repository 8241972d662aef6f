"""What a continuum robot is, as a value: frozen data, SI units, no behaviour.

Geometry. Along +z lie the segments, each cut into `disks` equal subsegments ("cells" where the
robot is made of cells); a disk stands at the distal end of every subsegment, and one more, fixed,
at z = 0. Each subsegment bends at `links_per_subsegment` hinges, each of which stands for an equal length
of backbone: with `hinges` = "even" at the middles of as many equal links, with "rod" moved apart toward the
disks, to where the chain between two disks shortens with its bend as a rod does (two hinges or more:
`layout.hinge_places`). A segment of one hinge a subsegment may have it anywhere (`hinge_share`): in the plane
of the disk beyond, say, as in many chains that were written as MJCF.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from catheter_sim.core.robot import RobotSpec


@dataclass(frozen=True)
class Segment:
    """A stretch of equal subsegments with one set of tendons fixed at its end."""

    name: str
    length_m: float
    disks: int  # subsegments, each with a disk at its distal end
    outer_radius_m: float  # of the disks or cells
    bending_stiffness_N_m2: float  # EI of the backbone
    mass_kg: float  # whole segment; where it is: `ContinuumRobot.masses`
    bending_axes: str = "xy"  # "x", "y": bends in the xz, yz plane only; "xy": in any direction; "none": not
    torsion_stiffness_N_m2: float = math.inf  # GJ; inf: cannot twist
    axial_stiffness_N: float = math.inf  # EA; inf: cannot stretch; rods' statics only, not the simulation
    shear_stiffness_N: float = math.inf  # GA; inf: cannot shear; the same
    # Elastic law M = EI (k + c3 k^3 + c5 k^5) of the curvature k: c3 [m^2], c5 [m^4].
    stiffness_cubic_m2: float = 0.0
    stiffness_quintic_m4: float = 0.0
    rest_curvature_x_per_m: float = 0.0  # of the unloaded backbone, bending toward +x
    rest_curvature_y_per_m: float = 0.0  # toward +y
    rest_twist_rad_per_m: float = 0.0  # of the tendons' holes about the backbone
    hinge_share: float = 0.5  # where a subsegment's one hinge stands, of its length from the disk before


@dataclass(frozen=True)
class Tendon:
    """A tendon through every disk from the base to the last disk of the segment `ends_at`."""

    name: str
    radius_m: float  # distance of its holes from the backbone
    angle_rad: float  # of its holes about +z, from +x
    ends_at: str  # name of a segment
    channel: str = ""  # tendons with the same channel share its input; "": its own name
    stiffness_N_per_m: float = math.inf  # of the whole tendon and its drive; inf: inextensible
    pretension_N: float = 0.0  # of a displacement-driven tendon at zero displacement, the robot as unloaded
    channel_gain: float = 1.0  # displacement over its channel's; -1: let out as far as the channel is pulled
    slack_m: float = 0.0  # by which a displacement-driven tendon is too long at rest


@dataclass(frozen=True, kw_only=True)
class ContinuumRobot(RobotSpec):
    """A tendon-driven continuum robot; `stiffness_scale` multiplies every stiffness of its backbone."""

    segments: tuple[Segment, ...]
    tendons: tuple[Tendon, ...] = ()  # none: a rod that forces alone bend
    appearance: str = "spacer_disks"  # which meshes: "spacer_disks" or "wire_guides"
    links_per_subsegment: int = 1
    hinges: str = "even"  # where they are in a subsegment: "even" or "rod"
    masses: str = "along"  # spread evenly along each segment, or "faces": each link's at its distal face
    disks_per_segment: int = 0  # 0: as each segment says; otherwise of every segment
