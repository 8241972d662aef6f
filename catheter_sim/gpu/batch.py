"""Copies of one robot stepped together by MuJoCo Warp, with the friction law of the simulator."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from catheter_sim.errors import InputError, SimulationDiverged
from catheter_sim.robots.kinds import Robot, require_continuum
from catheter_sim.robots.posture import Array
from catheter_sim.simulation.elastic_law import ElasticRemainder
from catheter_sim.simulation.friction import SWEEP_TOLERANCE, SWEEPS, CapstanFriction
from catheter_sim.simulation.simulator import Simulator

EXTRA = "catheter-sim[gpu]"


class WarpBatch:
    """Copies of a continuum robot under tensions of their own.

    The model is the simulator's own. MuJoCo Warp computes in single precision.

    Attributes:
        copies: how many.
        device: Warp's name of where they are, as "cuda:0" or "cpu".
    """

    def __init__(
        self,
        robot: Robot,
        copies: int,
        device: str | None = None,
        gravity_mps2: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        """Put the copies on the device, at rest; the first step compiles, which takes minutes, once.

        Args:
            robot: a continuum robot driven by tensions; its `effects` are not read.
            copies: at least 1.
            device: default: a GPU where there is one.
            gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].

        Raises:
            InputError: MuJoCo Warp is not installed, the device does not exist, or the robot has what
                this class does not know.
        """
        disked = require_continuum(robot, "simulation on MuJoCo Warp")
        if copies < 1:
            raise InputError(f"copies = {copies}: at least 1 is needed")
        if disked.actuation != "tension":
            raise InputError(f"{robot.name}: MuJoCo Warp drives tendons by tension only; choices: tension")
        self._mjw, self._wp = _require_warp()
        self.copies, self.robot = copies, disked
        simulator = Simulator(disked, gravity_mps2=gravity_mps2)
        self._model, data = simulator.model, simulator.data
        if ElasticRemainder(disked, self._model).needed:
            raise InputError(
                f"{robot.name}: MuJoCo Warp knows neither stiffness_quintic_mm4, nor stiffness_cubic_mm2 "
                "of segments that bend in space"
            )
        # MuJoCo Warp never resets a state by itself, and refuses the flag that says so.
        self._model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
        try:
            self._device = self._wp.get_device(device)
        except (RuntimeError, ValueError) as error:
            names = ", ".join(str(item) for item in self._wp.get_devices())
            raise InputError(f"device {device!r}: {' '.join(str(error).split())}; choices: {names}") from None
        self.device = str(self._device)
        with self._wp.ScopedDevice(self._device):
            self._warp_model = self._mjw.put_model(self._model)
            self._data = self._mjw.put_data(self._model, data, nworld=copies)
            self._law = _Law(simulator, self._model, copies, self._wp) if disked.friction.mu > 0.0 else None
            if self._law is not None:
                self._warp_model.callback.control = self._law.apply
        self._start = {name: getattr(self._data, name).numpy().copy() for name in ("qpos", "qvel", "time")}

    def reset(self) -> None:
        """Return all copies to rest, without inputs and friction history."""
        for name, value in self._start.items():
            getattr(self._data, name).assign(value)
        for name in ("ctrl", "qfrc_applied", "qfrc_constraint", "qacc_warmstart"):
            getattr(self._data, name).zero_()
        if self._law is not None:
            self._law.tension.zero_()

    def set_inputs(self, tension: Array) -> None:
        """Set the tensions of the following steps, shape (copies, t) [N]."""
        wanted = (self.copies, len(self.robot.tendons))
        if np.shape(tension) != wanted:
            raise InputError(f"tensions of shape {np.shape(tension)}: {wanted} is needed (copies, tendons)")
        self._data.ctrl.assign(np.asarray(tension, dtype=np.float32))

    def step(self, count: int = 1) -> None:
        """Take `count` steps."""
        with self._wp.ScopedDevice(self._device):
            for _ in range(count):
                self._mjw.step(self._warp_model, self._data)

    def repeated(self, count: int) -> Callable[[], None]:
        """Return what takes `count` steps, compiled: on a GPU a graph, recorded here once.

        The steps that compiling takes have been taken when this returns.
        """
        self.step(1)
        if not self._device.is_cuda:
            return partial(self.step, count)
        with self._wp.ScopedDevice(self._device), self._wp.ScopedCapture() as capture:
            for _ in range(count):
                self._mjw.step(self._warp_model, self._data)
        return partial(self._wp.capture_launch, capture.graph)

    def synchronise(self) -> None:
        """Wait until the device has done what it was asked for."""
        self._wp.synchronize_device(self._device)

    def qpos(self) -> Array:
        """Return MuJoCo's positions of all copies, shape (copies, nq).

        Raises:
            SimulationDiverged: one is not finite.
        """
        value = self._data.qpos.numpy().astype(np.float64)
        if not np.isfinite(value).all():
            raise SimulationDiverged(f"{self.robot.name}: the simulation on MuJoCo Warp diverged")
        return value

    def tips(self) -> Array:
        """Return the tips at the start of the last step, base frame, shape (copies, 3) [m]."""
        site = int(self._model.site("tip").id)
        return self._data.site_xpos.numpy()[:, site].astype(np.float64)


class _Law:
    """The capstan law's arrays on the device, and its launch."""

    def __init__(self, simulator: Simulator, model: mujoco.MjModel, copies: int, wp: Any) -> None:
        from catheter_sim.gpu import friction_kernel

        self._wp, self._kernel, self._copies = wp, friction_kernel.confine, copies
        law = CapstanFriction(simulator.robot, model, np.zeros(len(simulator.robot.tendons)))
        layout = law.layout()
        spans, tendons, nv = layout.spans, len(layout.ends), model.nv

        def whole(values: Array) -> Any:
            return wp.array(np.ascontiguousarray(values, dtype=np.int32), dtype=int)

        def room(*shape: int) -> Any:
            return wp.zeros((copies, *shape), dtype=wp.float64)

        self._fixed = [
            wp.float64(layout.mu),
            layout.planar,
            whole(layout.joints),
            wp.array(np.ascontiguousarray(layout.sites, dtype=np.int32), dtype=int, ndim=2),
            *(whole(item) for item in (layout.ends, layout.starts, layout.entries, layout.dofs, layout.span)),
            wp.array(layout.yielding, dtype=wp.float64),
            SWEEPS,
            wp.float64(SWEEP_TOLERANCE),
        ]
        self.tension = room(tendons, spans)
        self._room = [room(tendons, spans), room(tendons, spans), room(spans), room(nv), room(spans)]
        self._room += [room(2 * spans), room(2 * spans), room(spans)]

    def apply(self, model: Any, data: Any) -> None:
        """Write what friction changes to `data.qfrc_applied`; MuJoCo Warp's callback for controls."""
        inputs = [*self._fixed, data.ctrl, data.qpos, data.site_xpos, data.ten_J, data.qvel]
        inputs += [data.qfrc_passive, data.qfrc_bias, data.qfrc_constraint, self.tension, *self._room]
        self._wp.launch(self._kernel, dim=self._copies, inputs=[*inputs, data.qfrc_applied])


def _require_warp() -> tuple[Any, Any]:
    """Return the modules `mujoco_warp` and `warp`.

    Raises:
        InputError: they are not installed.
    """
    try:
        import mujoco_warp
        import warp
    except ImportError as error:
        raise InputError(f"MuJoCo Warp is needed: pip install '{EXTRA}' ({error})") from None
    warp.config.quiet = True
    return mujoco_warp, warp
