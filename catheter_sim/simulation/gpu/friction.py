"""The simulator's capstan friction of all copies."""

from __future__ import annotations

import mujoco

from catheter_sim.mechanics.device import Copies, DeviceLaw, TurnsKernel
from catheter_sim.simulation.friction import SWEEP_TOLERANCE, SWEEPS, CapstanFriction
from catheter_sim.simulation.gpu import friction_kernel
from catheter_sim.simulation.gpu.drive import Drive


class Friction(DeviceLaw):
    """`simulation.friction.CapstanFriction` in every copy.

    Attributes:
        tension: of every tendon in every span, shape (m, t, n) [N].
        ends: number of spans of each tendon.
        joints_change: whether the copies' joints change their stiffness on the way.
        find_turns: what finds the turns; to be set before the first step.
    """

    joints_change: bool
    find_turns: TurnsKernel

    def __init__(
        self,
        copies: Copies,
        model: mujoco.MjModel,
        law: CapstanFriction,
        drive: Drive,
    ) -> None:
        """Prepare the law.

        Args:
            copies: where it runs.
            model: MuJoCo's.
            law: the simulator's own.
            drive: what knows the tensions at the actuators; it must go first.
        """
        self._copies, self._drive = copies, drive
        layout, wp = law.layout(), copies.wp
        spans, tendons, nv = layout.spans, len(layout.ends), model.nv
        self.ends = copies.whole(layout.ends)
        self.tension = copies.room(tendons, spans)
        self._turn = copies.room(tendons, spans)
        self._yielding = copies.each(layout.yielding)
        rows = layout.starts, layout.entries, layout.dofs, layout.span
        self._fixed = [wp.float64(layout.mu), self.ends, *(copies.whole(item) for item in rows)]
        self._fixed += [SWEEPS, wp.float64(SWEEP_TOLERANCE)]
        sizes = [(tendons, spans), (tendons, spans), (spans,), (nv,), (spans,)]
        sizes += [(2 * spans,), (2 * spans,), (spans,), (tendons,), (2 * tendons + 4 + nv, tendons)]
        self._room = [copies.room(*size) for size in sizes]
        timestep = wp.float64(model.opt.timestep)
        self._joints = [timestep, copies.whole(model.jnt_dofadr)]
        self._joints += [copies.real(model.dof_armature), copies.real(model.dof_damping)]

    def before(self) -> None:
        """Take over the stiffness of the joints where it has changed."""
        if self.joints_change:
            stiffness = self._copies.model.jnt_stiffness
            shape = (stiffness.shape[1],)
            kernel = friction_kernel.know_joints
            self._copies.launch(kernel, shape, *self._joints, stiffness, self._yielding)

    def between(self) -> None:
        """Add what friction changes."""
        copies, data, drive = self._copies, self._copies.data, self._drive
        kernel, shape, arguments = self.find_turns
        copies.launch(kernel, shape, *arguments, self._turn)
        state = data.ten_J, data.qvel, data.qfrc_passive, data.qfrc_bias, data.qfrc_constraint
        inputs = *self._fixed, drive.entering, drive.drive, self._turn, self._yielding, *state
        copies.launch(
            friction_kernel.solve_tensions, (), *inputs, self.tension, *self._room, data.qfrc_applied
        )

    def reset(self) -> None:
        """Forget the history."""
        self.tension.zero_()
