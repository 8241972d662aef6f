"""Corrections by a tracker at the implant's holder: measured pose to a change of the commanded joints."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.procedure.frames import pose_error, transform
from catheter_sim.procedure.steps import Step
from catheter_sim.robots.catheter.kinematics import tool_jacobian
from catheter_sim.robots.catheter.spec import CatheterRobot

POSITION_M, TURN_RAD = 1e-3, math.radians(3.0)  # errors of equal weight: what the procedure allows


@dataclass(frozen=True)
class Tracker:
    """An electromagnetic tracker's error after averaging, as root mean square over all directions.

    Assumed: of the order of what averaging over a second leaves.
    """

    position_m: float = 0.3e-3
    turn_rad: float = math.radians(0.5)


@dataclass(frozen=True)
class Corrections:
    """When to correct, and when to stop.

    Attributes:
        most: corrections after one step of the procedure.
        within_m, within_rad: measured errors that need no correction.
        share: of the measured error that one correction takes away.
    """

    most: int = 15
    within_m: float = 0.4e-3
    within_rad: float = math.radians(1.0)
    share: float = 0.7


def measured(pose: Array, tracker: Tracker, rng: np.random.Generator) -> Array:
    """Return a tool frame, shape (4, 4), with the tracker's noise."""
    shift = rng.normal(size=3) * tracker.position_m / math.sqrt(3.0)
    turn = Rotation.from_rotvec(rng.normal(size=3) * tracker.turn_rad / math.sqrt(3.0)).as_matrix()
    return transform(turn @ pose[:3, :3], pose[:3, 3] + shift)


def good_enough(error: Array, rule: Corrections) -> bool:
    """Return whether a measured pose error, shape (6,), needs no correction."""
    return bool(np.linalg.norm(error[:3]) <= rule.within_m and np.linalg.norm(error[3:]) <= rule.within_rad)


def corrected(
    robot: CatheterRobot,
    base: Array,
    wanted: Step,
    command: Step,
    reached: Array,
    target: Array,
    share: float,
) -> Step:
    """Return the next command: resolved rates of the four joints and the insertion.

    Args:
        robot: the catheter.
        base: its base frame in the valve frame, shape (4, 4).
        wanted: where it should be; the Jacobian is taken there.
        command: the present one.
        reached: the measured tool frame, valve frame, shape (4, 4).
        target: the wanted one.
        share: of the error to take away.
    """
    columns = np.zeros((6, 5))
    jacobian = tool_jacobian(robot, wanted.q)
    R = base[:3, :3]
    columns[:3, :4], columns[3:, :4] = R @ jacobian[:3], R @ jacobian[3:]
    columns[:3, 4] = base[:3, 2]
    weight = 1.0 / np.array([POSITION_M] * 3 + [TURN_RAD] * 3)
    scale = np.array([TURN_RAD, TURN_RAD, POSITION_M, TURN_RAD, POSITION_M])
    slope = weight[:, np.newaxis] * columns * scale
    error = weight * pose_error(target, reached)
    # slightly damped: near straight the two torsions do the same
    move = scale * np.linalg.solve(slope.T @ slope + 1e-2 * np.eye(5), slope.T @ error)
    return Step(
        command.name, command.insertion_m + share * move[4], command.q + share * move[:4], command.opening
    )
