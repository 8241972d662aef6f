"""How far a file in MuJoCo alone is from the package's own simulation, on loops that were not fitted."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.exporting import write
from catheter_sim.exporting.elements import EXACT, CarriedCause, without
from catheter_sim.exporting.write import ExportedModel, PlainRun
from catheter_sim.modelling.build import robot_length
from catheter_sim.progress import Stages
from catheter_sim.simulation.replay import simulate

PERCENT = 2.0  # of the length: what a file may be off on held loops
_MOTION_ROWS = 18  # of a loop in motion
_MOTION_ROW_S = 0.25  # between them
_ROWS_BETWEEN = 25  # that are looked at
_NO_GRAVITY = np.zeros(3)


@dataclass(frozen=True)
class Distance:
    """How far apart two replays are.

    Attributes:
        loops: which loops, in words.
        largest_mm: of all elements' faces and rows; NaN where either diverges.
        rms_mm: of the tip over the rows.
    """

    loops: str
    largest_mm: float
    rms_mm: float


@dataclass(frozen=True)
class Cost:
    """What a cause costs where it is not in the file.

    Attributes:
        cause: which.
        distance: of the package's simulation with everything from that without the cause.
    """

    cause: CarriedCause
    distance: Distance


@dataclass(frozen=True)
class Judgement:
    """What was measured of a file.

    Attributes:
        length_mm: of the robot.
        held: file against package, on loops of one drive at a time, and of one against another that stands.
        moving: the same in motion; None: no cause needs a clock.
        bare: the robot as `build` writes it, without anything fitted, against the package.
        costs: of the causes that are left, and of those that are fitted.
    """

    length_mm: float
    held: tuple[Distance, ...]
    moving: Distance | None
    bare: Distance
    costs: tuple[Cost, ...]

    @property
    def percent(self) -> float:
        """The largest distance on held loops, in per cent of the length."""
        return 100.0 * max(item.largest_mm for item in self.held) / self.length_mm


def judge(model: ExportedModel, progress: bool = False) -> Judgement:
    """Replay a file and the package on loops that were not fitted.

    Held rows leave out what needs a clock; where a cause does, a loop in motion is replayed besides.
    """
    robot, drives = model.robot, model.drives
    alone, together = write.judged_loops(drives)
    seen = held_robot(robot, model.causes)
    with Stages("judging", progress) as stages:
        stages.say("replaying loops")
        held, parts = [], [(alone, "one drive at a time")]
        if together is not None:
            parts.append((together, "one drive while another pulls"))
        truths: list[Array] = []
        for inputs, name in parts:
            truth = _package(seen, inputs, progress=progress)
            held.append(
                distance_of(name, PlainRun(model.text, model.shares).held(inputs.tendon, progress), truth)
            )
            truths.append(truth)
        unfitted = distance_of(
            "one drive at a time", PlainRun(model.bare, model.shares).held(alone.tendon, progress), truths[0]
        )
        moving = None
        timed = [cause for cause in model.causes if cause.timed]
        if timed:
            stages.say("replaying motion")
            path = moving_loop(alone)
            moving = distance_of(
                "in motion",
                PlainRun(model.text, model.shares).followed(path.time_s, path.tendon),
                _package(robot, path, True, progress),
            )
        stages.say("costs of what is left out")
        costs = tuple(
            Cost(cause, _cost(robot, cause, alone, progress)) for cause in model.causes if cause.way != EXACT
        )
    return Judgement(1e3 * robot_length(robot), tuple(held), moving, unfitted, costs)


def held_robot(robot: RobotSpec, causes: tuple[CarriedCause, ...]) -> RobotSpec:
    """Return the robot with what shows in held rows, what is seen included."""
    return without(robot, tuple(cause for cause in causes if cause.timed))


def moving_loop(inputs: Inputs) -> Inputs:
    """Return the first rows of loops with the clock of a motion, and rows between them.

    The package delays rows, and runs straight between them: with few rows it would cut the corners.
    """
    count = min(len(inputs), _MOTION_ROWS)
    corners = _MOTION_ROW_S * np.arange(count)
    time_s = np.linspace(0.0, corners[-1], (count - 1) * _ROWS_BETWEEN + 1)
    tendon = np.stack([np.interp(time_s, corners, column) for column in inputs.tendon[:count].T], axis=1)
    nothing = np.zeros((len(time_s), 3))
    return replace(inputs, time_s=time_s, tendon=tendon, force_tip=nothing, moment_tip=nothing)


def _package(robot: RobotSpec, inputs: Inputs, dynamic: bool = False, progress: bool = False) -> Array:
    """Return where the package's simulation sees the faces, shape (r, n, 3) [m]; NaN from a failure on."""
    run = simulate(robot, inputs, _NO_GRAVITY, dynamic=dynamic, progress=progress)
    seen = np.array([posture.p_w for posture in run.postures])
    missing = len(inputs) - len(seen)
    return np.concatenate([seen, np.full((missing, *seen.shape[1:]), np.nan)])


def distance_of(name: str, first: Array, second: Array) -> Distance:
    """Return how far apart faces are in two replays, shape (r, n, 3) each [m]."""
    apart = 1e3 * np.linalg.norm(first - second, axis=2)
    return Distance(name, float(apart.max()), float(np.sqrt(np.mean(apart[:, -1] ** 2))))


def _cost(robot: RobotSpec, cause: CarriedCause, alone: Inputs, progress: bool) -> Distance:
    """Return how far the package's simulation moves where a cause is taken away."""
    rest = without(robot, (cause,))
    inputs = moving_loop(alone) if cause.timed else alone
    return distance_of(
        "in motion" if cause.timed else "one drive at a time",
        _package(rest, inputs, cause.timed, progress),
        _package(robot, inputs, cause.timed, progress),
    )
