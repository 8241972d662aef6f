"""Drives a simulated robot along a history of inputs and records its posture row by row."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import outputs_of
from catheter_sim.core.inputs import Inputs, LinkForce, row_name, slice_inputs
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects.apply import in_force
from catheter_sim.effects.varying import mixed, mixed_postures, varies
from catheter_sim.errors import InputError, SimulationDiverged
from catheter_sim.progress import counted
from catheter_sim.simulation.simulator import Simulator

# ----------------------------------------------------------------------------------------------------
# A history of inputs as what a simulator is given: its rows, or their means over steps.


class Commands:
    """Inputs of a run.

    Attributes:
        time_s: of the rows, shape (r,).
        rows: inputs of all kinds in one row, SI, shape (r, c).
    """

    def __init__(self, inputs: Inputs, others: Sequence[LinkForce] = ()) -> None:
        """Take inputs over; `others` are forces on elements that stay as they are."""
        count = len(inputs)
        self.time_s = inputs.time_s
        self.rows = np.concatenate(
            [
                inputs.tendon,
                inputs.force_tip,
                inputs.moment_tip,
                np.concatenate([inputs.force_body, inputs.moment_body], axis=2).reshape(count, -1)
                if inputs.bodies
                else np.zeros((count, 0)),
            ],
            axis=1,
        )
        self._tendons, self._bodies, self._others = inputs.tendon.shape[1], inputs.bodies, tuple(others)
        self._times = self.time_s - self.time_s[0]
        self._slopes = np.zeros_like(self.rows)
        self._slopes[:-1] = np.diff(self.rows, axis=0) / np.diff(self.time_s)[:, np.newaxis]
        between = 0.5 * np.diff(self.time_s)[:, np.newaxis] * (self.rows[:-1] + self.rows[1:])
        self._integral = np.concatenate([np.zeros((1, self.rows.shape[1])), np.cumsum(between, axis=0)])

    def set(self, simulator: Simulator, values: Array) -> None:
        """Give a simulator the numbers of one row, shape (c,)."""
        t = self._tendons
        on_bodies = [
            LinkForce(body, None, _plain(part[:3]), _plain(part[3:]))
            for body, part in zip(self._bodies, values[t + 6 :].reshape(-1, 6), strict=True)
        ]
        others = (*self._others, *on_bodies)
        simulator.put_inputs(values[:t], values[t : t + 3], values[t + 3 : t + 6], others)

    def means(self, at_s: Array, width_s: float) -> Array:
        """Return the inputs' means (k, c) over windows of `width_s` about times since the first row, (k,).

        On the line between two rows that is the value itself; where rows are closer than a step, each counts
        as long as it lasts. Before the first row and after the last one inputs stay as they are there.
        """
        half = 0.5 * width_s
        return np.asarray((self._integrals(at_s + half) - self._integrals(at_s - half)) / width_s)

    def _integrals(self, at_s: Array) -> Array:
        """Return the inputs' integrals from the first row to times since then, shape (k, c)."""
        times, rows = self._times, self.rows
        row = np.clip(np.searchsorted(times, at_s, side="right") - 1, 0, len(times) - 1)
        beyond = (at_s - times[row])[:, np.newaxis]
        slope = np.where(beyond >= 0.0, self._slopes[row], 0.0)
        return np.asarray(self._integral[row] + beyond * (rows[row] + 0.5 * slope * beyond))


def _plain(vector: Array) -> tuple[float, float, float]:
    return float(vector[0]), float(vector[1]), float(vector[2])


# ----------------------------------------------------------------------------------------------------
# Drives a simulated robot along a history of inputs and records its posture row by row.

RAMP_S = 2.0  # simulated time from one held row to the next
_LONG_WAY_S = 10.0  # of motion from one row to the next: its seconds are counted, too


@dataclass(frozen=True)
class SimulationRun:
    """Postures of a simulated robot along a history of inputs.

    Attributes:
        inputs: the rows that were reached, as commanded.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
        postures: one per reached row, as observed.
        at_rest: whether the robot had come to rest at each reached row, shape (r,); in a dynamic run the
            first row's says whether the motion began at rest, the others are true.
        failure: None, or the line that says at which row and time the simulation diverged.
    """

    inputs: Inputs
    gravity_mps2: Array
    postures: tuple[Posture, ...]
    at_rest: np.ndarray
    failure: str | None


