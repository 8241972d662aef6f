"""What a robot of torsion, bending and prismatic joints in a row is, as a value: frozen data, SI units.

Along +z lie the segments, each with one joint at its base end.
A joint is moved by an antagonistic pair of tendons on one pulley: what one is pulled the other is
let go; or, a prismatic one, by an advance.

Joints. "torsion": the segment turns about its axis; the pair is wrapped around it. "bending": rings on
two wires, `rings` + 1 gaps that open and close, each a hinge in its middle. "prismatic": the segment
is pushed out along its axis. "rigid": none.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from catheter_sim.core.robot import RobotSpec

# "elastic": the joint's bending stiffness alone; else Nayar 2023, Algorithm 2, in its place.
RESISTANCES = ("elastic", "measured_proximal", "measured_distal")
# "linear": by `stiffness_N_per_m` alone; "uhmwpe": also by Nayar 2023, Algorithm 1, over `length_m`.
TENDON_LAWS = ("linear", "uhmwpe")


@dataclass(frozen=True)
class CatheterSegment:
    """One stretch of the catheter; numbers that its joint does not have stay at zero."""

    name: str
    joint: str  # "torsion", "bending", "prismatic" or "rigid"
    length_m: float  # at rest: rings and gaps of a bending joint, else what lies beyond the joint
    outer_radius_m: float
    limit_rad: float = 0.0  # of a torsion or bending joint, to either side
    rest_rad: float = 0.0  # of a bending joint: its bend while its pair is at zero
    # prismatic: the tube that is pushed out; stiffness inf: rigid, and the joints' includes what it adds;
    # finite: bends under load where it is out, and adds itself over their length to the joints before it
    stroke_m: float = 0.0
    tube_stiffness_N_m2: float = 0.0
    tube_curvature_x_per_m: float = 0.0  # of the unloaded tube, toward +x
    tube_curvature_y_per_m: float = 0.0
    # torsion: each tendon is wrapped `wrap_rad` around the module, over the height
    tendon_radius_m: float = 0.0
    wrap_rad: float = 0.0
    wrap_height_m: float = 0.0  # 0: wound on a drum
    # bending
    bends_toward: str = "x"  # "x" or "y"
    rings: int = 0
    half_gap_m: float = 0.0
    arm_m: float = 0.0  # of the tendons
    rim_radius_m: float = 0.0  # at which the rings touch when a gap has closed
    bending_stiffness_N_m_per_rad: float = 0.0  # of the whole joint
    resistance: str = "elastic"  # or a law that was measured: `RESISTANCES`
    mass_kg: float = 0.0


@dataclass(frozen=True)
class TendonPair:
    """An antagonistic pair on one pulley, or a tube that is advanced.

    Positive displacement pulls the tendon that bends toward + or turns counter-clockwise about +z.
    """

    name: str  # of the channel
    moves: str  # name of a segment
    length_m: float = 0.0  # of each tendon, from the joint to its drive; 0: not known
    stiffness_N_per_m: float = math.inf  # of each tendon and its drive; inf: inextensible
    slack_m: float = 0.0  # by which each tendon of a bending joint is too long at rest
    play_m: float = 0.0  # whole dead-band of its drive: gear, pulley and coupling
    law: str = "linear"  # or how the tendon itself stretches besides: `TENDON_LAWS`


@dataclass(frozen=True, kw_only=True)
class CatheterRobot(RobotSpec):
    """A steerable catheter of joints in a row, driven by displacement alone.

    `stiffness_scale` multiplies every bending joint's and exposed tube's stiffness.
    """

    segments: tuple[CatheterSegment, ...]
    tendons: tuple[TendonPair, ...]
    kind: str = "catheter"  # tells the file of such a robot from that of another
    actuation: str = "displacement"  # the only one
    path_rad: float = 0.0  # by which the bending joints' tendons turn between their drives and the base
