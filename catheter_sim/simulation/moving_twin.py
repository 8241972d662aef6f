"""The twin of data that were taken while the robot moved: the simulation itself, of many robots and trials.

Motion knows no shortcut by balances: each robot is driven along each trial in MuJoCo, from rest under the
trial's first row. A robot's model is built once for all its trials. What a run gives is remembered, since a
diagnosis asks for the same few robots again and again. Several robots, or the trials of one, share the
processes that are set up (`joblib.parallel_config`), if any are.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from threading import Lock

import joblib
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import outputs_of
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.core.statics import TwinStates
from catheter_sim.errors import InputError, SimulationDiverged
from catheter_sim.simulation.replay import RAMP_S, Commands, ramp
from catheter_sim.simulation.simulator import Simulator

_REMEMBERED = 256  # runs, of some 100 kB each

Asked = tuple[Sequence[RobotSpec], Sequence[Inputs]]  # robots, and what arrives at each
_Run = tuple[Array, Array, Array, Array]  # p_w (r, k, 3), R_w (r, k, 3, 3), joints (r, j), tension (r, t)
_runs: OrderedDict[str, _Run] = OrderedDict()
_runs_lock = Lock()


@dataclass(frozen=True)
class MovingTwin:
    """Robots in motion, by the simulation: a twin of any kind of robot (`core.statics.Twin`).

    Attributes:
        timestep_s: longest step in motion; 0: the robots' own.
        together: so many steps are taken under the same inputs, their mean over that time.
        remembers: whether runs are remembered; one of all elements is large, and no fit asks for it again.
    """

    timestep_s: float = 0.0
    together: int = 1
    remembers: bool = True
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
        common = gravity_mps2, tuple(elements), every, self.together
        pairs = [
            (self._stepped(robot), inputs)
            for robots, arriving in asked
            for robot, inputs in zip(robots, arriving, strict=True)
        ]
        names = [str(joblib.hash((*pair, *common), hash_name="sha1")) for pair in pairs]
        with _runs_lock:
            runs = {name: _runs[name] for name in names if name in _runs}
        new = {name: pair for name, pair in zip(names, pairs, strict=True) if name not in runs}
        tasks = _tasks(new)
        if len(tasks) > 1:
            parallel = joblib.Parallel(batch_size=1)
            found = parallel(
                joblib.delayed(_moved)(robot, [new[name][1] for name in mine], *common)
                for robot, mine in tasks
            )
        else:
            found = [_moved(robot, [new[name][1] for name in mine], *common) for robot, mine in tasks]
        for (_, mine), trials in zip(tasks, found, strict=True):
            runs.update(zip(mine, trials, strict=True))
        if self.remembers:
            _remember(runs)
        rest = iter(names)
        return [_stacked([runs[next(rest)] for _ in robots]) for robots, _ in asked]

    def _stepped(self, robot: RobotSpec) -> RobotSpec:
        if not self.timestep_s:
            return robot
        return replace(robot, dynamics=replace(robot.dynamics, motion_timestep_s=self.timestep_s))


def _tasks(new: dict[str, tuple[RobotSpec, Inputs]]) -> list[tuple[RobotSpec, list[str]]]:
    """Return what to run at a time: robots, each with all its trials or, where robots are few, with some."""
    groups: list[tuple[RobotSpec, list[str]]] = []
    for name, (robot, _) in new.items():
        mine = next((names for other, names in groups if other is robot or other == robot), None)
        if mine is None:
            groups.append((robot, [name]))
        else:
            mine.append(name)
    parts = -(-joblib.Parallel().n_jobs // max(len(groups), 1))
    return [(robot, names[k::parts]) for robot, names in groups for k in range(parts) if names[k::parts]]


def _moved(
    robot: RobotSpec,
    trials: Sequence[Inputs],
    gravity_mps2: Array,
    elements: tuple[int, ...],
    every: int,
    together: int,
) -> list[_Run]:
    """Return a robot's states along trials, at every so-many-th row."""
    try:
        simulator = Simulator(robot, trials[0].actuation, gravity_mps2, inertia=False)
    except InputError:  # numbers of no robot
        return [_nothing(robot, inputs, elements, every) for inputs in trials]
    return [_followed(simulator, inputs, elements, every, together) for inputs in trials]


def _followed(
    simulator: Simulator, inputs: Inputs, elements: tuple[int, ...], every: int, together: int
) -> _Run:
    """Return states along one trial, from rest under its first row; NaN from where the robot diverges on."""
    run = _nothing(simulator.robot, inputs, elements, every)
    wanted = list(elements)
    try:
        commands = Commands(inputs)
        _start(simulator, commands)
        step_s, since_s = simulator.model.opt.timestep, inputs.time_s - inputs.time_s[0]
        last = np.round(since_s / step_s).astype(int)
        values, done = commands.means(np.arange(last[-1]) * step_s, step_s), 0
        for index, row in enumerate(range(0, len(inputs), every)):
            for first in range(done, last[row], together):
                part = values[first : min(first + together, last[row])]
                commands.set(simulator, part.mean(axis=0) if together > 1 else part[0])
                simulator.step(len(part))
            done = last[row]
            simulator.require_finite()
            posture = simulator.posture(since_s[row] - done * step_s)
            states = posture.p_w[wanted], posture.R_w[wanted], posture.joint_angles, posture.actuator_tension
            for part, state in zip(run, states, strict=True):
                part[index] = state
    except (InputError, SimulationDiverged):  # an input that the robot cannot follow, or a wild robot
        pass
    return run


def _start(simulator: Simulator, commands: Commands) -> None:
    """Let a robot move, from rest under its first inputs and gravity."""
    simulator.hold()
    simulator.reset()
    if simulator.model.opt.gravity.any():
        simulator.settle()
    first = commands.rows[0]
    if first.any():
        ramp(simulator, commands, np.zeros_like(first), first, round(RAMP_S / simulator.model.opt.timestep))
        simulator.settle()
    simulator.let_go()


def _nothing(robot: RobotSpec, inputs: Inputs, elements: tuple[int, ...], every: int) -> _Run:
    rows, k = len(inputs.time_s[::every]), len(elements)
    shapes = (k, 3), (k, 3, 3), (len(outputs_of(robot).joints),), inputs.tendon.shape[1:]
    p_w, R_w, angles, tension = (np.full((rows, *shape), np.nan) for shape in shapes)
    return p_w, R_w, angles, tension


def _remember(runs: dict[str, _Run]) -> None:
    with _runs_lock:
        for name, run in runs.items():
            _runs[name] = run
            _runs.move_to_end(name)
        while len(_runs) > _REMEMBERED:
            _runs.popitem(last=False)


def _stacked(runs: Sequence[_Run]) -> TwinStates:
    p_w, R_w, angles, tension = (np.array(parts) for parts in zip(*runs, strict=True))
    return TwinStates(p_w, R_w, lambda: angles, tension)
