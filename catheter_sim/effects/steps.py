"""A robot's effects step by step, for whoever moves it without knowing the way beforehand.

The memories' steps are those whose series `apply` takes along a whole history.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.effect import Memory, Stage
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Observed
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects.apply import Act, acts, nearest_rotations, pulled_only


class _Remembered:
    """Where a memory is on its way.

    Attributes:
        now: what comes out.
    """

    def __init__(self, robot: RobotSpec, act: Act, rest: Array) -> None:
        memory = act.form.memory
        assert memory is not None
        self._memory: Memory = memory
        self._state: Any = memory.start(robot, act.values, rest)
        self._before = self.now = rest

    @property
    def acts(self) -> bool:
        """Whether it does anything."""
        return self._state is not None

    def step(self, after: Array, dt_s: float) -> Array:
        """Return what comes out when what goes in has moved to `after`."""
        if not self.acts:
            return after
        self._state, self.now = self._memory.step(self._state, self._before, after, dt_s)
        self._before = after
        return self.now


class Commands:
    """From each command of a robot to what arrives at it.

    Attributes:
        change: whether anything else arrives than what is commanded.
    """

    def __init__(self, robot: RobotSpec) -> None:
        self._robot = robot
        self._acts = acts(robot, Stage.COMMAND)
        self.reset()
        self.change = any(act.form.command is not None for act in self._acts) or any(
            item.acts for item in self._memories.values()
        )

    def reset(self) -> None:
        """Return to rest, all inputs zero. The first step after it should take no time."""
        rest = np.zeros(len(self._robot.tendons))
        self._memories = {
            index: _Remembered(self._robot, act, rest)
            for index, act in enumerate(self._acts)
            if act.form.memory is not None
        }

    def step(self, tendon: Array, dt_s: float) -> tuple[Array, Array, Array]:
        """Return what arrives when the inputs of the tendons, shape (t,), have moved to `tendon`.

        That is their inputs, and force and moment on the tip, shape (3,) each [N, N m].
        """
        nothing = np.zeros((1, 3))
        inputs = Inputs(np.zeros(1), self._robot.actuation, tendon[np.newaxis], nothing, nothing)
        for index, act in enumerate(self._acts):
            if act.form.command is not None:
                inputs = pulled_only(act.form.command(self._robot, inputs, act.values))
            if index in self._memories:
                arrived = self._memories[index].step(inputs.tendon[0], dt_s)
                inputs = pulled_only(replace(inputs, tendon=arrived[np.newaxis]))
        return inputs.tendon[0], inputs.force_tip[0], inputs.moment_tip[0]


class Sight:
    """What is measured of something of a robot, from each look to the next.

    What remembers has watched long enough before the first look to show it as it is.
    """

    def __init__(self, robot: RobotSpec) -> None:
        self._robot = robot
        self._acts = acts(robot, Stage.OBSERVATION)
        self._memories: dict[tuple[int, int], _Remembered] = {}

    def look(self, p_w: Array, R_w: Array, dt_s: float) -> tuple[Array, Array]:
        """Return what is measured of positions (..., 3) [m] and orientations (..., 3, 3).

        `dt_s` is the time since the last look.
        """
        for index, act in enumerate(self._acts):
            if act.form.observe is not None:
                none = np.zeros(0)
                now = act.form.observe(Observed(none, p_w, R_w, none, none), act.values)
                p_w, R_w = now.p_w, now.R_w
            if act.form.memory is not None:
                p_w = self._remembered(index, 0, act, p_w).step(p_w, dt_s)
                frames = self._remembered(index, 1, act, R_w)
                R_w = nearest_rotations(frames.step(R_w, dt_s)) if frames.acts else R_w
        return p_w, R_w

    def _remembered(self, index: int, what: int, act: Act, now: Array) -> _Remembered:
        """Return the memory of one thing seen, which begins as it is."""
        if (index, what) not in self._memories:
            self._memories[index, what] = _Remembered(self._robot, act, now)
        return self._memories[index, what]
