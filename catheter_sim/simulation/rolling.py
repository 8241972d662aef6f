"""What a robot of rolling joints needs beside its MuJoCo model: rolling, elastic rods, turns.

Rolling. With the arc's radius R (that of the side it leans to) and the bend angle theta, the contact
lies at line + R theta on the flat below and at (line + R sin theta, R (1 - cos theta)) in the link's
own frame; a link hung there on a hinge must be shifted by (R (theta - sin theta), -R (1 - cos theta))
against the flat for the hinge to put it where pure rolling does. See `catheter_sim.mjcf.rolling`.

What runs at every step is compiled, in `rolling_kernel`.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from catheter_sim.robots.posture import Array
from catheter_sim.robots.rolling import RollingRobot
from catheter_sim.robots.rolling_layout import last_joint, rods, rolling_joints
from catheter_sim.simulation import rolling_kernel
from catheter_sim.statics.rolling.chain import rolling_chain


def _joint_ids(robot: RollingRobot, model: mujoco.MjModel) -> rolling_kernel.Index:
    """Return MuJoCo's numbers of the hinges, base to tip, shape (n,)."""
    return np.array([model.joint(joint.name).id for joint in rolling_joints(robot)], dtype=np.int64)


@dataclass(frozen=True)
class RollingArrays:
    """What rolling needs to know of a robot as plain arrays, for where it runs elsewhere.

    Attributes:
        axis, joint_index, body_index, qpos_index: as in `rolling_kernel.place`, shape (n,).
        ends: number of joints that each pulled rod passes, shape (t,).
        length: of the links without load, shape (n,) [m].
        compliance: of the links along their axes, shape (n,) [m/N].
        top_link, top_site, top_depth: as in `rolling_kernel.place_tops`, shape (s,).
    """

    axis: rolling_kernel.Index
    joint_index: rolling_kernel.Index
    body_index: rolling_kernel.Index
    qpos_index: rolling_kernel.Index
    ends: rolling_kernel.Index
    length: Array
    compliance: Array
    top_link: rolling_kernel.Index
    top_site: rolling_kernel.Index
    top_depth: Array


class Rolling:
    """Keeps the hinges of a model at the contacts of its rolling joints.

    Attributes:
        compressible: whether any link gives way along its axis.
    """

    def __init__(self, robot: RollingRobot, model: mujoco.MjModel) -> None:
        self._model = model
        chain = rolling_chain(robot)
        joints = rolling_joints(robot)
        self._constants, _ = rolling_kernel.pack(chain)
        self._axis = chain.axis.astype(np.int64)
        self._joint = _joint_ids(robot, model)
        self._body = np.array([model.body(f"link_{joint.index}").id for joint in joints], dtype=np.int64)
        self._qpos = model.jnt_qposadr[self._joint].astype(np.int64)
        self._ends = chain.last.astype(np.int64)
        self._free_length = chain.link_length
        self._length = chain.link_length.copy()
        self._compliance = 1.0 / chain.link_stiffness
        self.compressible = bool((self._compliance > 0.0).any())
        tops = [(joint.index, f"face_{joint.index}") for joint in joints] + [(joints[-1].index, "tip")]
        tops += [
            (k, f"hole_{rod.name}_{k}") for rod in rods(robot) for k in range(1, last_joint(robot, rod) + 1)
        ]
        self._top_link = np.array([k - 1 for k, _ in tops], dtype=np.int64)
        self._top_site = np.array([model.site(name).id for _, name in tops], dtype=np.int64)
        self._top_depth = self._length[self._top_link] - model.site_pos[self._top_site, 2]

    def layout(self) -> RollingArrays:
        """Return what it works on as plain arrays."""
        return RollingArrays(
            axis=self._axis,
            joint_index=self._joint,
            body_index=self._body,
            qpos_index=self._qpos,
            ends=self._ends,
            length=self._free_length,
            compliance=self._compliance,
            top_link=self._top_link,
            top_site=self._top_site,
            top_depth=self._top_depth,
        )

    def reset(self) -> None:
        """Give the links their own lengths back."""
        self._length[:] = self._free_length
        self._place_tops()

    def place(self, data: mujoco.MjData) -> None:
        """Put hinges and links where pure rolling has them at the present angles."""
        rolling_kernel.place(
            data.qpos,
            self._qpos,
            self._constants,
            self._axis,
            self._length,
            self._joint,
            self._body,
            self._model.jnt_pos,
            self._model.body_pos,
        )

    def place_copies(
        self, copies: rolling_kernel.Index, qpos: Array, jnt_pos: Array, body_pos: Array
    ) -> None:
        """`place` in many copies of the model without compression.

        Args:
            copies: which of the m.
            qpos: their positions, shape (m, nq).
            jnt_pos, body_pos: out: their fields of the model, shapes (m, njnt, 3) and (m, nbody, 3) [m].
        """
        rolling_kernel.place_copies(
            copies,
            qpos,
            self._qpos,
            self._constants,
            self._axis,
            self._free_length,
            self._joint,
            self._body,
            jnt_pos,
            body_pos,
        )

    def compress(
        self, data: mujoco.MjData, span_tension: Array, force_tip: Array, force_on_link: Array
    ) -> None:
        """Shorten the links as the present tensions and loads press them together.

        A link carries the mean of its rods' tensions below and above its holes' friction, and the
        weight and forces beyond it. It follows one step behind.

        Args:
            data: the state.
            span_tension: in the gap below each link, NaN beyond a rod's end, shape (t, n) [N].
            force_tip: on the tip, base frame, shape (3,) [N].
            force_on_link: other forces on each link, base frame, shape (n, 3) [N].
        """
        rolling_kernel.compress(
            span_tension,
            self._ends,
            force_tip,
            force_on_link,
            self._model.opt.gravity,
            self._model.body_mass,
            data.xmat,
            self._body,
            self._free_length,
            self._compliance,
            self._length,
        )
        self._place_tops()

    def _place_tops(self) -> None:
        """Put the sites near the links' tops at their depths below them."""
        rolling_kernel.place_tops(
            self._length, self._top_link, self._top_depth, self._top_site, self._model.site_pos
        )


