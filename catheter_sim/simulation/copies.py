"""Many copies of one simulated robot, stepped together in one thread by `mujoco.batch`.

A step of `simulator.Simulator` has a middle: after positions and velocities are known (`mj_step1`) and
before forces move the robot (`mj_step2`), friction and the like are added. A persistent `Batch` has that
middle too: `step(stage=mjSTAGE_VEL)` ends with the next step's first half, and the next call goes on from
there with what was written between. Only where a law moves joints in the model before a
step, as for rolling joints, the halves take two calls. What differs between the copies in the model is
expanded (`Batch.expand`): those hinges, a torsion pair's tangent, the clamp of slack tendons. Every copy then
gets bit for bit what a simulator alone would. To rounding (1e-15) where the tendons' paths are found here and
not by MuJoCo, which is more than half of its step (`site_tendons`): for robots whose tensions are given and
whose steps have a middle. A robot without one, such as a continuum robot without friction, is stepped by
MuJoCo alone.

Between the halves all is compiled loops over the copies (`capstan`, `site_tendons`, the kinds'
`laws`) or array arithmetic. `Batch` would have threads of its own, but then all would wait for
each other twice in every step. One object of this class in each thread, a part of the copies in each, waits
once for many steps; nearly all that takes time here runs without Python's lock.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch, SimulationError

from catheter_sim.arrays import Array, Index
from catheter_sim.core.law import Batched, CopiesLaw, CopyArrays
from catheter_sim.errors import InputError
from catheter_sim.mechanics.hysteresis import clamp_slack_of
from catheter_sim.robots import kind_of
from catheter_sim.simulation.friction import CapstanCopies, CapstanFriction
from catheter_sim.simulation.motion import LARGEST_INPUT, farthest
from catheter_sim.simulation.simulator import SETTLED_ANGLE_RAD, Simulator
from catheter_sim.simulation.site_tendons import PathCopies, applies, pathless
from catheter_sim.simulation.together import SETTLE_BLOCK_S

_NOTHING, _POSITIONS, _VELOCITIES, _ALL = (
    int(stage)
    for stage in (
        mujoco.mjtStage.mjSTAGE_NONE,
        mujoco.mjtStage.mjSTAGE_POS,
        mujoco.mjtStage.mjSTAGE_VEL,
        mujoco.mjtStage.mjSTAGE_ACC,
    )
)

# Degrees of freedom of the copies that go through a ramp together. Few, and their states stay near the
# processor; many, and each of Python's calls is for more: of 8, 16 and 64 copies of the neuroendoscope (60
# each) 8 were faster than 64 by 4 %, but Python's share three times as large.
_TOGETHER_DOFS = 1000


def copied_together(simulator: Simulator) -> bool:
    """Whether `Copies` knows all that `simulator` does: its kind's `batched.py` says so.

    None knows the laws whose histories are kept in Python: links that give way, tubes that bend, the laws of
    Nayar 2023 and the friction of a catheter's pairs. Nor is the reference law of friction known.
    """
    face, friction = kind_of(simulator.robot).batched, simulator.laws.friction
    if face is None or not face.covers(simulator.robot):
        return False
    return friction is None or (isinstance(friction, CapstanFriction) and face.rubs(simulator.robot))


class Copies:
    """Copies of a simulator's robot, for use by one thread; numbers from 0 choose among them, rising.

    Attributes:
        count: how many, m.
        qpos, qvel: positions and velocities, shapes (m, nq) and (m, nv), free to be read.
        native_s: time of the processor spent in MuJoCo and in compiled loops [s]; all else is Python's.
    """

    def __init__(self, simulator: Simulator, count: int) -> None:
        """Make copies, at rest, of what `copied_together` affirms.

        Raises:
            InputError: the robot's kind has no laws for copies.
        """
        face, robot = kind_of(simulator.robot).batched, simulator.robot
        if face is None:
            raise InputError(f"{robot.name}: no copies of robots of kind {kind_of(robot).name!r}")
        self.count, self.native_s = count, 0.0
        simulator.reset()
        self._model, self._pulls, self._controls = simulator.model, simulator.pulls, simulator.controls
        self._faces, self._dofs = simulator.faces, simulator.dofs
        self._driven = not self._pulls.given
        self._timestep = float(self._model.opt.timestep)
        self._slowest = SETTLED_ANGLE_RAD / robot.dynamics.relaxation_time_s
        splits = bool(simulator.laws.laws)  # whether forces are added between a step's two halves
        own_paths = self._pulls.given and splits and applies(self._model)
        without = pathless(self._model) if own_paths else self._model
        self._batch = batch = Batch(without, count, 1, persistent=True)
        self._paths = PathCopies(self._model, batch) if own_paths else None
        self.qpos, self.qvel = batch.bind("qpos"), batch.bind("qvel")
        self._points, self._axes = batch.bind("site_xpos"), batch.bind("site_xmat")
        self._length = batch.bind("ten_length")
        self._all = np.arange(count)
        self._failed = np.zeros(count, dtype=bool)
        self._farthest = farthest(simulator.place)
        arrays = CopyArrays(batch)
        self._ctrl, self._applied = arrays.ctrl, arrays.applied
        self._splits = splits
        self._find_laws(simulator, face, arrays)
        self.reset(self._all)

    def _find_laws(self, simulator: Simulator, face: Batched[Any], arrays: CopyArrays) -> None:
        """Prepare what is done beside MuJoCo's own step."""
        robot, place, pulls = simulator.robot, simulator.place, self._pulls
        laws = face.laws(robot, place, arrays)
        self._moved = {name: field for law in laws for name, field in law.moved.items()}
        self._forgetting, self._starting, self._placing, self._actuating, self._pushing = (
            [law for law in laws if getattr(type(law), name) is not getattr(CopiesLaw, name)]
            for name in ("reset", "before", "place", "actuate", "between")
        )
        if self._driven:
            self._clamp = arrays.own("actuator_forcerange")
            self._ctrl_before = np.zeros((self.count, len(pulls.actuators)))
        self._inputs = face.controls(robot, place, arrays)
        self._law: CapstanCopies | None = None
        if simulator.laws.friction is not None:
            paths = kind_of(robot).laws.tendon_paths(robot, place)
            ten_J = self._paths.ten_J if self._paths else None
            mu, stiffness = robot.friction.mu, pulls.drive_stiffness()
            self._law = CapstanCopies(mu, paths, self._model, self._batch, stiffness, ten_J)

    def reset(self, copies: Index) -> None:
        """Return some copies to rest: the unloaded shape, zero inputs, no history."""
        self._failed[copies] = False
        self._run(self._batch.reset, copies, stage=_NOTHING)
        self._inputs.reset(copies)
        for law in self._forgetting:
            law.reset(copies)
        if self._driven:
            self._ctrl_before[copies] = 0.0
        if self._law is not None:
            self._law.forget(copies)
        self.qpos[copies] = self._model.qpos_spring
        self._place(copies)
        self._run(self._batch.forward, copies, stage=_ALL)

    def ramp(self, copies: Index, before: Array, after: Array, duration_s: float) -> None:
        """Move the inputs of some copies linearly from `before` to `after`, shapes (k, t)."""
        # On the line between two inputs nothing is larger than the larger one. MuJoCo's own complaint of it
        # is not to be had from a batch, but for a copy of all its data.
        self._failed[copies] |= ~(np.abs(after) <= LARGEST_INPUT).all(axis=1)
        steps = max(1, round(duration_s / self._timestep))
        size = max(1, _TOGETHER_DOFS // self._model.nv)
        for first in range(0, len(copies), size):
            part = slice(first, first + size)
            start, change = before[part], after[part] - before[part]
            for step in range(1, steps + 1):
                self._native(self._inputs.set, copies[part], start, change, step / steps)
                self._step(copies[part])

    def settle(self, copies: Index, longest_s: float = 5.0) -> None:
        """Step each of some copies under its present inputs until it is at rest, or no longer finite."""
        steps = max(1, round(SETTLE_BLOCK_S / self._timestep))
        for _ in range(max(1, round(longest_s / (steps * self._timestep)))):
            for _ in range(steps):
                self._step(copies)
            moving = np.abs(self.qvel[np.ix_(copies, self._dofs)]).max(axis=1) >= self._slowest
            copies = copies[moving & self.finite(copies)]
            if not len(copies):
                return

    def finite(self, copies: Index) -> np.ndarray:
        """Return which of some copies have not diverged; see `Simulator.require_finite`."""
        near = (np.abs(self.qpos[copies]) <= self._farthest).all(axis=1)
        return near & np.isfinite(self.qvel[copies]).all(axis=1) & ~self._failed[copies]

    def tips(self, copies: Index) -> tuple[Array, Array, Array]:
        """Return of some copies the tips' places, (k, 3) [m], orientations, (k, 3, 3), tensions, (k, t) [N].

        The tensions are those at the actuators, as of `Simulator.actuator_tension`.
        """
        self._place(copies)
        if self._placing or not self._splits:
            self._run(self._batch.forward, copies, stage=_POSITIONS)
        tip = self._faces[-1]
        pulled = np.maximum(self._tension_now(copies), 0.0)
        tension = self._controls.tension(self.qpos[copies], self._ctrl[copies], pulled)
        return self._points[copies, tip], self._axes[copies, tip].reshape(-1, 3, 3), tension

    def moved(self, copy: int) -> dict[str, Array]:
        """Return the fields of the model that are one copy's own, by their names."""
        return {name: field[copy].copy() for name, field in self._moved.items()}

    def _step(self, copies: Index) -> None:
        """Take a step, as `Simulator.step` does."""
        if not self._splits:
            self._run(self._batch.step, copies)
            return
        if self._starting:
            tension = self._span_tension(copies)
            for law in self._starting:
                self._native(law.before, copies, tension)
        if self._placing:
            self._place(copies)
            self._run(self._batch.forward, copies, stage=_VELOCITIES)
        for law in self._actuating:
            self._act(law, law.actuate, copies)
        pulls = self._pulls
        if self._driven:
            pulling = pulls.actuators, pulls.tendons, pulls.gain, pulls.bias, pulls.length_gain
            state = self._length, self._ctrl, self._ctrl_before, self._clamp
            self._native(clamp_slack_of, copies, *pulling, *state)
        self._applied[copies] = 0.0
        for law in self._pushing:
            self._act(law, law.between, copies)
        if self._paths is not None:
            self._native(self._paths.find_in, copies)
        if self._law is not None:
            entering = self._ctrl
            if self._driven:
                entering = np.zeros_like(self._ctrl_before)
                entering[copies] = self._tension_now(copies)
            self._native(self._law.apply_copies, copies, entering, self._applied)
        if self._paths is not None:
            self._native(self._paths.pull_in, copies, self._ctrl, self._applied)
        self._run(self._batch.step, copies, stage=_NOTHING if self._placing else _VELOCITIES)

    def _tension_now(self, copies: Index) -> Array:
        """Return tensions as `Pulls.tension` does, shape (k, t) [N]."""
        if not self._driven:
            return self._ctrl[copies]
        pulls = self._pulls
        force = pulls.gain * self._ctrl[np.ix_(copies, pulls.actuators)] + pulls.bias
        return -(force + pulls.length_gain * self._length[np.ix_(copies, pulls.tendons)])

    def _span_tension(self, copies: Index) -> Array:
        """Return tensions in each span as the last step left them, shape (m, t, n) [N]."""
        if self._law is not None:
            return self._law.tension
        spans = self._controls.spans
        tension = np.zeros((self.count, len(spans), int(spans.max())))
        tension[copies] = np.maximum(self._tension_now(copies), 0.0)[:, :, None]
        return tension

    def _place(self, copies: Index) -> None:
        """Put joints where the positions have them."""
        for law in self._placing:
            self._act(law, law.place, copies)

    def _act(self, law: CopiesLaw, call: Callable[[Index], None], copies: Index) -> None:
        """Let a law act; its time counts as the processor's own where it is compiled."""
        if law.compiled:
            self._native(call, copies)
        else:
            call(copies)

    def _run(self, call: Callable[..., None], copies: Index, **arguments: int) -> None:
        """Call a batch for some copies; one in which MuJoCo gives up counts as diverged."""
        try:
            self._native(call, ids=copies, **arguments)
        except SimulationError as error:
            self._failed[error.ids] = True

    def _native(self, call: Callable[..., None], *arguments: Any, **named: Any) -> None:
        start = time.thread_time()
        try:
            call(*arguments, **named)
        finally:
            self.native_s += time.thread_time() - start
