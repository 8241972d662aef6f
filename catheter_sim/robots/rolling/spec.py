"""What a robot of rigid links with rolling joints and pulled rods is, as a value: frozen data, SI units.

Geometry. Along +z lie the segments, each a chain of equal links. A joint is where the profile of a
link's lower face rolls on the flat top of the link below. The profile is two arcs that touch on the
joint's line, one to each side of the bending plane. The line lies off the axis, at different
distances ("arms") from the rod holes of the two sides. The larger arc lies on the side of the
larger arm. Half of the two arms' sum is the holes' distance from the axis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from catheter_sim.core.robot import RobotSpec


@dataclass(frozen=True)
class RollingSegment:
    """A stretch of equal links, each with a rolling joint at its lower face."""

    name: str
    length_m: float  # whole segment
    joints: int  # as many as links
    outer_radius_m: float  # of the links
    mass_kg: float  # whole segment
    centre_of_mass_depth_m: float  # of each link's centre of mass, on its axis, below its top
    larger_radius_m: float  # of the profile's two arcs
    smaller_radius_m: float
    larger_arm_m: float  # from the joint's line to the rod holes of its two sides
    smaller_arm_m: float
    # Which side the larger arm is on: "alternate": on the positive side at the first joint of each
    # bending plane, then from side to side; "positive": on the positive side at every joint.
    larger_arm_side: str = "alternate"
    bending_axes: str = "x"  # "x": every joint bends toward +x; "xy": toward +x and +y in turn
    link_modulus_Pa: float = math.inf  # of the links' compression along their axis; inf: rigid
    # Every rod's moment in these joints is EI times its curvature in the gap, times 1 + c3 k^2 + c5 k^4
    # of the joint's bend per length k. (The curvature in the gap grows without bound as the gap closes.)
    stiffness_cubic_m2: float = 0.0
    stiffness_quintic_m4: float = 0.0
    rest_curvature_x_per_m: float = 0.0  # bend per length of the joints toward +x, without load
    rest_curvature_y_per_m: float = 0.0  # toward +y


@dataclass(frozen=True)
class Rod:
    """An elastic rod through every link from the base to the last link of the segment `ends_at`."""

    name: str
    side: str  # of the axis on which its holes lie: "+x", "-x", "+y" or "-y"
    ends_at: str  # name of a segment
    rod_radius_m: float
    bending_stiffness_N_m2: float  # EI
    channel: str = ""  # pulled rods with the same channel share its input; "": its own name
    lateral_m: float = 0.0  # of its holes, at right angles to `side` (along +y, or +x)
    countersink_m: float = 0.0  # how far its holes' mouths lie back from the links' faces


@dataclass(frozen=True)
class Sleeve:
    """An elastic tube around the robot that bends with every joint, over one link's length.

    A stiffness of 0 is no sleeve.
    """

    bending_stiffness_N_m2: float = 0.0
    inner_radius_m: float = 0.0
    outer_radius_m: float = 0.0


@dataclass(frozen=True, kw_only=True)
class RollingRobot(RobotSpec):
    """A rod-driven robot of rigid links with rolling joints.

    `friction` is of the pulled rods in the links' holes; `stiffness_scale` multiplies every rod's stiffness
    and the sleeve's. It is driven by tension alone: a rod that is held by length is not modelled.
    """

    segments: tuple[RollingSegment, ...]
    tendons: tuple[Rod, ...]  # the rods that are pulled
    clearance_m: float  # between a rod and its hole, on each side
    kind: str = "rolling"  # tells the file of such a robot from that of another
    passive_rods: tuple[Rod, ...] = ()  # free to slide; they only resist bending
    sleeve: Sleeve = Sleeve()
