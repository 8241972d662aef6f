"""Where everything of a straight notched tube lies: notches, elements, tendon. Derived.

Element k, from 1 at the base, is notch k and the uncut tube after it. Its distal face is the uncut piece's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from catheter_sim.kinds.notched_tube.spec import NotchedSegment, NotchedTubeRobot

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
