"""A robot on its way along a history of inputs, by the complete balance with sliding rods."""

from __future__ import annotations

import numpy as np

from catheter_sim.kinds.rolling.theory.chain import RollingChain
from catheter_sim.kinds.rolling.theory.complete import PRE_SLIDING_M
from catheter_sim.kinds.rolling.theory.history import Stretch
from catheter_sim.kinds.rolling.theory.kernels.balance import workspace
from catheter_sim.kinds.rolling.theory.kernels.history import advance
from catheter_sim.kinds.rolling.theory.kernels.packed import Packed, pack


class March:
    """The state that a robot carries from row to row, starting at rest without load.

    Attributes:
        chain: the robot.
        theta: bend angles, shape (n,) [rad].
        drive: tension at the actuator, shape (t,) [N].
        memory: how each rod hangs in each link, see `kernels.sliding`, shape (3, t, n).
        link_length: as compressed, shape (n,) [m].
        at_joint: tension in each joint's gap, shape (t, n) [N].
        unbalanced: moment left at each joint, shape (n,) [N m].
    """

    def __init__(self, chain: RollingChain, packed: Packed | None = None) -> None:
        """Put the robot at rest, without load; `packed` is `pack(chain)` where that is at hand."""
        n, t = chain.joints, chain.pulled
        self.chain = chain
        self.packed = packed or pack(chain)
        self.theta, self.link_length = chain.rest_angle.copy(), chain.link_length.copy()
        self.drive = np.zeros(t)
        self.memory, self.at_joint, self.unbalanced = np.zeros((3, t, n)), np.zeros((t, n)), np.zeros(n)
        self._gives, self._unknown = np.array(PRE_SLIDING_M), np.empty((0, 1 + t, n))
        self._work = workspace(n, t)

    def copy(self) -> March:
        """Return another one in the same state."""
        other = March(self.chain, self.packed)
        for name in ("theta", "link_length", "drive", "memory", "at_joint", "unbalanced"):
            setattr(other, name, getattr(self, name).copy())
        return other

    def advance(self, way: Stretch) -> bool:
        """Go from here, whatever its `drive_from`, to the end of `way`; return whether it was reached."""
        robot, start, end = self.packed, way.loads_from, way.loads_to
        made = np.empty((way.steps, *self._unknown.shape[1:]))
        reached = advance(
            *(robot.joint, robot.rod, robot.stiffness, robot.pulled, robot.mu),
            *(self.drive, way.drive_to, self.theta, self.memory, self.link_length),
            *(end.link, end.point, start.force, end.force, start.tip_moment, end.tip_moment),
            *(self._gives, way.steps, self._unknown, made, self.at_joint, self.unbalanced, self._work),
        )
        self.drive = way.drive_to
        return bool(reached == 1.0)
