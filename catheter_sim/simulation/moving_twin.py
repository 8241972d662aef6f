"""The twin of data that were taken while the robot moved: the simulation itself, of many robots and trials.

Motion knows no shortcut by balances: each robot is driven along each trial in MuJoCo, from rest under the
trial's first row. What a run gives is remembered, since a diagnosis asks for the same few robots again and
again. Several runs share the processes that are set up (`joblib.parallel_config`), if any are.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, replace

import joblib
import numpy as np

from catheter_sim.channels import outputs_of
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.core.statics import TwinStates
from catheter_sim.errors import InputError
from catheter_sim.simulation.replay import simulate

_REMEMBERED = 256  # runs, of some 100 kB each

Asked = tuple[Sequence[RobotSpec], Sequence[Inputs]]  # robots, and what arrives at each
_Run = tuple[Array, Array, Array, Array]  # p_w (r, k, 3), R_w (r, k, 3, 3), joints (r, j), tension (r, t)
_runs: OrderedDict[str, _Run] = OrderedDict()


@dataclass(frozen=True)
class MovingTwin:
    """Robots in motion, by the simulation: a twin of any kind of robot (`core.statics.Twin`).

    Attributes:
        timestep_s: longest step in motion; 0: the robots' own.
    """

    timestep_s: float = 0.0
    carries_load: bool = True

    def solve(
        self,
        robots: Sequence[RobotSpec],
        arriving: Sequence[Inputs],
        gravity_mps2: Array,
        elements: Sequence[int],
        every: int,
    ) -> TwinStates:
        """Return where robots are, as `Twin.solve` says; NaN from the row on at which one diverges."""
        return self.solve_trials([(robots, arriving)], gravity_mps2, elements, every)[0]

    def solve_trials(
        self, asked: Sequence[Asked], gravity_mps2: Array, elements: Sequence[int], every: int
    ) -> list[TwinStates]:
        """Return the same of several trials, each with its own robots, in order."""
        tasks = [
            (self._stepped(robot), inputs, gravity_mps2, tuple(elements))
            for robots, arriving in asked
            for robot, inputs in zip(robots, arriving, strict=True)
        ]
        names = [str(joblib.hash(task, hash_name="sha1")) for task in tasks]
        new = {name: task for name, task in zip(names, tasks, strict=True) if name not in _runs}
        runs = {name: _runs[name] for name in names if name in _runs}
        if len(new) > 1:
            found = joblib.Parallel(batch_size=1)(joblib.delayed(_moved)(*task) for task in new.values())
        else:
            found = [_moved(*task) for task in new.values()]
        runs.update(zip(new, found, strict=True))
        _remember(runs)
        rest = iter(names)
        return [_stacked([runs[next(rest)] for _ in robots], every) for robots, _ in asked]

    def _stepped(self, robot: RobotSpec) -> RobotSpec:
        if not self.timestep_s:
            return robot
        return replace(robot, dynamics=replace(robot.dynamics, motion_timestep_s=self.timestep_s))


def _moved(robot: RobotSpec, inputs: Inputs, gravity_mps2: Array, elements: tuple[int, ...]) -> _Run:
    """Return a robot's states at every row."""
    rows, wanted = len(inputs), list(elements)
    p_w, R_w = np.full((rows, len(wanted), 3), np.nan), np.full((rows, len(wanted), 3, 3), np.nan)
    angles = np.full((rows, len(outputs_of(robot).joints)), np.nan)
    tension = np.full((rows, inputs.tendon.shape[1]), np.nan)
    try:
        postures = simulate(robot, inputs, gravity_mps2, dynamic=True).postures
    except InputError:  # numbers of no robot, or of one that cannot follow its inputs
        return p_w, R_w, angles, tension
    for row, posture in enumerate(postures):
        p_w[row], R_w[row] = posture.p_w[wanted], posture.R_w[wanted]
        angles[row], tension[row] = posture.joint_angles, posture.actuator_tension
    return p_w, R_w, angles, tension


def _remember(runs: dict[str, _Run]) -> None:
    for name, run in runs.items():
        _runs[name] = run
        _runs.move_to_end(name)
    while len(_runs) > _REMEMBERED:
        _runs.popitem(last=False)


def _stacked(runs: Sequence[_Run], every: int) -> TwinStates:
    p_w, R_w, angles, tension = (np.array([part[::every] for part in parts]) for parts in zip(*runs, strict=True))
    return TwinStates(p_w, R_w, lambda: angles, tension)
