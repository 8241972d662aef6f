"""A tracker at the tool, whose orientation gives the joint angles, in a frame that may be turned.

Nayar 2023, Section IV-B: the electromagnetic tracker sits on the end effector, its pose is taken into the
robot's base frame, and Eqs 8-10 make joint angles of the orientation. So it also sees what is no joint
angle: a tube that droops under the weight that it carries, and a base frame that is not aligned with the
field generator's, which the paper names among the causes of its errors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from catheter_sim.arrays import Array
from catheter_sim.robots.catheter.description import moved_segment, moving
from catheter_sim.robots.catheter.kinematics import inverse
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.simulation.simulator import Simulator


@dataclass(frozen=True)
class ToolTracker:
    """Joint angles from the tool's orientation, with noise.

    Attributes:
        robot: what the controller takes the robot for: of a design with an inverse kinematics.
        noise_rad: standard deviation of every angle at every tick, white [rad].
        generator: draws the noise.
        frame_rad: by which the tracker's frame is turned from the robot's base frame, as a rotation
            vector in the base frame, shape (3,) [rad].
    """

    robot: CatheterRobot
    noise_rad: float
    generator: np.random.Generator
    frame_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def seen(self, simulator: Simulator, values: Array, turns: np.ndarray) -> Array:
        """Return joint values as they are measured, in the order of the pairs, shape (t,) [rad or m].

        Args:
            simulator: of the robot.
            values: true ones; of both branches of the inverse kinematics the nearer to them is taken, and
                an advance is measured exactly.
            turns: which are angles, shape (t,).
        """
        found = tool_angles(self.robot, simulator.posture().R_w[-1], values, self.frame_rad)
        noise = self.noise_rad * self.generator.standard_normal(len(values))
        return np.where(turns, found + noise, values)


def tool_angles(
    robot: CatheterRobot, R_tool: Array, values: Array, frame_rad: tuple[float, float, float]
) -> Array:
    """Return the joint values of a tool's orientation, in the order of the pairs, shape (t,).

    An advance is no matter of orientation: its entry says nothing.

    Args:
        robot: of a design with an inverse kinematics.
        R_tool: orientation of the tool in the base frame, shape (3, 3).
        values: near which the answer is sought, shape (t,).
        frame_rad: turn of the tracker's frame, a rotation vector, shape (3,).
    """
    tool = np.eye(4)
    tool[:3, :3] = Rotation.from_rotvec(frame_rad).as_matrix().T @ R_tool
    order = [moving(robot).index(moved_segment(robot, pair)) for pair in range(len(robot.tendons))]
    branches = [branch[order] for branch in inverse(robot, tool).branches]
    turns = [robot.segments[moved_segment(robot, pair)].joint != "prismatic" for pair in range(len(order))]

    def apart(branch: Array) -> float:
        turned = np.remainder(branch - values + np.pi, 2.0 * np.pi) - np.pi
        return float(np.abs(turned[turns]).sum())

    return np.asarray(min(branches, key=apart))
