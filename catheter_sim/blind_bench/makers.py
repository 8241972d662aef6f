"""What a robot shows along a trial, by the simulation, which makes the data, and by the twin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.blind_bench.outside import Outside
from catheter_sim.blind_bench.robots import BenchRobot
from catheter_sim.columns import posture_columns
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.posture import Posture
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects.apply import arriving_inputs, embodied, observed
from catheter_sim.errors import InputError
from catheter_sim.simulation.replay import simulate
from catheter_sim.theory.predict import twin_for
from catheter_sim.theory.run import STATIC_MODELS

ROD_MODEL = STATIC_MODELS["VC_ref_noproj"]
RAMP_S = 0.5  # simulated time from row to row


class CannotMake(Exception):
    """The simulation, or the twin, finds no posture for some row: another draw is needed."""


@dataclass(frozen=True)
class Simulated:
    """A simulated trial: the robot that was simulated, and its postures as they are observed."""

    robot: RobotSpec
    postures: tuple[Posture, ...]

    def columns(self, names: Sequence[str]) -> Array:
        """Return output columns, shape (r, o), in file units."""
        values = posture_columns(self.robot, self.postures)
        return np.stack([values[name] for name in names], axis=1)


def simulated(
    bench: BenchRobot, robot: RobotSpec, inputs: Inputs, gravity_mps2: Array, outside: Outside | None = None
) -> Simulated:
    """Return a trial of the robot with its effects, by the simulation or by the rod model.

    Raises:
        CannotMake: the simulation diverged, or an input goes beyond a joint's range.
    """
    built = replace(embodied(robot), **bench.trials.simulated)
    arriving = arriving_inputs(robot, inputs)
    if outside is not None:
        arriving = outside.change_inputs(arriving)
    try:
        # The rod model's friction knows no history.
        if bench.trials.rods and built.friction.mu == 0.0 and ROD_MODEL.applies_to(built):
            postures = ROD_MODEL.solve(built, arriving, gravity_mps2).postures
        else:
            run = simulate(built, arriving, gravity_mps2, ramp_s=RAMP_S)
            if run.failure:
                raise CannotMake(run.failure)
            postures = run.postures
    except InputError as error:
        raise CannotMake(str(error)) from None
    if outside is not None:
        postures = outside.change_postures(postures)
    return Simulated(built, observed(robot, inputs.time_s, postures))


def twin_outputs(
    robots: Sequence[RobotSpec], trials: Sequence[Inputs], columns: Sequence[str], gravity_mps2: Array
) -> list[Array]:
    """Return the twin's outputs of several robots along each trial, shape (B, r, o) each; NaN: none found."""
    twin = twin_for(robots[0], trials[0].actuation, columns, gravity_mps2)
    found = []
    for inputs in trials:
        try:
            found.append(twin(robots, inputs, 1))
        except InputError:
            found.append(np.full((len(robots), len(inputs), len(columns)), np.nan))
    return found


def rms(values: Array) -> float:
    """Return the root mean square; NaN where a value is missing."""
    return float(np.sqrt(np.mean(values**2)))
