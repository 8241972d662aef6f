"""The face that every effect shows: its parameters, and what it changes in a robot, its inputs and outputs.

An effect never touches MuJoCo or a static model by itself. It changes the robot's specification
(which both read), or the inputs on their way to the robot, or the outputs on their way to the
user. So the simulation and its analytic twin carry the same effect by construction.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from catheter_sim.robots.channels import Inputs
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.posture import Array, Posture

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
        inverse: fitted as 1 / value (a stiffness as a compliance), so that `null` may be infinite;
            `scale` is then a change of the inverse.
    """

    name: str
    null: float
    lower: float
    upper: float
    scale: float
    start: float
    inverse: bool = False

    def to_fit(self, value: float) -> float:
        """Return the coordinate in which `value` is fitted."""
        if not self.inverse:
            return value
        return 0.0 if np.isinf(value) else 1.0 / value

    def from_fit(self, coordinate: float) -> float:
        """Return the value at a fit's coordinate."""
        if not self.inverse:
            return coordinate
        return float("inf") if coordinate == 0.0 else 1.0 / coordinate

    @property
    def fit_bounds(self) -> tuple[float, float]:
        """The bounds of the fit's coordinate."""
        ends = sorted((self.to_fit(self.lower), self.to_fit(self.upper)))
        return ends[0], ends[1]


def same_robot(robot: Robot, values: Values) -> Robot:
    """Leave the robot's specification as it is."""
    return robot


def same_inputs(robot: Robot, inputs: Inputs, values: Values) -> Inputs:
    """Leave the inputs as they are."""
    return inputs


def same_postures(robot: Robot, postures: tuple[Posture, ...], values: Values) -> tuple[Posture, ...]:
    """Leave the outputs as they are."""
    return postures


def all_together(robot: Robot) -> tuple[tuple[str, ...], ...]:
    """Return the one variant that frees every parameter."""
    return ((),)


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
        change_frames: the same for bare positions (..., 3) and orientations (..., 3, 3), which may
            belong to different frames, for speed; None where nothing observed changes.
        variants: which parameters a diagnosis frees together, simplest first; () frees all.
        least_trials: number of training trials below which a diagnosis cannot tell it from others.
    """

    name: str
    summary: str
    trace: str
    parameters: Callable[[Robot], tuple[Parameter, ...]]
    change_robot: Callable[[Robot, Values], Robot] = same_robot
    change_inputs: Callable[[Robot, Inputs, Values], Inputs] = same_inputs
    change_postures: Callable[[Robot, tuple[Posture, ...], Values], tuple[Posture, ...]] = same_postures
    change_frames: Callable[[Values, Array, Array], tuple[Array, Array]] | None = None
    variants: Callable[[Robot], tuple[tuple[str, ...], ...]] = all_together
    least_trials: int = 1

    def complete(self, robot: Robot, values: Values) -> dict[str, float]:
        """Return every parameter's value: the given one, or the one that does nothing."""
        return {item.name: float(values.get(item.name, item.null)) for item in self.parameters(robot)}
