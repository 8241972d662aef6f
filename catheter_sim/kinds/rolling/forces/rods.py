"""The rods of rolling joints: how they and the sleeve resist bending, and where they rub."""

from __future__ import annotations

import mujoco
import numpy as np

from catheter_sim.arrays import Array, Index
from catheter_sim.core.law import Law, RobotInModel, Step, TendonPaths
from catheter_sim.kinds.rolling.forces import rolling_kernel
from catheter_sim.kinds.rolling.forces.rolling_pack import pack, pack_holes
from catheter_sim.kinds.rolling.layout import last_joint, rolling_joints
from catheter_sim.kinds.rolling.spec import RollingRobot
from catheter_sim.kinds.rolling.theory.chain import rolling_chain


def joint_ids(robot: RollingRobot, place: RobotInModel) -> Index:
    """Return MuJoCo's numbers of the hinges, base to tip, shape (n,)."""
    return np.array([place.joint(joint.name).id for joint in rolling_joints(robot)], dtype=np.int64)


class RodElasticity(Law):
    """The moments with which rods and sleeve resist bending (chest_tube_2025, Eq. 8)."""

    def __init__(self, robot: RollingRobot, place: RobotInModel) -> None:
        self._joint, self._rod = pack(rolling_chain(robot))
        model, ids = place.model, joint_ids(robot, place)
        self._qpos = model.jnt_qposadr[ids].astype(np.int64)
        self._dofs = model.jnt_dofadr[ids].astype(np.int64)

    def arrays(self) -> tuple[Array, Array, Index]:
        """Return `joint` and `rod` of `rolling_pack.pack`, and the hinges' degrees of freedom."""
        return self._joint, self._rod, self._dofs

    def between(self, step: Step) -> None:
        """Add the moments."""
        data = step.data
        rolling_kernel.resist(data.qpos, self._qpos, self._joint, self._rod, self._dofs, data.qfrc_applied)

    def add_to_copies(self, copies: Index, qpos: Array, applied: Array) -> None:
        """`between` in some of m copies: positions (m, nq), applied forces (m, nv)."""
        rolling_kernel.resist_copies(copies, qpos, self._qpos, self._joint, self._rod, self._dofs, applied)


class RodTurns:
    """The angles by which the pulled rods turn in the links (chest_tube_2025, Eqs 2-4)."""

    def __init__(self, robot: RollingRobot, place: RobotInModel) -> None:
        chain = rolling_chain(robot)
        self._joint, self._rod = pack(chain)
        self._ends = chain.last.astype(np.int64)
        self._qpos = place.model.jnt_qposadr[joint_ids(robot, place)].astype(np.int64)
        self._hole = pack_holes(chain)
        self._turn = np.zeros((chain.pulled, chain.joints))
        self._bent = np.zeros((7, chain.joints))

    def arrays(self) -> tuple[Array, Array, Index]:
        """Return `joint` and `rod` of `rolling_pack.pack`, and where the hinges' angles are."""
        return self._joint, self._rod, self._qpos

    def __call__(self, data: mujoco.MjData, ends: Index | None = None) -> Array:
        """Return the turn before each gap, shape (t, n) [rad], in a reused array.

        That is the turn in the link below; none in the base, and none beyond a rod's end.

        Args:
            data: the state.
            ends: of each rod the gaps that matter, 0 where none does; default: all, shape (t,).
        """
        last = self._ends if ends is None else ends
        rolling_kernel.turns(data.qpos, self._qpos, self._joint, self._hole, last, self._turn, self._bent)
        return self._turn

    def of_copies(self, copies: Index, qpos: Array, site_xpos: Array, turn: Array) -> None:
        """Write the turns of some of m copies into `turn`, (m, t, n); see `core.law.Turns`."""
        rolling_kernel.turns_of(
            copies, qpos, self._qpos, self._joint, self._hole, self._ends, turn, self._bent
        )


def paths(robot: RollingRobot, place: RobotInModel) -> TendonPaths:
    """Return where the pulled rods rub: in the links."""
    return TendonPaths(
        names=[f"{place.prefix}tendon_{rod.name}" for rod in robot.tendons],
        spans=len(rolling_joints(robot)),
        ends=span_ends(robot),
        span_of_dof={int(place.joint(j.name).dofadr[0]): j.index - 1 for j in rolling_joints(robot)},
        turns=RodTurns(robot, place),
    )


def span_ends(robot: RollingRobot) -> np.ndarray:
    """Return how many joints each pulled rod passes, shape (t,)."""
    return np.array([last_joint(robot, rod) for rod in robot.tendons], dtype=int)
