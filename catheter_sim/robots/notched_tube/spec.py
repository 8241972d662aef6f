"""What a notched tube with one tendon is, as a value: frozen data, SI units.

`friction`, `mount` and `dynamics` mean what they mean for the other kinds.

Geometry. The straight tube lies along +z, its lowest notch's lower edge at z = 0. Every notch is cut from
the +x side; what it leaves is a strip of the wall on the -x side. The tendon runs along the wall at +x,
so that pulling it closes the notches and bends the tube toward +x.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from catheter_sim.core.robot import RobotSpec


@dataclass(frozen=True)
class NotchedSegment:
    """A stretch of equal notches, each followed by uncut tube."""

    name: str
    notches: int
    outer_radius_m: float
    inner_radius_m: float
    notch_height_m: float  # along the tube
    notch_depth_m: float  # across it, from the outer wall at +x
    spacing_m: float  # of uncut tube after each notch
    mass_kg: float  # whole segment, in the middle of its uncut pieces
    # "flat": the cut's bottom is a plane (a mill, a saw); "radial": its two sides run toward the axis (a
    # laser on the turning tube). Both reach the outer wall where a plane at the depth does.
    cut: str = "flat"
    # A notch's elastic moment is multiplied by 1 + c3 k^2 + c5 k^4 of its bend per length k (notch and
    # uncut tube together).
    stiffness_cubic_m2: float = 0.0
    stiffness_quintic_m4: float = 0.0
    rest_curvature_x_per_m: float = 0.0  # bend per length without load, toward +x
    rest_curvature_y_per_m: float = 0.0  # toward +y
    rest_twist_rad_per_m: float = 0.0  # about the tube

    @property
    def length_m(self) -> float:
        """Length of the notches, each with the uncut tube after it [m]."""
        return self.notches * (self.notch_height_m + self.spacing_m)


@dataclass(frozen=True)
class Superelastic:
    """A metal that is linear up to a stress and has a lower slope, the plateau's, above it.

    What unloads goes back the same way: the loop between loading and unloading is left out, and so is what
    follows the plateau (at about 8 % strain). A plateau at inf is a linear metal.
    """

    modulus_Pa: float
    tension_plateau_Pa: float = math.inf  # stress at which the plateau begins
    compression_plateau_Pa: float = math.inf  # the same, above zero
    plateau_slope: float = 0.0  # of the plateau, as a share of the modulus
    poisson_ratio: float = 0.33


@dataclass(frozen=True)
class WallTendon:
    """The tendon along the tube's wall, fixed at the tip."""

    name: str
    radius_m: float  # distance from the tube's axis
    channel: str = ""  # of its input; "": its own name
    stiffness_N_per_m: float = math.inf  # of the whole tendon and its drive; inf: inextensible
    pretension_N: float = 0.0  # of a displacement-driven tendon at zero displacement


@dataclass(frozen=True, kw_only=True)
class NotchedTubeRobot(RobotSpec):
    """A notched tube that one tendon bends.

    `friction` is of the tendon at the notches' edges; `stiffness_scale` multiplies the metal's stresses.
    """

    segments: tuple[NotchedSegment, ...]
    tendons: tuple[WallTendon, ...]  # one
    material: Superelastic
    tip_length_m: float  # of uncut tube after the last notch, in place of its segment's spacing
    kind: str = "notched_tube"  # tells the file of such a robot from others
    bending_axes: str = "xy"  # "x": notches bend toward +-x only; "xy": they bend any way and twist