class RodElasticity:
    """The moments with which rods and sleeve resist bending (chest_tube_2025, Eq. 8)."""

    needed = True

    def __init__(self, robot: RollingRobot, model: mujoco.MjModel) -> None:
        self._joint, self._rod = rolling_kernel.pack(rolling_chain(robot))
        ids = _joint_ids(robot, model)
        self._qpos = model.jnt_qposadr[ids].astype(np.int64)
        self._dofs = model.jnt_dofadr[ids].astype(np.int64)

    def arrays(self) -> tuple[Array, Array, rolling_kernel.Index]:
        """Return `joint` and `rod` of `rolling_kernel.pack`, and the hinges' degrees of freedom."""
        return self._joint, self._rod, self._dofs

    def apply(self, data: mujoco.MjData) -> None:
        """Add the moments to `data.qfrc_applied`."""
        rolling_kernel.resist(data.qpos, self._qpos, self._joint, self._rod, self._dofs, data.qfrc_applied)

    def apply_copies(self, copies: rolling_kernel.Index, qpos: Array, applied: Array) -> None:
        """`apply` to some of m copies: positions (m, nq), applied forces (m, nv)."""
        rolling_kernel.resist_copies(copies, qpos, self._qpos, self._joint, self._rod, self._dofs, applied)


class RodTurns:
    """The angles by which the pulled rods turn in the links (chest_tube_2025, Eqs 2-4)."""

    def __init__(self, robot: RollingRobot, model: mujoco.MjModel) -> None:
        chain = rolling_chain(robot)
        self._joint, self._rod = rolling_kernel.pack(chain)
        self._ends = chain.last.astype(np.int64)
        self._qpos = model.jnt_qposadr[_joint_ids(robot, model)].astype(np.int64)
        self._hole = rolling_kernel.pack_holes(chain)
        self._turn = np.zeros((chain.pulled, chain.joints))
        self._bent = np.zeros((7, chain.joints))

    def arrays(self) -> tuple[Array, Array, rolling_kernel.Index]:
        """Return `joint` and `rod` of `rolling_kernel.pack`, and where the hinges' angles are."""
        return self._joint, self._rod, self._qpos

    def __call__(self, data: mujoco.MjData, ends: rolling_kernel.Index | None = None) -> Array:
        """Return the turn before each gap, shape (t, n) [rad], in a reused array.

        That is the turn in the link below; none in the base, and none beyond a rod's end.

        Args:
            data: the state.
            ends: of each rod the gaps that matter, 0 where none does; default: all, shape (t,).
        """
        last = self._ends if ends is None else ends
        rolling_kernel.turns(data.qpos, self._qpos, self._joint, self._hole, last, self._turn, self._bent)
        return self._turn

    def of_copies(self, copies: rolling_kernel.Index, qpos: Array, site_xpos: Array, turn: Array) -> None:
        """Write the turns of some of m copies into `turn`, (m, t, n); see `tendon_spans.Turns.of_copies`."""
        rolling_kernel.turns_of(
            copies, qpos, self._qpos, self._joint, self._hole, self._ends, turn, self._bent
        )
