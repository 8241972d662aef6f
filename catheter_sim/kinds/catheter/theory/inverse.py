"""Closed-form inverse kinematics of both mitral catheters: joint values from a tool frame.

A tool frame has six coordinates, the robots four joints: the orientation gives the angles (Nayar 2022,
Eqs 16-19; Nayar 2023, Eqs 8-10), the position the advance. How far the reached tip lies from the asked
one is part of the answer. Both branches are found, those within the joints' limits kept.

The advance is the way along the tool's axis that is left, with its sign. 2022 Eq. 21 takes the
distance, which has none; 2023 Eq. 11 divides by sin(theta_db), which is zero when straight.

Where the orientation leaves a family of joint values. Transseptal robot: straight (bending 0), where
only the two torsions' sum is given (Eq. 19). 4-DoF robot: distal bending +-90 deg, where only the
proximal bending plus or minus the torsion is; there the position, which does not depend on the torsion,
decides, so the answer is unique all the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from catheter_sim.arrays import Array
from catheter_sim.errors import InputError
from catheter_sim.kinds.catheter.layout import FOUR_DOF, TRANSSEPTAL, design, is_curved, moving
from catheter_sim.kinds.catheter.spec import CatheterRobot
from catheter_sim.kinds.catheter.theory.closed_form import four_dof_lengths, in_paper_frame
from catheter_sim.kinds.catheter.theory.kinematics import tool_frame

STRAIGHT_RAD = 1e-7  # bends below it are straight: torsions would lose half of their digits
_GIMBAL = 1e-6  # |cos(distal bending)| below which the position decides
_LIMIT_SLACK = 1e-9  # [rad, m] a value on its limit may be over it by rounding


@dataclass(frozen=True)
class Family:
    """Joint values that all reach the same straight pose.

    Attributes:
        sum_rad: of proximal and distal torsion, the same for all [rad].
        proximal_rad: least and largest proximal torsion within the joints' limits [rad]; NaN where
            the limits leave none.
    """

    sum_rad: float
    proximal_rad: tuple[float, float]


@dataclass(frozen=True)
class InverseResult:
    """What the inverse kinematics found.

    Attributes:
        solutions: joint values within the limits, each of shape (m,) in the order of
            `kinematics`; of a family, the one that shares the sum out evenly.
        distance_m: of the reached tip from the asked one, for each solution [m].
        branches: joint values of every branch, within the limits or not.
        family: where the pose is straight and not unique; else None.
    """

    solutions: tuple[Array, ...]
    distance_m: tuple[float, ...]
    branches: tuple[Array, ...]
    family: Family | None = None

    @property
    def unique(self) -> bool:
        """Whether exactly one set of joint values within the limits reaches the pose."""
        return len(self.solutions) == 1 and self.family is None

    @property
    def message(self) -> str:
        """One line that says what was found."""
        if self.family is not None:
            total = math.degrees(self.family.sum_rad)
            return f"not unique: straight, any proximal and distal torsion that sum to {total:.6g} deg"
        if not self.solutions:
            return "no joint values within the limits reach this orientation and advance"
        return "unique" if self.unique else f"not unique: {len(self.solutions)} branches within the limits"


def inverse(robot: CatheterRobot, tool: Array) -> InverseResult:
    """Return the joint values that reach a tool frame.

    Args:
        robot: of one of the two designs.
        tool: shape (4, 4), base frame, SI units.

    Raises:
        InputError: another design, a tube that is curved at rest, or no transform.
    """
    solvers: dict[tuple[str, ...], Callable[[CatheterRobot, Array, Array], list[Array]]] = {
        TRANSSEPTAL: _transseptal,
        FOUR_DOF: _four_dof,
    }
    if design(robot) not in solvers:
        raise InputError(f"{robot.name}: no inverse kinematics for this row of joints")
    for segment in robot.segments:
        if is_curved(segment):
            raise InputError(
                f"{robot.name}: segments.{segment.name}.tube_curvature: no closed-form inverse kinematics "
                "for a curved tube; choices: 0 per m"
            )
    tool = np.asarray(tool, dtype=float)
    R = tool[:3, :3]
    if tool.shape != (4, 4) or not np.allclose(R @ R.T, np.eye(3), atol=1e-6) or np.linalg.det(R) < 0.0:
        raise InputError(f"{robot.name}: a tool frame is a rotation and a position, shape (4, 4)")
    position, turned = in_paper_frame(tool[:3, 3], R)
    branches = [_with_advance(robot, q, tool) for q in solvers[design(robot)](robot, position, turned)]
    kept = tuple(q for q in branches if within_limits(robot, q))
    reached = tuple(float(np.linalg.norm(tool_frame(robot, q)[:3, 3] - tool[:3, 3])) for q in kept)
    family = None
    if design(robot) == TRANSSEPTAL and len(branches) == 1:
        family = _family(robot, float(branches[0][0] + branches[0][3]))
    return InverseResult(kept, reached, tuple(branches), family)


def within_limits(robot: CatheterRobot, q: Array) -> bool:
    """Return whether joint values, shape (m,), lie within the joints' limits and strokes."""
    for value, index in zip(q, moving(robot), strict=True):
        segment = robot.segments[index]
        if segment.joint == "prismatic":
            inside = -_LIMIT_SLACK <= value <= segment.stroke_m + _LIMIT_SLACK
        else:
            inside = abs(value) <= segment.limit_rad + _LIMIT_SLACK
        if not inside:
            return False
    return True


