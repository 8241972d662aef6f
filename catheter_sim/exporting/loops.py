"""Histories of inputs on which an exported file is fitted, and others on which it is judged.

Both are loops from rest and back, held row by row. Those that judge go to other levels, turn round half
way, and pull one drive while another stands: nothing of them has been fitted.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.drive import pulls_alone
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.quick_model import DriveLevels
from catheter_sim.core.robot import RobotSpec
from catheter_sim.robots import face_of

ROWS_A_WAY = 12  # of a fitted loop's full way
# Corners of the loops as shares of a drive's range, from rest and back to it.
_FITTED = (0.0, 1.0, 0.0)
_JUDGED = (0.0, 0.8, 0.35, 0.65, 0.0)
_STANDING_SHARE = 0.3  # of a drive's range, at which it stands while the next one goes through its loop
_STANDING = (0.0, 0.6, 0.0)


def drives_of(robot: RobotSpec, largest_bend_rad: float | None = None) -> DriveLevels:
    """Return what loops move: the robot's drives with their ranges, as environments know them.

    Args:
        robot: with its effects or without.
        largest_bend_rad: what a drive asks of a segment at the end of its range; default: a quarter turn.

    Raises:
        InputError: the robot's kind has none.
    """
    steering = face_of(robot, "steering", "export")
    drives: DriveLevels = steering.quick_model(robot, robot.actuation, largest_bend_rad).drives
    return drives


def fitted_loops(drives: DriveLevels) -> Inputs:
    """Return one whole loop of each drive after the other, to each end of its range."""
    count = len(drives.names)
    parts = []
    for drive in range(count):
        parts.append(_alone(_path(_FITTED, ROWS_A_WAY), drive, count))
        if drives.lowest[drive] < 0.0:
            parts.append(-parts[-1])
    return _inputs(drives, parts)


def judged_loops(drives: DriveLevels) -> tuple[Inputs, Inputs | None]:
    """Return loops with turns half way: of one drive at a time, and of one while its neighbour stands.

    The second is None where there is one drive alone.
    """
    count = len(drives.names)
    alone = []
    for drive in range(count):
        sides = (1.0, -1.0) if drives.lowest[drive] < 0.0 else (1.0,)
        alone += [side * _alone(_path(_JUDGED, 8), drive, count) for side in sides]
    together = []
    for drive in range(count if count > 1 else 0):
        standing = _STANDING_SHARE * _alone(np.ones(1), (drive + 1) % count, count)
        moved = _alone(_path(_STANDING, 8), drive, count)
        together += [standing, standing + moved, np.zeros((1, count))]
    return _inputs(drives, alone), _inputs(drives, together) if together else None


def _path(corners: tuple[float, ...], rows_a_way: int) -> Array:
    """Return rows along corners, a whole way in so many, without the first corner."""
    legs = []
    for start, end in pairwise(corners):
        rows = max(2, round(rows_a_way * abs(end - start)))
        legs.append(start + (end - start) * np.arange(1, rows + 1) / rows)
    return np.concatenate(legs)


def _alone(levels: Array, drive: int, count: int) -> Array:
    """Return the levels of `count` drives of which one moves, shape (r, d)."""
    found = np.zeros((len(levels), count))
    found[:, drive] = levels
    return found


def _inputs(drives: DriveLevels, parts: list[Array]) -> Inputs:
    count = len(drives.names)
    levels = np.concatenate([np.zeros((1, count)), *parts, np.zeros((1, count))])
    tendon = pulls_alone(drives.actuation, levels @ drives.tendon.T)
    nothing = np.zeros((len(levels), 3))
    return Inputs(np.arange(float(len(levels))), drives.actuation, tendon, nothing, nothing)