def simulate(
    robot: RobotSpec,
    inputs: Inputs,
    gravity_mps2: Array,
    dynamic: bool = False,
    friction: str = "capstan",
    ramp_s: float = RAMP_S,
    progress: bool = False,
    on_row: Callable[[Simulator, int], None] | None = None,
    others: Sequence[LinkForce] = (),
) -> SimulationRun:
    """Return what is observed of the robot under `inputs`, starting from rest with zero inputs.

    In motion the first row is still held until rest: the motion begins at rest under its inputs and gravity.

    Args:
        robot: the robot as it is specified; its `effects` act on it, on the inputs and on what is observed.
        inputs: rows of inputs; they change linearly from row to row.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
        dynamic: from the first row on, follow `time_s` with the masses' inertia and the robot's own damping;
            otherwise each row is approached in `ramp_s` and held until rest.
        friction: "capstan", "nested" or "none".
        ramp_s: simulated time from one held row to the next [s].
        progress: show on standard error how many rows are done.
        on_row: called with the simulator, whose robot has its effects built in, and the row's index when a
            row is reached.
        others: further forces, at points of elements, steady from the start (`Simulator.set_inputs`).

    Raises:
        InputError: the robot cannot be built, an effect is not possible, a force acts on an element that
            it does not have, or a row asks for a displacement that its robot cannot follow.

    A simulation that diverges ends there; `failure` says at which row and time, and the rows before
    it are returned.
    """
    if varies(robot):
        if on_row is not None or others:
            raise InputError(
                f"{robot.name}: a number of its effects varies: pictures, and forces on elements, need one "
                "that stays the same"
            )
        return _of_varying(robot, inputs, gravity_mps2, dynamic, friction, ramp_s, progress)
    acting = in_force(robot, inputs, moving=dynamic)
    arriving = acting.inputs
    simulator = Simulator(acting.robot, arriving.actuation, gravity_mps2, friction, inertia=False)
    gravity = np.asarray(gravity_mps2, dtype=float)
    postures: list[Posture] = []
    at_rest: list[bool] = []
    failure = None
    commands = Commands(arriving, others)
    before = np.zeros_like(commands.rows[0])
    held_steps = round(ramp_s / simulator.model.opt.timestep)
    for row in counted(range(len(inputs)), len(inputs), "simulating", "row", progress):
        try:
            if row == 0 and (gravity.any() or others):
                commands.set(simulator, before)
                simulator.settle()
            ahead_s, rests = 0.0, True
            if simulator.moving:
                ahead_s = _follow(simulator, commands, row, progress)
            else:
                ramp(simulator, commands, before, commands.rows[row], held_steps)
                rests = simulator.settle()
            simulator.require_finite()
        except SimulationDiverged as error:
            failure = f"{error}, at row {row + 1} (time_s = {inputs.time_s[row]:g})"
            break
        except InputError as error:
            raise InputError(f"{row_name(inputs, row)}: {error}") from None
        at_rest.append(rests)
        postures.append(simulator.posture(ahead_s))
        before = commands.rows[row]
        if on_row is not None:
            on_row(simulator, row)
        if dynamic and row == 0:
            simulator.let_go()
    done = len(postures)
    return SimulationRun(
        slice_inputs(inputs, slice(0, done)),
        gravity,
        acting.observed(tuple(postures)),
        np.array(at_rest[:done], bool),
        failure,
    )


def _of_varying(
    robot: RobotSpec,
    inputs: Inputs,
    gravity_mps2: Array,
    dynamic: bool,
    friction: str,
    ramp_s: float,
    progress: bool,
) -> SimulationRun:
    """Return what is observed of a robot whose numbers vary; arguments as of `simulate`."""
    mix = mixed(robot, inputs, outputs_of(robot).elements)
    runs = [simulate(leaf, inputs, gravity_mps2, dynamic, friction, ramp_s, progress) for leaf in mix.robots]
    shortest = min(runs, key=lambda run: len(run.postures))
    done = len(shortest.postures)
    at_rest = np.all([run.at_rest[:done] for run in runs], axis=0)
    postures = mixed_postures(mix, [run.postures for run in runs])
    return replace(shortest, postures=postures, at_rest=at_rest)


def ramp(simulator: Simulator, commands: Commands, start: Array, end: Array, steps: int) -> None:
    """Move the inputs along the straight line from `start` to `end` in so many steps.

    They slow down toward the end, so that the robot has caught up with them when they stop: dry friction
    would remember by how much it lagged.
    """
    for i in range(1, steps + 1):
        share = 1.0 - (1.0 - i / steps) ** 3
        commands.set(simulator, start + (end - start) * share)
        simulator.step()
    commands.set(simulator, end)
    simulator.require_finite()


def _follow(simulator: Simulator, commands: Commands, row: int, progress: bool) -> float:
    """Let a moving robot follow its inputs to the step nearest to a row; return how far that is ahead [s]."""
    step_s = simulator.model.opt.timestep
    since_s = commands.time_s - commands.time_s[0]
    first, last = (round(float(since_s[k]) / step_s) for k in (row - 1, row))
    seconds = range(first, last, max(1, round(1.0 / step_s)))  # no more is held of the inputs at once
    shown = progress and len(seconds) > _LONG_WAY_S
    for start in counted(seconds, len(seconds), f"simulating row {row + 1}", "second", shown):
        steps = np.arange(start, min(start + seconds.step, last))
        for values in commands.means(steps * step_s, step_s):
            commands.set(simulator, values)
            simulator.step()
    return float(since_s[row]) - last * step_s
