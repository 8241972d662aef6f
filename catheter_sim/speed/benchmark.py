"""How fast the simulation is, against a plain loop of `mujoco.mj_step` measured in the same run.

Seconds are the processor's, so that what else runs on the machine counts little; of two threads, and of
the plain loop that they are held against, they are the wall clock's.
"""

from __future__ import annotations

import dataclasses
import gc
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from statistics import median
from typing import Any

import mujoco
import mujoco.batch
import numpy as np
from numpy.typing import NDArray

from catheter_sim.catalogue import PUBLISHED, load_robot
from catheter_sim.core.published import SpeedCase
from catheter_sim.core.robot import Friction, RobotSpec
from catheter_sim.robots import face_of
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.speed.chain import (
    CELLS,
    CHAIN,
    GROWTH_TARGET,
    Growth,
    chain,
    exponent,
    growth_text,
    with_cells,
)

_FIRST = ("neuroendoscope_section", "neuroendoscope", "spacer_disk", "chest_tube_section")  # in the table
_IDS = [name for name in PUBLISHED if "@" not in name]
ROBOTS = (*dict.fromkeys((*_FIRST, *_IDS)), CHAIN)
FRICTION_MU = 0.3  # used where a robot is specified without friction, unless its kind says otherwise
_LEVELS = 40  # inputs in one cycle to and fro
_STEPS_PER_LEVEL = 10
_COPIES = 8  # of a model in a batch
_BATCH_LEVELS = slice(0, _LEVELS // 4, 2)  # of the cycle: as many steps in all as the other loops take
FRICTION_COST_TARGET = 1.5


@dataclass(frozen=True)
class Speed:
    """Speed of one robot's simulation.

    Attributes:
        robot: its id.
        timestep_s: simulated time in a step [s].
        links: links in the chain.
        plain_pulled: whether the plain loop is fed with the inputs and follows them; else the model
            is at rest in it.
        steps_per_s_friction: of `Simulator.step` with friction, median; None of a robot without.
        steps_per_s_frictionless: of `Simulator.step` without friction, median.
        steps_per_s_plain: of a loop of `mj_step` on the frictionless model, median.
        friction_cost: time with friction over time without, median of the turns' ratios; or None.
        python_cost: time of the simulator without friction over the plain loop, likewise.
        of_plain: time of the simulator, with friction where there is any, over the plain loop, likewise.
        batch_cost_1: time of a step in `mujoco.batch` of eight copies of the plain model on one thread,
            over the plain loop, likewise; None where it was not measured.
        batch_cost_2: the same on two threads; without any cost of batching it would be 0.5.
        growth: of the cost with the number of cells; None where it was not measured.
        moving_of_plain: time of a step of the robot in motion, with friction, over `mj_step` of the same
            model, likewise; None where it was not measured.
    """

    robot: str
    timestep_s: float
    links: int
    plain_pulled: bool
    steps_per_s_friction: float | None
    steps_per_s_frictionless: float
    steps_per_s_plain: float
    friction_cost: float | None
    python_cost: float
    of_plain: float
    batch_cost_1: float | None = None
    batch_cost_2: float | None = None
    growth: Growth | None = None
    moving_of_plain: float | None = None

    @property
    def real_time_friction(self) -> float | None:
        """Simulated seconds in a second of one core, with friction; None of a robot without."""
        return None if self.steps_per_s_friction is None else self.steps_per_s_friction * self.timestep_s

    @property
    def real_time_frictionless(self) -> float:
        """Simulated seconds in a second of one core, without friction."""
        return self.steps_per_s_frictionless * self.timestep_s


def measure(reference: str, turns: int = 9) -> Speed:
    """Return the speed of the robot `reference`, in `turns` interleaved turns of each loop.

    Raises:
        InputError: unknown robot.
    """
    robot = chain(FRICTION_MU) if reference == CHAIN else load_robot(reference)
    case = _case(robot)
    mu = robot.friction.mu or (FRICTION_MU if case.rubs else 0.0)
    smooth = Simulator(dataclasses.replace(robot, friction=Friction(0.0)))
    inputs = case.inputs
    plain = Simulator(smooth.robot)  # of which no step of the simulator changes the model
    pulled = case.follows
    controls = _controls(plain, inputs[_BATCH_LEVELS] if pulled else np.zeros_like(inputs[_BATCH_LEVELS]))
    loops: list[Callable[[], None]] = [
        lambda: _run_simulator(smooth, inputs),
        lambda: _run_plain(plain, inputs) if pulled else _run_plain_at_rest(plain, len(inputs)),
        *(_batch_loop(plain.model, controls, threads)[1] for threads in (1, 2)),
    ]
    if mu > 0.0:
        rubbing = Simulator(dataclasses.replace(robot, friction=Friction(mu)))
        loops.insert(0, lambda: _run_simulator(rubbing, inputs))
    seconds, wall = np.moveaxis(_interleaved(loops, turns), -1, 0)
    steps = len(inputs) * _STEPS_PER_LEVEL
    each = [steps / median(column) for column in seconds.T]
    off, mj_step, one, _ = seconds[:, -4:].T
    return Speed(
        robot=reference,
        timestep_s=float(smooth.model.opt.timestep),
        links=case.links,
        plain_pulled=pulled,
        steps_per_s_friction=each[0] if mu > 0.0 else None,
        steps_per_s_frictionless=each[-4],
        steps_per_s_plain=each[-3],
        friction_cost=median(seconds[:, 0] / off) if mu > 0.0 else None,
        python_cost=median(off / mj_step),
        of_plain=median(seconds[:, 0] / mj_step),
        batch_cost_1=median(one / mj_step),
        batch_cost_2=median(wall[:, -1] / wall[:, -3]),
        moving_of_plain=_moving_of_plain(robot, inputs, turns) if reference == CHAIN else None,
    )


def _moving_of_plain(robot: RobotSpec, inputs: NDArray[np.float64], turns: int) -> float:
    """Return the time of a step in motion, with friction, over that of `mj_step`, median of the ratios."""
    moving, plain = Simulator(robot, inertia=False), Simulator(robot, inertia=False)
    moving.let_go()
    plain.let_go()
    loops = [lambda: _run_simulator(moving, inputs), lambda: _run_plain(plain, inputs)]
    seconds = _interleaved(loops, turns)[..., 0]
    return float(median(seconds[:, 0] / seconds[:, 1]))


def measure_growth(turns: int = 9) -> Growth:
    """Return how the cost of a step grows with the number of cells, in `turns` interleaved turns."""
    loops: list[Callable[[], None]] = []
    for count in CELLS:
        robots = with_cells(count, FRICTION_MU), with_cells(count, 0.0)
        for robot, run in zip(robots, (_run_simulator, _run_plain), strict=True):
            loops.append(partial(run, Simulator(robot), input_cycle(robot)))
    microseconds = np.median(_interleaved(loops, turns)[..., 0], axis=0) / (_LEVELS * _STEPS_PER_LEVEL) * 1e6
    rubbing, plain = microseconds[::2].tolist(), microseconds[1::2].tolist()
    return Growth(CELLS, tuple(rubbing), tuple(plain), exponent(CELLS, rubbing), exponent(CELLS, plain))


def input_cycle(robot: RobotSpec) -> NDArray[np.float64]:
    """Return inputs that move every joint to and fro, shape (levels, tendons) [N] or [m]; see its kind."""
    return _case(robot).inputs


def _case(robot: RobotSpec) -> SpeedCase:
    case: SpeedCase = face_of(robot, "steering", "speed test").speed_case(robot, _LEVELS)
    return case


def _run_simulator(simulator: Simulator, inputs: NDArray[np.float64]) -> None:
    for row in inputs:
        simulator.set_inputs(row)
        simulator.step(_STEPS_PER_LEVEL)


def _run_plain(simulator: Simulator, inputs: NDArray[np.float64]) -> None:
    """Step the model of `simulator` by MuJoCo alone; its controls are set the way it sets them."""
    model, data = simulator.model, simulator.data
    for row in inputs:
        simulator.set_inputs(row)
        for _ in range(_STEPS_PER_LEVEL):
            mujoco.mj_step(model, data)


def _run_plain_at_rest(simulator: Simulator, levels: int) -> None:
    """Step the model of `simulator` by MuJoCo alone, straight and unpulled, as many steps as `levels` ask."""
    simulator.reset()
    simulator.set_inputs(np.zeros(len(simulator.robot.tendons)))
    for _ in range(levels * _STEPS_PER_LEVEL):
        mujoco.mj_step(simulator.model, simulator.data)


def _controls(simulator: Simulator, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the model's controls for each row of `inputs`, and leave the simulator at rest."""
    rows = []
    for row in inputs:
        simulator.set_inputs(row)
        rows.append(simulator.data.ctrl.copy())
    simulator.reset()
    return np.array(rows)


def _batch_loop(
    model: mujoco.MjModel, controls: NDArray[np.float64], threads: int
) -> tuple[mujoco.batch.Batch, Callable[[], None]]:
    """Return copies of `model`, and a loop that steps them by MuJoCo alone, on `threads` threads."""
    batch = mujoco.batch.Batch(model, _COPIES, threads)
    ctrl = batch.bind("ctrl")

    def run() -> None:
        for row in controls:
            ctrl[:] = row
            batch.step(nstep=_STEPS_PER_LEVEL)

    return batch, run


def _interleaved(loops: Sequence[Callable[[], None]], turns: int) -> NDArray[np.float64]:
    """Return the seconds of processor and of wall-clock that each loop took, shape (turns, loops, 2)."""
    for loop in loops:  # caches warm, robots past their start
        loop()
    return np.array([[_seconds(loop) for loop in loops] for _ in range(turns)])


def _seconds(loop: Callable[[], None]) -> tuple[float, float]:
    gc.collect()
    start, wall_start = time.process_time(), time.perf_counter()
    loop()
    return time.process_time() - start, time.perf_counter() - wall_start


def as_dict(speed: Speed) -> dict[str, Any]:
    """Return `speed` as a dictionary for JSON."""
    return dataclasses.asdict(speed) | {
        "real_time_friction": speed.real_time_friction,
        "real_time_frictionless": speed.real_time_frictionless,
    }


def table_text(speeds: Sequence[Speed]) -> str:
    """Return the speeds as a table for people."""
    header = (
        f"{'robot':<24} {'friction':<8} {'steps/s':>9} {'real time':>9} {'of plain':>9} "
        f"{'friction cost':>14} {'Python cost':>12}"
    )
    lines = [header, "-" * len(header)]
    for speed in speeds:
        name = speed.robot
        if speed.steps_per_s_friction is not None:
            lines.append(
                f"{name:<24} {'on':<8} {speed.steps_per_s_friction:>9.0f} "
                f"{speed.real_time_friction:>8.1f}x {speed.of_plain:>8.2f}x {speed.friction_cost:>13.2f}x"
            )
            name = ""
        lines += [
            f"{name:<24} {'off':<8} {speed.steps_per_s_frictionless:>9.0f} "
            f"{speed.real_time_frictionless:>8.1f}x {speed.python_cost:>8.2f}x {'':>14} "
            f"{speed.python_cost:>11.2f}x",
            f"{'':<24} {'mj_step':<8} {speed.steps_per_s_plain:>9.0f} "
            f"{speed.steps_per_s_plain * speed.timestep_s:>8.1f}x {1.0:>8.2f}x",
        ]
        if speed.moving_of_plain is not None:
            lines.append(f"{'':<24} {'moving':<8} {'':>9} {'':>9} {speed.moving_of_plain:>8.2f}x")
        for threads, cost in ((1, speed.batch_cost_1), (2, speed.batch_cost_2)):
            if cost is not None:
                steps = speed.steps_per_s_plain / cost
                lines.append(
                    f"{'':<24} {f'batch {threads}':<8} {steps:>9.0f} "
                    f"{steps * speed.timestep_s:>8.1f}x {cost:>8.2f}x"
                )
    still = [speed.robot for speed in speeds if not speed.plain_pulled]
    if still:
        lines.append(
            f"mj_step of {', '.join(still)}: at rest, unpulled;\n"
            "         by MuJoCo alone its links do not roll and its rods do not resist"
        )
    lines.append("batch 1, batch 2: of eight copies that mj_step alone steps, on as many threads")
    lines.append(
        f"targets: friction cost at most {FRICTION_COST_TARGET}x.\n"
        "         neuroendoscope_section with friction at least 20x real time.\n"
        f"         {CHAIN} with friction at most {FRICTION_COST_TARGET}x of plain, also moving.\n"
        f"         cost of a step over the cells, with friction, at most n^{GROWTH_TARGET}."
    )
    for speed in speeds:
        if speed.growth is not None:
            lines.append(growth_text(speed.growth))
    return "\n".join(lines)
