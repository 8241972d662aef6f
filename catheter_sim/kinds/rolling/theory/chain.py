"""A rolling-joint robot as the static models read it: arrays over joints and rods, base to tip.

This is the one place where they check what they are asked.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.rolling.layout import (
    hole_position,
    last_joint,
    link_section_m2,
    rest_angle,
    rods,
    rolling_joints,
)
from catheter_sim.kinds.rolling.spec import RollingRobot
from catheter_sim.kinds.rolling.theory import joint as geometry

OPEN_SHARE = 1.0 - 1e-6  # of the way to a closed gap, where a rod's stiffness becomes infinite


@dataclass(frozen=True)
class RollingChain:
    """A robot of rolling joints, base to tip: n joints, m rods, the first t of them pulled.

    Attributes:
        robot: the specification that this was read from.
        axis: 0: the joint bends toward +x, 1: toward +y, shape (n,).
        radius_positive, radius_negative: of the arcs, shape (n,) [m].
        line: of the joint, from the robot's axis along its bending direction, shape (n,) [m].
        link_length: shape (n,) [m].
        link_stiffness: axial, E A / L; inf: rigid, shape (n,) [N/m].
        mass: of each link, shape (n,) [kg].
        mass_height: of its centre of mass, on the axis above the joint's line, shape (n,) [m].
        rest_angle: without load, shape (n,) [rad].
        sleeve_stiffness: of the outer tube at the joint, EI / L, shape (n,) [N m/rad].
        cubic, quintic: of the rods' elastic law, shape (n,) [m^2] and [m^4].
        low, high: bend angles that keep every gap open, shape (n,) [rad].
        pulled: number t of pulled rods.
        last: number of the last joint that a rod passes, shape (m,).
        passes: whether a rod passes a joint, shape (m, n).
        position: x and y of a rod's holes, shape (m, n, 2) [m].
        offset: of its holes from the joint's line along the bending direction, shape (m, n) [m].
        mouth: height of its upper mouth above the line, countersink included, shape (m, n) [m].
        side: +1, -1 or 0: its holes lie on the positive or negative side or in the neutral plane.
            Shape (m, n).
        countersink: of its holes, shape (m, n) [m].
        stiffness: EI, `stiffness_scale` included, shape (m,) [N m^2].
        rest_curvature: of a rod in the gap at the rest angle, shape (m, n) [1/m].
        rest_stiffness: of each joint about its rest angle, rods and sleeve, shape (n,) [N m/rad].
        clearance: between rod and hole [m].
        mu: friction coefficient.
    """

    robot: RollingRobot
    axis: np.ndarray
    radius_positive: Array
    radius_negative: Array
    line: Array
    link_length: Array
    link_stiffness: Array
    mass: Array
    mass_height: Array
    rest_angle: Array
    sleeve_stiffness: Array
    cubic: Array
    quintic: Array
    low: Array
    high: Array
    pulled: int
    last: np.ndarray
    passes: np.ndarray
    position: Array
    offset: Array
    mouth: Array
    side: Array
    countersink: Array
    stiffness: Array
    rest_curvature: Array
    rest_stiffness: Array
    clearance: float
    mu: float

    @property
    def joints(self) -> int:
        """Number n of joints."""
        return len(self.axis)


# Fields of a robot that change no array; they are the only ones without a hash.
_NO_ARRAYS = ("effects", "sources")
_READ = tuple(item.name for item in fields(RollingRobot) if item.name not in _NO_ARRAYS)


def rolling_chain(robot: RollingRobot) -> RollingChain:
    """Return `robot` as arrays, which are not to be changed: calls for equal robots share them."""
    return replace(_chain_of(*(getattr(robot, name) for name in _READ)), robot=robot)


@lru_cache(maxsize=64)  # a diagnosis asks for a few dozen robots again and again, trial by trial
def _chain_of(*values: Any) -> RollingChain:
    robot = RollingRobot(**dict(zip(_READ, values, strict=True)))
    joints = rolling_joints(robot)
    every = rods(robot)
    axis = np.array([joint.axis for joint in joints])
    positive = np.array([joint.radius_positive_m for joint in joints])
    negative = np.array([joint.radius_negative_m for joint in joints])
    line = np.array([joint.line_m for joint in joints])
    length = np.array([joint.link_length_m for joint in joints])
    rest = np.array([rest_angle(joint) for joint in joints])
    segments = [joint.segment for joint in joints]
    last = np.array([last_joint(robot, rod) for rod in every])
    passes = np.arange(len(joints))[None, :] < last[:, None]
    holes = np.array([[hole_position(rod, segment) for segment in robot.segments] for rod in every])
    position = np.repeat(holes, [segment.joints for segment in robot.segments], axis=1)
    along = np.take_along_axis(position, axis[None, :, None], axis=2)[:, :, 0]
    offset = along - line
    countersink = np.array([[rod.countersink_m] * len(joints) for rod in every])
    side = np.where(np.abs(along) < 1e-9, 0.0, np.sign(along))
    own_radius = np.where(offset >= 0.0, positive, negative)
    # A rod may end before a segment whose arcs its holes would not fit: there any number will do.
    mouth = np.where(
        passes,
        geometry.mouth_height(np.where(passes, offset, 0.0), own_radius) + countersink,
        length,
    )
    radius = geometry.active_radius(rest, positive, negative)
    at_rest = geometry.span(rest, radius, offset, mouth, countersink)
    rest_curvature, curving = geometry.rod_curvature(rest, at_rest.along, at_rest.along_slope)
    outer = np.array([segment.outer_radius_m for segment in segments])
    scale = robot.stiffness_scale
    stiffness = scale * np.array([rod.bending_stiffness_N_m2 for rod in every])
    sleeve_stiffness = scale * robot.sleeve.bending_stiffness_N_m2 / length
    modulus = np.array([segment.link_modulus_Pa for segment in segments])
    section = np.array([link_section_m2(robot, segment) for segment in segments])
    depth = np.array([segment.centre_of_mass_depth_m for segment in segments])

    def limit(radius: Array, toward: float) -> Array:
        """Return the bend to one side that closes the first gap or rolls off the link's edge."""
        closing = geometry.closing_angle(radius, toward * offset, mouth, countersink)
        edge = np.arcsin(np.minimum((outer - toward * line) / radius, 1.0))
        return np.minimum(np.where(passes, closing, np.inf).min(axis=0), edge) * OPEN_SHARE

    return RollingChain(
        robot=robot,
        axis=axis,
        radius_positive=positive,
        radius_negative=negative,
        line=line,
        link_length=length,
        link_stiffness=modulus * section / length,
        mass=np.array([segment.mass_kg / segment.joints for segment in segments]),
        mass_height=length - depth,
        rest_angle=rest,
        sleeve_stiffness=sleeve_stiffness,
        cubic=np.array([segment.stiffness_cubic_m2 for segment in segments]),
        quintic=np.array([segment.stiffness_quintic_m4 for segment in segments]),
        low=-limit(negative, -1.0),
        high=limit(positive, 1.0),
        pulled=len(robot.tendons),
        last=last,
        passes=passes,
        position=position,
        offset=offset,
        mouth=mouth,
        side=side,
        countersink=countersink,
        stiffness=stiffness,
        rest_curvature=np.where(passes, rest_curvature, 0.0),
        rest_stiffness=(np.where(passes, stiffness[:, None], 0.0) * curving).sum(axis=0) + sleeve_stiffness,
        clearance=robot.clearance_m,
        mu=robot.friction.mu,
    )
