"""Where everything of a rolling-joint robot lies when it is straight: joints, arcs, rods. Derived.

Joints and links are counted from 1 at the base; link k carries joint k's profile. In a joint's own
plane, positions are measured along its bending direction (+x or +y) from the robot's axis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.rolling.spec import Rod, RollingRobot, RollingSegment

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
