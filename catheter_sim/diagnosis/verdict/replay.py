"""Held-out trials replayed in MuJoCo with the causes built into the robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.columns import posture_columns
from catheter_sim.core.drive import Quantity, quantity_of
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.data.trials import Trial, measured_of
from catheter_sim.diagnosis.fitting.workers import SERIAL, Workers, map_calls
from catheter_sim.diagnosis.thresholds import (
    DRY_RAMP_S,
    DRY_STRIDE,
    SMOOTH_DRIVEN_STRIDE,
    SMOOTH_RAMP_S,
    SMOOTH_STRIDE,
)
from catheter_sim.effects.apply import arriving_inputs, embodied, observed
from catheter_sim.simulation.replay import SimulationRun, simulate


@dataclass(frozen=True)
class Replay:
    """A trial replayed in the simulation.

    Attributes:
        outputs: in file units, shape (r, o); NaN beyond the row at which the simulation failed.
        measured: shape (r, o), NaN where missing.
        failure: None, or why the simulation ended early.
        restless: rows at which the robot had not come to rest.
    """

    outputs: Array
    measured: Array
    failure: str | None
    restless: int
    SHAPES = "outputs:ro measured:ro"  # of what is read (`kept`)


def replays(
    robot: RobotSpec,
    trials: Sequence[Trial],
    columns: Sequence[str],
    gravity_mps2: Array,
    pool: Workers = SERIAL,
    moving: bool = False,
) -> list[Replay]:
    """Return trials replayed with `robot`, its effects in force, in motion or row by held row."""
    call = replay_in_motion if moving else replay
    return map_calls(pool, call, [(robot, trial, columns, gravity_mps2) for trial in trials])


def replay_in_motion(robot: RobotSpec, trial: Trial, columns: Sequence[str], gravity_mps2: Array) -> Replay:
    """Return a trial in motion replayed with `robot`, its effects in force, from rest under the first row."""
    arriving = arriving_inputs(robot, trial.inputs, moving=True)
    run = simulate(embodied(robot), arriving, gravity_mps2, dynamic=True)
    return _replayed(robot, trial, columns, run)


def replay(
    robot: RobotSpec, trial: Trial, columns: Sequence[str], gravity_mps2: Array, progress: bool = False
) -> Replay:
    """Return a trial replayed with `robot`, its effects in force.

    In time steps longer than the robot's own: held rows end at rest, wherever the steps between them fell. A
    run that so fails, or does not come to rest, is made anew in its own.
    """
    built = embodied(robot)
    arriving = arriving_inputs(robot, trial.inputs)
    # Dry friction remembers an overshoot, so that a robot without it may be moved faster.
    dry = built.friction.mu > 0.0
    ramp_s = DRY_RAMP_S if dry else SMOOTH_RAMP_S
    if quantity_of(arriving.actuation) is Quantity.TENSION:
        stride = DRY_STRIDE if dry else SMOOTH_STRIDE
    else:
        stride = 1 if dry else SMOOTH_DRIVEN_STRIDE
    longer = replace(built.dynamics, timestep_s=built.dynamics.timestep_s * stride)
    run = simulate(replace(built, dynamics=longer), arriving, gravity_mps2, ramp_s=ramp_s, progress=progress)
    if stride > 1 and (run.failure is not None or not run.at_rest.all()):
        run = simulate(built, arriving, gravity_mps2, ramp_s=ramp_s, progress=progress)
    return _replayed(robot, trial, columns, run)


def _replayed(robot: RobotSpec, trial: Trial, columns: Sequence[str], run: SimulationRun) -> Replay:
    outputs = np.full((len(trial.inputs), len(columns)), np.nan)
    if run.postures:
        values = posture_columns(robot, observed(robot, trial.inputs.time_s, run.postures))
        outputs[: len(run.postures)] = np.stack([values[name] for name in columns], axis=1)
    return Replay(outputs, measured_of(trial, columns), run.failure, int((~run.at_rest).sum()))
