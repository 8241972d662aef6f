"""The simulator's capstan friction of all copies."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from catheter_sim.gpu import friction_kernel, rolling_kernel
from catheter_sim.gpu.device import Copies, Idle
from catheter_sim.gpu.drive import Drive
from catheter_sim.simulation.friction import SWEEP_TOLERANCE, SWEEPS, CapstanFriction
from catheter_sim.simulation.rolling import RodTurns
from catheter_sim.simulation.tendon_spans import PairTurns


class Friction(Idle):
    """`simulation.friction.CapstanFriction` in every copy.

    Attributes:
        tension: of every tendon in every span, shape (m, t, n) [N].
    """

    def __init__(
        self,
        copies: Copies,
        model: mujoco.MjModel,
        law: CapstanFriction,
        drive: Drive,
        joints_change: bool,
    ) -> None:
        """Prepare the law.

        Args:
            copies: where it runs.
            model: MuJoCo's.
            law: the simulator's own.
            drive: what knows the tensions at the actuators; it must go first.
            joints_change: whether the copies' joints change their stiffness on the way.
        """
        self._copies, self._drive, self._joints_change = copies, drive, joints_change
        layout, wp = law.layout(), copies.wp
        spans, tendons, nv = layout.spans, len(layout.ends), model.nv
        self._ends = copies.whole(layout.ends)
        self.tension = copies.room(tendons, spans)
        self._turn = copies.room(tendons, spans)
        self._yielding = copies.each(layout.yielding)
        rows = layout.starts, layout.entries, layout.dofs, layout.span
        self._fixed = [wp.float64(layout.mu), self._ends, *(copies.whole(item) for item in rows)]
        self._fixed += [SWEEPS, wp.float64(SWEEP_TOLERANCE)]
        sizes = [(tendons, spans), (tendons, spans), (spans,), (nv,), (spans,)]
        sizes += [(2 * spans,), (2 * spans,), (spans,), (tendons,), (2 * tendons + 4 + nv, tendons)]
        self._room = [copies.room(*size) for size in sizes]
        timestep = wp.float64(model.opt.timestep)
        self._joints = [timestep, copies.whole(model.jnt_dofadr)]
        self._joints += [copies.real(model.dof_armature), copies.real(model.dof_damping)]
        self._find_turns = self._turns(layout.turns)

    def before(self) -> None:
        """Take over the stiffness of the joints where it has changed."""
        if self._joints_change:
            stiffness = self._copies.model.jnt_stiffness
            shape = (stiffness.shape[1],)
            kernel = friction_kernel.know_joints
            self._copies.launch(kernel, shape, *self._joints, stiffness, self._yielding)

    def between(self) -> None:
        """Add what friction changes."""
        copies, data, drive = self._copies, self._copies.data, self._drive
        kernel, shape, arguments = self._find_turns
        copies.launch(kernel, shape, *arguments, self._turn)
        state = data.ten_J, data.qvel, data.qfrc_passive, data.qfrc_bias, data.qfrc_constraint
        inputs = *self._fixed, drive.entering, drive.drive, self._turn, self._yielding, *state
        copies.launch(friction_kernel.confine, (), *inputs, self.tension, *self._room, data.qfrc_applied)

    def reset(self) -> None:
        """Forget the history."""
        self.tension.zero_()

    def _turns(self, turns: Any) -> tuple[Any, tuple[int, ...], list[Any]]:
        """Return the kernel that finds the turns, its shape, and its arguments but the last."""
        copies, data = self._copies, self._copies.data
        if isinstance(turns, RodTurns):
            joint, rod, qpos = turns.arrays()
            arguments = [data.qpos, copies.whole(qpos), copies.real(joint), copies.real(rod), self._ends]
            return rolling_kernel.turns, (len(qpos) - 1,), arguments
        if isinstance(turns, PairTurns):
            pairs = len(turns.gaps)
            gaps = np.zeros((pairs, max(len(own) for own in turns.gaps)))
            passes = np.zeros((pairs, pairs))
            for pair, own in enumerate(turns.gaps):
                gaps[pair, : len(own)] = own
                passes[pair, turns.before[pair]] = 1
            path = copies.wp.float64(turns.path_rad)
            arguments = [path, data.qpos, copies.whole(gaps), self._ends, copies.whole(passes)]
            return friction_kernel.pair_turns, (pairs,), arguments
        if turns.planar:
            return friction_kernel.planar_turns, (), [data.qpos, copies.whole(turns.joints)]
        arguments = [data.site_xpos, copies.whole(turns.sites), self._ends]
        return friction_kernel.spatial_turns, (len(turns.sites),), arguments
