"""What a robot of rolling joints needs beside its MuJoCo model: rolling, elastic rods, turns.

Rolling. With the arc's radius R (that of the side it leans to) and the bend angle theta, the contact
lies at line + R theta on the flat below and at (line + R sin theta, R (1 - cos theta)) in the link's
own frame; a link hung there on a hinge must be shifted by (R (theta - sin theta), -R (1 - cos theta))
against the flat for the hinge to put it where pure rolling does. See `catheter_sim.mjcf.rolling`.
"""

from __future__ import annotations

import mujoco
import numpy as np

from catheter_sim.robots.posture import Array
from catheter_sim.robots.rolling import RollingRobot
from catheter_sim.robots.rolling_layout import last_joint, rods, rolling_joints
from catheter_sim.statics.rolling.chain import rolling_chain
from catheter_sim.statics.rolling.joint import active_radius
from catheter_sim.statics.rolling.rods import elastic_moments, spans, turns


class Rolling:
    """Keeps the hinges of a model at the contacts of its rolling joints.

    Attributes:
        compressible: whether any link gives way along its axis.
    """

    def __init__(self, robot: RollingRobot, model: mujoco.MjModel) -> None:
        self._model = model
        self._chain = rolling_chain(robot)
        joints = rolling_joints(robot)
        self._joint = np.array([model.joint(joint.name).id for joint in joints])
        self._body = np.array([model.body(f"link_{joint.index}").id for joint in joints])
        self._qpos = model.jnt_qposadr[self._joint]
        self._length = self._chain.link_length.copy()
        self._compliance = 1.0 / self._chain.link_stiffness
        self.compressible = bool((self._compliance > 0.0).any())
        tops = [(joint.index, f"face_{joint.index}") for joint in joints] + [(joints[-1].index, "tip")]
        tops += [
            (k, f"hole_{rod.name}_{k}") for rod in rods(robot) for k in range(1, last_joint(robot, rod) + 1)
        ]
        self._top_link = np.array([k - 1 for k, _ in tops])
        self._top_site = np.array([model.site(name).id for _, name in tops])
        self._top_depth = self._length[self._top_link] - model.site_pos[self._top_site, 2]

    def reset(self) -> None:
        """Give the links their own lengths back."""
        self._length[:] = self._chain.link_length
        self._model.site_pos[self._top_site, 2] = self._length[self._top_link] - self._top_depth

    def place(self, data: mujoco.MjData) -> None:
        """Put hinges and links where pure rolling has them at the present angles."""
        chain, model = self._chain, self._model
        theta = data.qpos[self._qpos]
        radius = active_radius(theta, chain.radius_positive, chain.radius_negative)
        sine, rise = np.sin(theta), radius * (1.0 - np.cos(theta))
        model.jnt_pos[self._joint, chain.axis] = chain.line + radius * sine
        model.jnt_pos[self._joint, 2] = rise
        model.body_pos[self._body, chain.axis] = radius * (theta - sine)
        model.body_pos[self._body, 2] = -rise
        model.body_pos[self._body[1:], 2] += self._length[:-1]

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
        tension = np.nan_to_num(span_tension).sum(axis=0)
        inside = 0.5 * (tension + np.append(tension[1:], tension[-1]))
        own = self._model.body_mass[self._body][:, np.newaxis] * self._model.opt.gravity + force_on_link
        beyond = np.cumsum(own[::-1], axis=0)[::-1] + force_tip
        along = data.xmat[self._body].reshape(-1, 3, 3)[:, :, 2]
        pressed = inside - np.einsum("nk,nk->n", along, beyond)
        self._length[:] = self._chain.link_length - pressed * self._compliance
        self._model.site_pos[self._top_site, 2] = self._length[self._top_link] - self._top_depth


class RodElasticity:
    """The moments with which rods and sleeve resist bending (chest_tube_2025, Eq. 8)."""

    needed = True

    def __init__(self, robot: RollingRobot, model: mujoco.MjModel) -> None:
        self._chain = rolling_chain(robot)
        names = [joint.name for joint in rolling_joints(robot)]
        self._qpos = np.array([model.joint(name).qposadr[0] for name in names])
        self._dofs = np.array([model.joint(name).dofadr[0] for name in names])

    def apply(self, data: mujoco.MjData) -> None:
        """Add the moments to `data.qfrc_applied`."""
        theta = np.clip(data.qpos[self._qpos], self._chain.low, self._chain.high)
        moment, _ = elastic_moments(self._chain, theta, spans(self._chain, theta))
        data.qfrc_applied[self._dofs] -= moment


class RodTurns:
    """The angles by which the pulled rods turn in the links (chest_tube_2025, Eqs 2-4)."""

    def __init__(self, robot: RollingRobot, model: mujoco.MjModel) -> None:
        self._chain = rolling_chain(robot)
        names = [joint.name for joint in rolling_joints(robot)]
        self._qpos = np.array([model.joint(name).qposadr[0] for name in names])
        self._turn = np.zeros((self._chain.pulled, self._chain.joints))

    def __call__(self, data: mujoco.MjData) -> Array:
        """Return the turn before each gap, shape (t, n) [rad]: that in the link below; none in the base."""
        angle, _ = turns(self._chain, data.qpos[self._qpos])
        self._turn[:, 1:] = np.abs(angle[: self._chain.pulled, :-1])
        return self._turn
