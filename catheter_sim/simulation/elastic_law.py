"""The part of the elastic law that a hinge's own polynomial in MJCF cannot hold.

The law is M = EI (k + c3 k^3 + c5 k^5) of the curvature k, a vector in a robot that bends in space:
M_x = EI k_x (1 + c3 |k|^2 + c5 |k|^4). MJCF holds c3 k_x^3 of each hinge by itself; the coupling of
the two hinges and the fifth power are applied as forces.
"""

from __future__ import annotations

import mujoco
import numpy as np

from catheter_sim.robots.layout import links
from catheter_sim.robots.specification import ContinuumRobot


class ElasticRemainder:
    """Torques of the elastic law beyond what the model's joints have."""

    def __init__(self, robot: ContinuumRobot, model: mujoco.MjModel) -> None:
        rows: list[tuple[int, int, int, int, float, float, float]] = []
        for link in links(robot):
            segment = link.segment
            coupled = segment.bending_axes == "xy" and segment.stiffness_cubic_m2 != 0.0
            if not coupled and segment.stiffness_quintic_m4 == 0.0:
                continue
            x = model.joint(f"x{link.index}")
            y = model.joint(f"y{link.index}") if segment.bending_axes == "xy" else None
            rows.append(
                (
                    x.qposadr[0],
                    x.dofadr[0],
                    y.qposadr[0] if y is not None else -1,
                    y.dofadr[0] if y is not None else -1,
                    robot.stiffness_scale * segment.bending_stiffness_N_m2 / link.length_m,
                    segment.stiffness_cubic_m2 / link.length_m**2,
                    segment.stiffness_quintic_m4 / link.length_m**4,
                )
            )
        self.needed = bool(rows)
        table = np.array(rows or np.zeros((0, 7)))
        self._qx, self._dx, self._qy, self._dy = table[:, :4].astype(int).T
        self._stiffness, self._cubic, self._quintic = table[:, 4:].T
        self._spatial = self._qy >= 0
        self._rest = model.qpos_spring.copy()

    def apply(self, data: mujoco.MjData) -> None:
        """Add the torques to `data.qfrc_applied`."""
        x = data.qpos[self._qx] - self._rest[self._qx]
        y = np.where(self._spatial, data.qpos[self._qy] - self._rest[self._qy], 0.0)
        square = x**2 + y**2
        fifth = self._quintic * square**2
        data.qfrc_applied[self._dx] -= self._stiffness * x * (self._cubic * y**2 + fifth)
        on_y = self._stiffness * y * (self._cubic * x**2 + fifth)
        data.qfrc_applied[self._dy[self._spatial]] -= on_y[self._spatial]
