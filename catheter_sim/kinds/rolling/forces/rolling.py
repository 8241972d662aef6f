"""Rolling: keeps the hinges of a model at the contacts of its joints.

With the arc's radius R (that of the side it leans to) and the bend angle theta, the contact
lies at line + R theta on the flat below and at (line + R sin theta, R (1 - cos theta)) in the link's
own frame; a link hung there on a hinge must be shifted by (R (theta - sin theta), -R (1 - cos theta))
against the flat for the hinge to put it where pure rolling does. See `catheter_sim.kinds.rolling.mjcf.chain`.

What runs at every step is compiled, in `rolling_kernel`.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from catheter_sim.arrays import Array, Index
from catheter_sim.core.law import Law, RobotInModel, Step
from catheter_sim.core.law_copies import CopiesLaw, CopyArrays
from catheter_sim.kinds.rolling.forces import rolling_kernel
from catheter_sim.kinds.rolling.forces.rods import RodElasticity, joint_ids
from catheter_sim.kinds.rolling.forces.rolling_pack import pack
from catheter_sim.kinds.rolling.layout import last_joint, rods, rolling_joints
from catheter_sim.kinds.rolling.spec import RollingRobot
from catheter_sim.kinds.rolling.theory.chain import rolling_chain


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

    axis: Index
    joint_index: Index
    body_index: Index
    qpos_index: Index
    ends: Index
    length: Array
    compliance: Array
    top_link: Index
    top_site: Index
    top_depth: Array


class Rolling(Law):
    """Keeps the hinges of a model at the contacts of its rolling joints.

    Attributes:
        compressible: whether any link gives way along its axis.
    """

    def __init__(self, robot: RollingRobot, place: RobotInModel) -> None:
        self._model = model = place.model
        chain = rolling_chain(robot)
        joints = rolling_joints(robot)
        self._constants, _ = pack(chain)
        self._axis = chain.axis.astype(np.int64)
        self._joint = joint_ids(robot, place)
        self._body = np.array([place.body(f"link_{joint.index}").id for joint in joints], dtype=np.int64)
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
        self._top_site = np.array([place.site(name).id for _, name in tops], dtype=np.int64)
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

    def before(self, step: Step) -> None:
        """Shorten the links as they are pressed together."""
        if self.compressible:
            self.compress(step.data, step.span_tension(), step.force_tip, step.force_on_element)

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

    def place_copies(self, copies: Index, qpos: Array, jnt_pos: Array, body_pos: Array) -> None:
        """`place` in some of m copies of the model, without compression.

        Args:
            copies: which.
            qpos: all positions, shape (m, nq).
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
            force_tip: on the tip, world frame, shape (3,) [N].
            force_on_link: other forces on each link, world frame, shape (n, 3) [N].
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


class RollingCopies(CopiesLaw):
    """Rolling, without compression, and the rods' elasticity in many copies."""

    def __init__(self, rolling: Rolling, rods: RodElasticity, arrays: CopyArrays) -> None:
        self._rolling, self._rods, self._arrays = rolling, rods, arrays
        self._hinges, self._links = arrays.own("jnt_pos"), arrays.own("body_pos")
        self.moved = {"jnt_pos": self._hinges, "body_pos": self._links}

    def place(self, copies: Index) -> None:
        """Put hinges and links where pure rolling has them."""
        self._rolling.place_copies(copies, self._arrays.qpos, self._hinges, self._links)

    def between(self, copies: Index) -> None:
        """Add the moments with which rods and sleeve resist bending."""
        self._rods.add_to_copies(copies, self._arrays.qpos, self._arrays.applied)
