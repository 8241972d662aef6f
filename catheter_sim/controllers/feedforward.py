"""Feedforward: from a desired joint angle to the displacement of its pair, step by step.

    pk  Nayar 2022, Eqs 3, 6; 2023, Eqs 12-13: no history
    te  2023, Section III-A.4: Eq. 12 plus the tendon's elongation, simplified law (phi = 1, beta = 0);
        torsion by Eq. 13 with its dead-band compensated (Section IV-B)
    mk  2022, Eqs 25-26 solved for the displacement, dead-bands of the torsion joints included

What a joint has been through counts, so each has an object with a history. An advance is as desired.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Protocol

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.errors import InputError, unknown
from catheter_sim.robots.catheter.description import is_four_dof, is_transseptal, moved_segment
from catheter_sim.robots.catheter.kinematics import pulled_m
from catheter_sim.robots.catheter.measured import (
    BENDING,
    TORSION_DISTAL,
    TORSION_PROXIMAL,
    BendingCalibration,
    Side,
    StretchingJoint,
    TorsionCalibration,
    bent_to,
    stretching_joints,
)
from catheter_sim.robots.catheter.spec import CatheterRobot, CatheterSegment

MODELS = ("pk", "te", "mk")


class JointFeedforward(Protocol):
    """The feedforward of one joint."""

    def displacement_m(self, value: float) -> float:
        """Return the displacement for the next desired angle [rad] or advance [m]."""
        ...


class Advance:
    """A tube: pushed as desired."""

    def displacement_m(self, value: float) -> float:
        """Return the advance itself [m]."""
        return value


class Pure:
    """Pure kinematics of a joint, and compensation of a known dead-band between drive and joint.

    Half of the dead-band is added in the direction in which the joint moves, and kept while it stands.
    """

    def __init__(self, segment: CatheterSegment, dead_band_m: float = 0.0) -> None:
        self._segment, self._half_m = segment, 0.5 * dead_band_m
        self._before_rad, self._direction = 0.0, 0.0

    def displacement_m(self, value: float) -> float:
        """Return the displacement for the next desired angle [rad]."""
        if value != self._before_rad:
            self._direction = math.copysign(1.0, value - self._before_rad)
        self._before_rad = value
        return float(pulled_m(self._segment, value)) + self._half_m * self._direction


class Stretching:
    """A bending joint with stretching tendons, new at the start: TE."""

    def __init__(self, joint: StretchingJoint) -> None:
        self._joint = joint
        self._sides = [Side(), Side()]
        self._pulled = 0  # the side that bends, or bent last

    def displacement_m(self, value: float) -> float:
        """Return the displacement for the next desired angle [rad]."""
        angle_deg = math.degrees(value)
        if angle_deg != 0.0:
            self._pulled = 0 if angle_deg > 0.0 else 1
        ways = []
        for index, sign in enumerate((1.0, -1.0)):
            self._sides[index], way = bent_to(self._joint, self._sides[index], max(sign * angle_deg, 0.0))
            ways.append(sign * way)
        return ways[self._pulled]


class ModifiedBending:
    """Nayar 2022, Eq. 25 solved for the displacement: two lines, no history.

    For bends to the + side alone, and from the -4.2 deg on that Eq. 25 has at no displacement.
    """

    def __init__(self, segment: CatheterSegment, calibration: BendingCalibration = BENDING) -> None:
        self._arm_mm, self._calibration = segment.arm_m * 1e3, calibration

    def displacement_m(self, value: float) -> float:
        """Return the displacement for the next desired bend [rad]; 0 below what none gives."""
        alphas, betas = self._calibration.alpha, self._calibration.beta_mm
        first, second = (
            1e-3 * (alpha * self._arm_mm * math.degrees(value) + beta)
            for alpha, beta in zip(alphas, betas, strict=True)
        )
        turn = self._calibration.turn_m
        return max(first, 0.0) if first <= turn else max(second, turn)


class ModifiedTorsion:
    """Nayar 2022, Eq. 26 solved for the displacement: the branch of the direction of motion.

    Angles beyond the plateaus cannot be had; the nearer plateau is aimed at.
    """

    def __init__(self, segment: CatheterSegment, calibration: TorsionCalibration) -> None:
        self._segment, self._calibration = segment, calibration
        self._before_rad, self._loading = calibration.lower_rad, True

    def displacement_m(self, value: float) -> float:
        """Return the displacement for the next desired angle [rad]."""
        calibration = self._calibration
        angle = min(max(value, calibration.lower_rad), calibration.upper_rad)
        if angle != self._before_rad:
            self._loading = angle > self._before_rad
        self._before_rad = angle
        if angle == calibration.lower_rad:
            return 0.0
        pure = float(pulled_m(self._segment, angle - calibration.lower_rad))
        return pure + (calibration.width_m if self._loading else 0.0)


def feedforward(
    robot: CatheterRobot, model: str, dead_band_m: Mapping[str, float] | None = None
) -> list[JointFeedforward]:
    """Return the feedforward of every pair, in the robot's order, from new tendons at rest.

    Args:
        robot: what the controller takes the robot for.
        model: of `MODELS`.
        dead_band_m: whole dead-bands to be compensated, by name of a torsion joint's pair; not of "mk",
            which has its own.

    Raises:
        InputError: the model is unknown or not of this robot's design, or a dead-band has no such pair.
    """
    if model not in MODELS:
        raise unknown("feedforward", model, MODELS)
    if (model == "te" and not is_four_dof(robot)) or (model == "mk" and not is_transseptal(robot)):
        raise InputError(f"{robot.name}: feedforward {model!r} is of another design of catheter")
    bands = dict(dead_band_m or {})
    pairs = {pair.name: robot.segments[moved_segment(robot, k)] for k, pair in enumerate(robot.tendons)}
    turns = [name for name, segment in pairs.items() if segment.joint == "torsion" and model != "mk"]
    for name in bands:
        if name not in turns:
            raise unknown("pair with a dead-band", name, turns, f"{robot.name}: feedforward {model!r}")
    stretching = stretching_joints(robot) if model == "te" else {}
    return [
        _of_pair(segment, stretching.get(name), model, bands.get(name, 0.0), robot)
        for name, segment in pairs.items()
    ]


def along(joints: list[JointFeedforward], desired: Array) -> Array:
    """Return the displacements along desired joint values, shape (r, t), in the order of the pairs [m].

    Args:
        joints: `feedforward`; they go on from where they are.
        desired: angles and advances, shape (r, t) [rad or m].
    """
    columns = [
        [joint.displacement_m(float(value)) for value in desired[:, k]] for k, joint in enumerate(joints)
    ]
    return np.array(columns).T


def _of_pair(
    segment: CatheterSegment,
    stretching: StretchingJoint | None,
    model: str,
    dead_band_m: float,
    robot: CatheterRobot,
) -> JointFeedforward:
    if segment.joint == "prismatic":
        return Advance()
    if stretching is not None:
        return Stretching(stretching)
    if model != "mk":
        return Pure(segment, dead_band_m)
    if segment.joint == "bending":
        return ModifiedBending(segment)
    first = segment is robot.segments[0]
    return ModifiedTorsion(segment, TORSION_PROXIMAL if first else TORSION_DISTAL)
