"""The laws of a simulator for its copies on a device, in the order of their turns; friction comes last."""

from __future__ import annotations

import importlib.util
from typing import Any

import mujoco
import numpy as np

from catheter_sim.core.law import Pulls
from catheter_sim.errors import InputError
from catheter_sim.gpu.batch_kernels import (
    MotionOnDevice,
    RoomOnDevice,
    TendonsOnDevice,
    given,
    know_joints,
    slacken,
    solve_tensions,
)
from catheter_sim.gpu.device import DeviceCopies, DeviceLaw, Gpu, TurnsKernel
from catheter_sim.mechanics.hysteresis import clamp_of_slack
from catheter_sim.robots import kind_of
from catheter_sim.simulation.friction import SWEEP_TOLERANCE, SWEEPS, CapstanFriction
from catheter_sim.simulation.simulator import Simulator

# ----------------------------------------------------------------------------------------------------
# What pulls the tendons of all copies, as the simulator's actuators do.


class DeviceDrive(DeviceLaw):
    """The tendons' actuators: tensions that are given, or springs that only pull.

    Attributes:
        entering: tensions at the actuators, below zero where a driven tendon is slack, shape (m, k) [N].
        drive: what they grow by per unit of the rate of lengthening in one step, shape (m, k) [N s/m].
    """

    def __init__(self, copies: DeviceCopies, model: mujoco.MjModel, pulls: Pulls) -> None:
        """Prepare for MuJoCo's model and the simulator's pulls."""
        self._copies, self._driven = copies, not pulls.given
        tendons = len(pulls.actuators)
        self.entering, self.drive = copies.room(tendons), copies.room(tendons)
        self._shape = (tendons,)
        self._pulls, self._tendons = copies.whole(pulls.actuators), copies.whole(pulls.tendons)
        self._before = copies.room(tendons, dtype=float)
        if self._driven:
            self._clamp = copies.own("actuator_forcerange")
            self._timestep = copies.wp.float64(model.opt.timestep)
            self._unlimited = float(clamp_of_slack(np.array([-1.0]))[0])

    def between(self) -> None:
        """Find the tensions; let driven tendons that were taut slacken without a clamp."""
        copies, data = self._copies, self._copies.data
        if not self._driven:
            copies.launch(given, self._shape, self._pulls, data.ctrl, self.entering)
            return
        model = copies.model
        fixed = self._timestep, self._unlimited, self._pulls, self._tendons
        fields = model.actuator_gainprm, model.actuator_biasprm, data.ten_length, data.ctrl, self._before
        copies.launch(slacken, self._shape, *fixed, *fields, self._clamp, self.entering, self.drive)

    def reset(self) -> None:
        """Forget the controls."""
        self._before.zero_()


# ----------------------------------------------------------------------------------------------------
# The simulator's capstan friction of all copies.


class DeviceFriction(DeviceLaw):
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
        copies: DeviceCopies,
        model: mujoco.MjModel,
        law: CapstanFriction,
        drive: DeviceDrive,
    ) -> None:
        """Prepare for the simulator's own law; `drive`, which must go first, knows the pulls."""
        self._copies, self._drive = copies, drive
        rows, wp = law.tendons, copies.wp
        spans, tendons, nv = law.spans, len(rows.ends), model.nv
        self.ends = copies.whole(rows.ends)
        self.tension = copies.room(tendons, spans)
        self._turn = copies.room(tendons, spans)
        self._yielding = copies.each(law.yielding)
        places = rows.row_start, rows.entry, rows.dof, rows.span
        sizes = [(tendons, spans), (tendons, spans), (spans,), (nv,), (spans,)]
        sizes += [(2 * spans,), (2 * spans,), (spans,), (tendons,), (2 * tendons + 4 + nv, tendons)]
        data = copies.data
        forces = data.qfrc_passive, data.qfrc_bias, data.qfrc_constraint
        self._fixed = [
            wp.float64(law.mu),
            SWEEPS,
            wp.float64(SWEEP_TOLERANCE),
            copies.filled(TendonsOnDevice, self.ends, *(copies.whole(item) for item in places)),
            copies.filled(RoomOnDevice, *(copies.room(*size) for size in sizes)),
            copies.filled(MotionOnDevice, data.ten_J, data.qvel, *forces),
        ]
        timestep = wp.float64(model.opt.timestep)
        self._joints = [timestep, copies.whole(model.jnt_dofadr)]
        self._joints += [copies.real(model.dof_armature), copies.real(model.dof_damping)]

    def before(self) -> None:
        """Take over the stiffness of the joints where it has changed."""
        if self.joints_change:
            stiffness = self._copies.model.jnt_stiffness
            shape = (stiffness.shape[1],)
            kernel = know_joints
            self._copies.launch(kernel, shape, *self._joints, stiffness, self._yielding)

    def between(self) -> None:
        """Add what friction changes."""
        copies, data, drive = self._copies, self._copies.data, self._drive
        kernel, shape, arguments = self.find_turns
        copies.launch(kernel, shape, *arguments, self._turn)
        inputs = *self._fixed, drive.entering, drive.drive, self._turn, self._yielding
        copies.launch(solve_tensions, (), *inputs, self.tension, data.qfrc_applied)

    def reset(self) -> None:
        """Forget the history."""
        self.tension.zero_()


# ----------------------------------------------------------------------------------------------------
# The laws of a simulator for its copies on a device, in the order of their turns; friction comes last.


def laws_of(simulator: Simulator, copies: DeviceCopies) -> list[DeviceLaw]:
    """Return the laws of a simulator, at rest, for its copies.

    Raises:
        InputError: its kind has no laws for a device.
    """
    robot, place = simulator.robot, simulator.place
    package = f"{__package__}.{kind_of(robot).package.rpartition('.')[2]}"
    if importlib.util.find_spec(package) is None:
        what = f"no simulation on MuJoCo Warp for robots of kind {kind_of(robot).name!r}"
        raise InputError(f"{robot.name}: {what}")
    face: Gpu[Any] = importlib.import_module(package)
    drive = DeviceDrive(copies, simulator.model, simulator.pulls)
    friction: DeviceFriction | None = None
    if isinstance(simulator.laws.friction, CapstanFriction):
        friction = DeviceFriction(copies, simulator.model, simulator.laws.friction, drive)
        friction.find_turns = face.turns(robot, place, copies, friction.ends)
    tension = None if friction is None else friction.tension
    laws = list(face.laws(robot, place, copies, drive, tension))
    changed = any(law.changes_joints for law in laws)
    if friction is not None or not simulator.pulls.given:
        laws.append(drive)
    if friction is not None:
        friction.joints_change = changed
        laws.append(friction)
    return laws
