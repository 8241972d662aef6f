"""What controls a catheter's joints one by one: which joint each pair moves, and where its value is read."""

from __future__ import annotations

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.robots.catheter.description import hinge_names, moved_segments
from catheter_sim.robots.catheter.spec import CatheterRobot


def joint_kinds(robot: CatheterRobot) -> tuple[str, ...]:
    """Return how the joint of each pair moves: "torsion", "bending" or "prismatic"."""
    return tuple(segment.joint for segment in moved_segments(robot))


def joint_matrix(robot: CatheterRobot, model: mujoco.MjModel) -> Array:
    """Return the matrix from qpos to the joint values in the order of the pairs, shape (t, nq)."""
    hinges = hinge_names(robot)
    matrix = np.zeros((len(robot.tendons), model.nq))
    for k, segment in enumerate(moved_segments(robot)):
        own = [segment.name]
        if segment.joint == "bending":
            own = [name for name in hinges if name.rpartition("_")[0] == segment.name]
        matrix[k, [model.joint(name).qposadr[0] for name in own]] = 1.0
    return matrix
