"""Copies of one robot stepped together by MuJoCo Warp, with the laws of the simulator."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from catheter_sim.arrays import Array
from catheter_sim.channels import actuations
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, SimulationDiverged, unknown
from catheter_sim.gpu.device import DeviceCopies, find_device, require_warp
from catheter_sim.simulation.motion import LARGEST_INPUT, farthest
from catheter_sim.simulation.simulator import Simulator

_ROWS = 64  # of constraints at least; the same for all robots, so that the same kernels serve them
# What a step reads of the one before, besides the laws' own histories.
_STATE: tuple[str, ...] = ("qpos", "qvel", "time", "ctrl", "xmat", "qacc_warmstart")
_STATE += tuple(f"qfrc_{kind}" for kind in ("applied", "constraint", "smooth", "passive", "actuator"))


class WarpBatch:
    """Copies of a robot under inputs of their own, without forces from outside but gravity.

    The model is the simulator's own, and so are the laws that it adds to its step (`gpu.batch`).
    MuJoCo Warp computes in single precision, the laws in double.

    Attributes:
        copies: how many.
        device: Warp's name of where they are, as "cuda:0" or "cpu".
    """

    def __init__(
        self,
        robot: RobotSpec,
        copies: int,
        device: str | None = None,
        gravity_mps2: ArrayLike = (0.0, 0.0, 0.0),
        actuation: str | None = None,
    ) -> None:
        """Put the copies on the device, at rest; the first step compiles, which takes minutes, once.

        Args:
            robot: of any kind; such of its `effects` as act on the robot itself are built in.
            copies: at least 1.
            device: default: a GPU where there is one.
            gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
            actuation: "tension" or "displacement"; default: the robot's own.

        Raises:
            InputError: MuJoCo Warp is not installed, the device or the actuation does not exist, or an
                effect acts on inputs or outputs.
        """
        if copies < 1:
            raise InputError(f"copies = {copies}: at least 1 is needed")
        actuation = actuation or robot.actuation
        if actuation not in actuations(robot):
            raise unknown("actuation", actuation, actuations(robot))
        self._mjw, self._wp = require_warp()
        simulator = Simulator(robot, actuation, gravity_mps2)
        self.copies, self.robot = copies, simulator.robot
        self._model = simulator.model
        self._farthest = farthest(simulator.place)
        # MuJoCo Warp never resets a state by itself, and refuses the flag that says so.
        self._model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
        self._device = find_device(self._wp, device)
        self.device = str(self._device)
        with self._wp.ScopedDevice(self._device):
            self._warp_model = self._mjw.put_model(self._model)
            rows = int(self._model.jnt_limited.sum() + self._model.tendon_limited.sum())
            self._data = self._mjw.put_data(
                self._model, simulator.data, nworld=copies, njmax=max(rows, _ROWS), nconmax=0
            )
            place = DeviceCopies(self._wp, copies, self._warp_model, self._data)
            from catheter_sim.gpu.laws import laws_of  # its kernels need Warp, which is an extra

            self._laws = laws_of(simulator, place)
        if self._laws:
            self._warp_model.callback.control = self._between
        self._controls = simulator.controls
        self._start = {name: getattr(self._data, name).numpy().copy() for name in _STATE}
        self._ctrl = self._start["ctrl"].copy()
        self._arrived = np.zeros((copies, len(robot.tendons)))

    def reset(self) -> None:
        """Return all copies to rest, without inputs and history."""
        for name, value in self._start.items():
            getattr(self._data, name).assign(value)
        self._arrived = np.zeros_like(self._arrived)
        for law in self._laws:
            law.reset()

    def set_inputs(self, tendon: Array) -> None:
        """Set the tensions [N] or displacements [m] of the following steps, shape (copies, t).

        A catheter's displacements pass through their pairs' plays.

        Raises:
            InputError: another shape, a catheter's displacement beyond its joint's range, or an input
                that MuJoCo does not take (`LARGEST_INPUT`).
        """
        wanted = (self.copies, len(self.robot.tendons))
        if np.shape(tendon) != wanted:
            raise InputError(f"inputs of shape {np.shape(tendon)}: {wanted} is needed (copies, tendons)")
        controls = np.asarray(tendon, dtype=float)
        if not (np.abs(controls) <= LARGEST_INPUT).all():
            raise InputError(f"{self.robot.name}: an input is not finite, or beyond {LARGEST_INPUT:g}")
        self._arrived = self._controls.arriving(self._arrived, controls)
        self._ctrl[:, self._controls.actuators] = self._controls.controls(self._arrived)
        self._data.ctrl.assign(self._ctrl)

    def step(self, count: int = 1) -> None:
        """Take `count` steps."""
        with self._wp.ScopedDevice(self._device):
            for _ in range(count):
                self._step()

    def repeated(self, count: int) -> Callable[[], None]:
        """Return what takes `count` steps, compiled: on a GPU a graph, recorded here once.

        The steps that compiling takes have been taken when this returns.
        """
        self.step(1)
        if not self._device.is_cuda:
            return partial(self.step, count)
        with self._wp.ScopedDevice(self._device), self._wp.ScopedCapture() as capture:
            for _ in range(count):
                self._step()
        return partial(self._wp.capture_launch, capture.graph)

    def synchronise(self) -> None:
        """Wait until the device has done what it was asked for."""
        self._wp.synchronize_device(self._device)

    def qpos(self) -> Array:
        """Return MuJoCo's positions of all copies, shape (copies, nq).

        Raises:
            SimulationDiverged: see `require_finite`.
        """
        value = self._data.qpos.numpy().astype(np.float64)
        diverged = np.flatnonzero(~(np.abs(value) <= self._farthest).all(axis=1))
        if len(diverged):
            time_s = float(self._data.time.numpy()[diverged[0]])
            raise SimulationDiverged(
                f"{self.robot.name}: the simulation on MuJoCo Warp diverged within {time_s:.3f} simulated "
                f"seconds, in {len(diverged)} of {self.copies} copies: the first is {diverged[0]}"
            )
        return value

    def require_finite(self) -> None:
        """Raise `SimulationDiverged` if a copy's position is not finite or beyond what a robot can reach."""
        self.qpos()

    def tips(self) -> Array:
        """Return the tips at the start of the last step, base frame, shape (copies, 3) [m].

        Raises:
            SimulationDiverged: see `require_finite`.
        """
        self.require_finite()
        site = int(self._model.site("tip").id)
        return self._data.site_xpos.numpy()[:, site].astype(np.float64)

    def _step(self) -> None:
        for law in self._laws:
            law.before()
        self._mjw.step(self._warp_model, self._data)

    def _between(self, model: Any, data: Any) -> None:
        """Let the laws act between a step's two halves; MuJoCo Warp's callback for controls."""
        data.qfrc_applied.zero_()
        for law in self._laws:
            law.between()