def _with_advance(robot: CatheterRobot, q: Array, tool: Array) -> Array:
    """Return `q` with the advance: what is left to the tip along the tool's axis."""
    left = tool[:3, 3] - tool_frame(robot, q)[:3, 3]
    return q + np.array([0.0, 0.0, float(tool[:3, 2] @ left), 0.0])


def _transseptal(robot: CatheterRobot, position: Array, R: Array) -> list[Array]:
    """Return both branches with no advance, one for a straight pose (Nayar 2022, Eqs 16-19)."""
    sine = 0.5 * (math.hypot(R[0, 2], R[1, 2]) + math.hypot(R[2, 0], R[2, 1]))
    # Eq. 16 by its cosine alone would lose half of the digits near straight
    bend = math.atan2(sine, R[2, 2])
    if bend < STRAIGHT_RAD:
        half = 0.5 * math.atan2(R[1, 0] - R[0, 1], R[0, 0] + R[1, 1])
        return [np.array([half, 0.0, 0.0, half])]
    found = []
    for sign in (1.0, -1.0):
        proximal = math.atan2(sign * R[0, 2], -sign * R[1, 2])
        distal = math.atan2(sign * R[2, 0], sign * R[2, 1])
        found.append(np.array([proximal, sign * bend, 0.0, distal]))
    return found


def _family(robot: CatheterRobot, total_rad: float) -> Family:
    first, last = robot.segments[0].limit_rad, robot.segments[3].limit_rad
    least, most = max(-first, total_rad - last), min(first, total_rad + last)
    return Family(total_rad, (least, most) if least <= most else (math.nan, math.nan))


def _four_dof(robot: CatheterRobot, position: Array, R: Array) -> list[Array]:
    """Return both branches with no advance (Nayar 2023, Eqs 8-10)."""
    found = []
    for sign in (1.0, -1.0):
        cosine = sign * 0.5 * (math.hypot(R[0, 0], R[0, 1]) + math.hypot(R[1, 2], R[2, 2]))
        distal = math.atan2(R[0, 2], cosine)
        if abs(cosine) < _GIMBAL:
            proximal = _proximal_from_position(robot, distal, position)
        else:
            proximal = math.atan2(-sign * R[1, 2], sign * R[2, 2])
        # what is left of R is the torsion, whatever the bends
        c, s = math.cos(proximal), math.sin(proximal)
        torsion = math.atan2(c * R[1, 0] + s * R[2, 0], c * R[1, 1] + s * R[2, 1])
        found.append(np.array([proximal, distal, 0.0, torsion]))
        if abs(cosine) < _GIMBAL:
            break  # both branches have met
    return found


def _proximal_from_position(robot: CatheterRobot, distal: float, position: Array) -> float:
    """Return the proximal bend whose tip lies in the direction of `position` about the x axis.

    At a distal bend of +-90 deg the advance moves the tip along x alone.
    """
    lengths = four_dof_lengths(robot)
    straight = lengths.middle_m + lengths.distal_m * math.sin(distal) / distal
    wanted = math.atan2(-position[1], position[2])

    def excess(bend: float) -> float:
        # the chord points along half of the bend, what follows along all of it
        half = 0.5 * bend
        chord = lengths.proximal_m * float(np.sinc(half / math.pi))
        across = chord * math.sin(half) + straight * math.sin(bend)
        along = chord * math.cos(half) + straight * math.cos(bend)
        return math.atan2(across, along) - wanted

    limit = 0.75 * math.pi  # within it the direction lies between half of the bend and all of it
    low, high = excess(-limit), excess(limit)
    if not low <= 0.0 <= high:
        return math.copysign(limit, wanted)
    return float(brentq(excess, -limit, limit, xtol=1e-15))
