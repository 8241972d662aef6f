"""Runs a written file in MuJoCo alone: what somebody sees who has the file and nothing of this package.

Positions are read from the file's own sensors `position_<k>`, as an observer has them.
"""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.progress import counted

RAMP_S = 1.0  # simulated time from one held row to the next
LONGEST_REST_S = 1.0  # that is then waited for rest
_LOOK_S = 0.05
_REST_RAD_PER_S = 2e-3


class PlainRun:
    """A file in MuJoCo, from rest with zero inputs.

    Attributes:
        model, data: MuJoCo's.
        shares: the control of each actuator for the inputs, shape (nu, t): ctrl = shares @ inputs.
    """

    def __init__(self, text: str, shares: Array) -> None:
        """Load the file's text."""
        self.model = mujoco.MjModel.from_xml_string(text)
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET  # what diverges is to be seen
        self.model.actuator_ctrllimited[:] = 0
        self.data = mujoco.MjData(self.model)
        self.shares = shares
        names = [self.model.sensor(k).name for k in range(self.model.nsensor)]
        self._places = [self.model.sensor(name).adr[0] for name in names if name.startswith("position_")]
        if self.model.nkey:
            mujoco.mj_resetDataKeyframe(self.model, self.data, 0)

    def positions(self) -> Array:
        """Return where the elements' faces are seen, base to tip, shape (n, 3) [m]."""
        mujoco.mj_forward(self.model, self.data)
        return np.array([self.data.sensordata[place : place + 3] for place in self._places])

    def held(
        self,
        inputs: Array,
        progress: bool = False,
        on_row: Callable[[int], None] | None = None,
        ramp_s: float = RAMP_S,
    ) -> Array:
        """Return the positions at rest under rows of inputs, each approached slowly.

        Args:
            inputs: shape (r, t), SI.
            progress: show on standard error how many rows are done.
            on_row: called with the row's index when it is reached.
            ramp_s: simulated time from one row to the next [s].

        Returns:
            Shape (r, n, 3) [m]; NaN from the row on in which the motion diverges.
        """
        controls = inputs @ self.shares.T
        found = np.full((len(inputs), len(self._places), 3), np.nan)
        before = np.zeros(controls.shape[1])
        steps = max(1, round(ramp_s / self.model.opt.timestep))
        for row in counted(range(len(inputs)), len(inputs), "replaying", "row", progress):
            for step in range(1, steps + 1):
                share = 1.0 - (1.0 - step / steps) ** 3
                self.data.ctrl[:] = before + (controls[row] - before) * share
                mujoco.mj_step(self.model, self.data)
            self._rest()
            if not np.isfinite(self.data.qpos).all():
                break
            found[row] = self.positions()
            if on_row is not None:
                on_row(row)
            before = controls[row]
        return found

    def _rest(self) -> None:
        """Wait until next to nothing moves, or for so long."""
        block = max(1, round(_LOOK_S / self.model.opt.timestep))
        for _ in range(round(LONGEST_REST_S / _LOOK_S)):
            mujoco.mj_step(self.model, self.data, block)
            if not np.abs(self.data.qvel).max(initial=0.0) > _REST_RAD_PER_S:
                return

    def followed(self, time_s: Array, inputs: Array) -> Array:
        """Return the positions in motion along rows of inputs, shape (r, n, 3) [m].

        The motion begins at rest under the first row.

        Args:
            time_s: strictly increasing, shape (r,).
            inputs: straight from row to row, shape (r, t), SI.
        """
        controls = inputs @ self.shares.T
        found = np.full((len(inputs), len(self._places), 3), np.nan)
        self.held(inputs[:1])
        found[0] = self.positions()
        start = self.data.time - time_s[0]
        for row in range(1, len(inputs)):
            while self.data.time < start + time_s[row] - 0.5 * self.model.opt.timestep:
                share = np.clip(
                    (self.data.time - start - time_s[row - 1]) / (time_s[row] - time_s[row - 1]), 0.0, 1.0
                )
                self.data.ctrl[:] = controls[row - 1] + share * (controls[row] - controls[row - 1])
                mujoco.mj_step(self.model, self.data)
            found[row] = self.positions()
        return found
