"""What pulls the tendons of all copies, as the simulator's actuators do."""

from __future__ import annotations

import mujoco
import numpy as np

from catheter_sim.core.law import Pulls
from catheter_sim.mechanics.device import Copies, DeviceLaw
from catheter_sim.mechanics.slack import clamp_of_slack
from catheter_sim.simulation.gpu import drive_kernel


class Drive(DeviceLaw):
    """The tendons' actuators: tensions that are given, or springs that only pull.

    Attributes:
        entering: tensions at the actuators, below zero where a driven tendon is slack, shape (m, k) [N].
        drive: what they grow by per unit of the rate of lengthening in one step, shape (m, k) [N s/m].
    """

    def __init__(self, copies: Copies, model: mujoco.MjModel, pulls: Pulls) -> None:
        """Prepare.

        Args:
            copies: where it runs.
            model: MuJoCo's.
            pulls: the simulator's.
        """
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
