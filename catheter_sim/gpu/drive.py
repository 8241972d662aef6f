"""What pulls the tendons of all copies and turns their torsion joints, as the simulator's actuators do."""

from __future__ import annotations

import mujoco
import numpy as np

from catheter_sim.gpu import drive_kernel
from catheter_sim.gpu.device import Copies, Idle
from catheter_sim.simulation.catheter import CatheterDrive
from catheter_sim.simulation.simulator import Parts, clamp_of_slack


class Drive(Idle):
    """The tendons' actuators: tensions that are given, or springs that only pull.

    Attributes:
        entering: tensions at the actuators, below zero where a driven tendon is slack, shape (m, k) [N].
        drive: what they grow by per unit of the rate of lengthening in one step, shape (m, k) [N s/m].
    """

    def __init__(self, copies: Copies, model: mujoco.MjModel, parts: Parts, driven: bool) -> None:
        """Prepare.

        Args:
            copies: where it runs.
            model: MuJoCo's.
            parts: of the simulator.
            driven: whether displacements are the inputs.
        """
        self._copies, self._driven = copies, driven
        tendons = len(parts.pulls)
        self.entering, self.drive = copies.room(tendons), copies.room(tendons)
        self._shape = (tendons,)
        self._pulls, self._tendons = copies.whole(parts.pulls), copies.whole(parts.tendons)
        self._before = copies.room(tendons, dtype=float)
        if driven:
            self._clamp = copies.own("actuator_forcerange")
            self._timestep = copies.wp.float64(model.opt.timestep)
            self._unlimited = float(clamp_of_slack(np.array([-1.0]))[0])

    def between(self) -> None:
        """Find the tensions; let driven tendons that were taut slacken without a clamp."""
        copies, data = self._copies, self._copies.data
        if not self._driven:
            copies.launch(drive_kernel.given, self._shape, self._pulls, data.ctrl, self.entering)
            return
        model = copies.model
        fixed = self._timestep, self._unlimited, self._pulls, self._tendons
        fields = model.actuator_gainprm, model.actuator_biasprm, data.ten_length, data.ctrl, self._before
        copies.launch(
            drive_kernel.slacken, self._shape, *fixed, *fields, self._clamp, self.entering, self.drive
        )

    def reset(self) -> None:
        """Forget the controls."""
        self._before.zero_()


class Torsion(Idle):
    """The torsion joints' pairs."""

    def __init__(self, copies: Copies, drive: CatheterDrive) -> None:
        self._copies, pairs = copies, drive.torsion_arrays()
        self._shape = pairs.actuators.shape
        self._fixed = [copies.whole(pairs.actuators), copies.whole(pairs.qpos)]
        numbers = pairs.radius, pairs.height, pairs.wrap, pairs.home, pairs.stiffness, pairs.gain
        self._fixed += [copies.real(item) for item in numbers]
        self._bias = copies.own("actuator_biasprm")

    def before(self) -> None:
        """Make the joints' actuators the tangents of their pairs."""
        data = self._copies.data
        self._copies.launch(
            drive_kernel.turn_pairs, self._shape, *self._fixed, data.qpos, data.ctrl, self._bias
        )
