"""The twin of catheters: pure kinematics, or the joints' balance where these do more, all at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.statics import Twin, TwinStates
from catheter_sim.kinds.catheter.layout import carries_load
from catheter_sim.kinds.catheter.spec import CatheterRobot
from catheter_sim.kinds.catheter.theory.batch import batch_frames, batch_joints, batch_loads
from catheter_sim.kinds.catheter.theory.pure import hinge_angles, joint_vector


@dataclass(frozen=True)
class CatheterTwin:
    """Twin of catheters.

    Attributes:
        carries_load: whether the robots bend, by joints and tendons that are springs, which may rub.
    """

    carries_load: bool

    def solve(
        self,
        robots: Sequence[CatheterRobot],
        arriving: Sequence[Inputs],
        gravity_mps2: Array,
        elements: Sequence[int],
        every: int,
    ) -> TwinStates:
        """Return where robots are, as `Twin.solve` says; NaN of one that a row leads out of its range."""
        values, tension, sunk_m = batch_joints(robots, arriving, gravity_mps2)
        loads = batch_loads(robots, arriving, gravity_mps2, values, tension, sunk_m, every)
        values, tension = values[:, ::every], tension[:, ::every]
        p_w, R_w = batch_frames(robots, values, elements)
        p_w[..., 2] -= sunk_m[:, ::every, np.newaxis]
        wanted = list(elements)
        for robot, rows, found in loads:
            none = np.where(np.isnan(found.left), np.nan, 0.0)[:, np.newaxis]
            p_w[robot, rows] += found.moved_m[:, wanted] + none[..., np.newaxis]
            R_w[robot, rows] = found.turn[:, wanted] @ R_w[robot, rows] + none[..., np.newaxis, np.newaxis]
            tension[robot, rows] += found.tension + none

        def joint_angles() -> Array:
            angles = hinge_angles(robots[0], joint_vector(robots[0], values))
            for robot, rows, found in loads:
                angles[robot, rows] += found.joint_angles
            return angles

        return TwinStates(p_w, R_w, joint_angles, tension)


def twin(robot: CatheterRobot, actuation: str) -> Twin[CatheterRobot]:
    """Return the twin of robots like `robot`, which displacements drive."""
    return CatheterTwin(carries_load(robot))
