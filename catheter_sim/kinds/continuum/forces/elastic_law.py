"""The part of the elastic law that a hinge's own polynomial in MJCF cannot hold.

The law is M = EI (k + c3 k^3 + c5 k^5) of the curvature k, a vector in a robot that bends in space:
M_x = EI k_x (1 + c3 |k|^2 + c5 |k|^4). MJCF holds c3 k_x^3 of each hinge by itself; the coupling of
the two hinges and the fifth power are applied as forces.
"""

from __future__ import annotations

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.law import Law, RobotInModel, Step
from catheter_sim.core.law_copies import CopiesLaw, CopyArrays
from catheter_sim.kinds.continuum.layout import axes_of, links
from catheter_sim.kinds.continuum.spec import ContinuumRobot


class ElasticRemainder(Law):
    """Torques of the elastic law beyond what the model's joints have."""

    def __init__(self, robot: ContinuumRobot, place: RobotInModel) -> None:
        rows: list[tuple[int, int, int, int, float, float, float]] = []
        for link in links(robot):
            segment = link.segment
            coupled = segment.bending_axes == "xy" and segment.stiffness_cubic_m2 != 0.0
            if not coupled and segment.stiffness_quintic_m4 == 0.0:
                continue
            axes = axes_of(segment)
            if not axes:
                continue
            x = place.joint(f"{axes[0]}{link.index}")  # the one, where it bends in one plane
            y = place.joint(f"y{link.index}") if axes == "xy" else None
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
        self._rest = place.model.qpos_spring.copy()

    def arrays(self) -> tuple[list[np.ndarray], list[Array]]:
        """Return the law as plain arrays, for where it runs elsewhere.

        Returns:
            Places of the links' hinges in MuJoCo, positions and degrees of freedom about x, then about y
            (below zero: none), each of shape (k,). Stiffness [N m/rad], `cubic` and `quintic` of each, and
            all rest positions, shape (nq,).
        """
        places = [self._qx, self._dx, self._qy, self._dy]
        return places, [self._stiffness, self._cubic, self._quintic, self._rest]

    def between(self, step: Step) -> None:
        """Add the torques."""
        data = step.data
        on_x, on_y = self._torques(data.qpos)
        data.qfrc_applied[self._dx] -= on_x
        data.qfrc_applied[self._dy[self._spatial]] -= on_y

    def add_to_copies(self, copies: np.ndarray, qpos: Array, applied: Array) -> None:
        """`between` in some of m copies: positions (m, nq), applied forces (m, nv)."""
        on_x, on_y = self._torques(qpos[copies])
        applied[np.ix_(copies, self._dx)] -= on_x
        applied[np.ix_(copies, self._dy[self._spatial])] -= on_y

    def _torques(self, qpos: Array) -> tuple[Array, Array]:
        """Return what the hinges about x, and those about y that are there, lack at `qpos`, (..., nq)."""
        x = qpos[..., self._qx] - self._rest[self._qx]
        y = np.where(self._spatial, qpos[..., self._qy] - self._rest[self._qy], 0.0)
        square = x**2 + y**2
        fifth = self._quintic * square**2
        on_x = self._stiffness * x * (self._cubic * y**2 + fifth)
        on_y = self._stiffness * y * (self._cubic * x**2 + fifth)
        return on_x, on_y[..., self._spatial]


class ElasticCopies(CopiesLaw):
    """The law in many copies."""

    compiled = False

    def __init__(self, law: ElasticRemainder, arrays: CopyArrays) -> None:
        self._law, self._arrays = law, arrays

    def between(self, copies: np.ndarray) -> None:
        """Add the torques."""
        self._law.add_to_copies(copies, self._arrays.qpos, self._arrays.applied)
