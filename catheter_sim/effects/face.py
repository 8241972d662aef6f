"""The face that every effect shows: its parameters, and what it changes in a robot, its inputs and outputs.

An effect never touches MuJoCo or a static model by itself. It changes the robot's specification
(which both read), or the inputs on their way to the robot, or the outputs on their way to the
user. So the simulation and its analytic twin carry the same effect by construction.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from catheter_sim.robots.channels import Inputs
from catheter_sim.robots.posture import Posture
from catheter_sim.robots.specification import ContinuumRobot

Values = Mapping[str, float]  # parameter name (with file unit) -> value in that unit


@dataclass(frozen=True)
class Parameter:
    """One number of an effect.

    Attributes:
        name: with its file unit ("width_mm").
        null: the value at which the effect does nothing.
        lower, upper: bounds of what is physically sensible.
        scale: a change that matters, for conditioning a fit.
        start: where a fit starts, away from `null` where the effect has no gradient there.
    """

    name: str
    null: float
    lower: float
    upper: float
    scale: float
    start: float


def same_robot(robot: ContinuumRobot, values: Values) -> ContinuumRobot:
    """Leave the robot's specification as it is."""
    return robot


def same_inputs(robot: ContinuumRobot, inputs: Inputs, values: Values) -> Inputs:
    """Leave the inputs as they are."""
    return inputs


def same_postures(
    robot: ContinuumRobot, postures: tuple[Posture, ...], values: Values
) -> tuple[Posture, ...]:
    """Leave the outputs as they are."""
    return postures


@dataclass(frozen=True)
class Effect:
    """A cause of error by its contract name.

    Attributes:
        name: from the closed list of cause names.
        summary: what it is, one line.
        trace: what a person would look for in data.
        parameters: the effect's parameters for a given robot (its channels may name them); empty
            where the effect makes no sense for the robot.
        change_robot: the specification with the effect in it.
        change_inputs: what arrives at the robot instead of the commanded inputs.
        change_postures: what is observed instead of the robot's postures.
    """

    name: str
    summary: str
    trace: str
    parameters: Callable[[ContinuumRobot], tuple[Parameter, ...]]
    change_robot: Callable[[ContinuumRobot, Values], ContinuumRobot] = same_robot
    change_inputs: Callable[[ContinuumRobot, Inputs, Values], Inputs] = same_inputs
    change_postures: Callable[[ContinuumRobot, tuple[Posture, ...], Values], tuple[Posture, ...]] = (
        same_postures
    )
