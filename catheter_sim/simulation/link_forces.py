"""Forces and moments on a robot's elements, which keep their directions in the base frame."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from catheter_sim.robots.channels import body_count
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.posture import Array
from catheter_sim.statics.rolling.loads import LinkForce, check_links


class LinkForces:
    """The forces that act now.

    A force's point is given in the frame of the body that carries the element's distal face: for a
    link with a rolling joint as in `LinkForce`; for a continuum robot's element its origin is the
    element's last hinge.

    Attributes:
        per_element: sum of the forces on each element, base to tip, base frame, shape (n, 3) [N].
    """

    def __init__(self, robot: Robot, model: mujoco.MjModel) -> None:
        elements = range(1, body_count(robot) + 1)
        self._body = [int(model.site(f"face_{k}").bodyid.item()) for k in elements]
        self._acting: list[tuple[int, Array, Array, Array]] = []  # body, point in its frame, force, moment
        self.per_element = np.zeros((len(self._body), 3))

    def __bool__(self) -> bool:
        return bool(self._acting)

    def set(self, forces: Sequence[LinkForce]) -> None:
        """Let `forces` act from now on, and no others.

        Raises:
            InputError: a link that the robot does not have.
        """
        check_links(forces, len(self._body))
        self._acting = [
            (
                self._body[item.link - 1],
                np.array(item.point_m, float),
                np.array(item.force_N, float),
                np.array(item.moment_Nm, float),
            )
            for item in forces
        ]
        self.per_element[:] = 0.0
        for item in forces:
            self.per_element[item.link - 1] += item.force_N

    def apply(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Add the forces and moments to `data.qfrc_applied`."""
        for body, point, force, moment in self._acting:
            place = data.xpos[body] + data.xmat[body].reshape(3, 3) @ point
            mujoco.mj_applyFT(model, data, force, moment, place, body, data.qfrc_applied)
