"""What a hypothesis predicts: its robot, and that robot's outputs as they would be measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.data.nuisance import Nuisance
from catheter_sim.diagnosis.fitting.problem import FittedNumber, Problem
from catheter_sim.theory.predict import along


def robot_with(problem: Problem, numbers: Sequence[FittedNumber], x: Array) -> RobotSpec:
    """Return the specified robot with calibrated nuisances built in and the effects attached."""
    robot = problem.robot
    effects: dict[str, dict[str, float]] = {name: dict(values) for name, values in robot.effects.items()}
    factors = {}
    for fitted, value in zip(numbers, x, strict=True):
        value_in_unit = fitted.parameter.from_fit(float(value) * fitted.parameter.scale)
        if fitted.effect:
            effects.setdefault(fitted.effect, {})[fitted.parameter.name] = value_in_unit
        else:
            factors[fitted.parameter.name] = value_in_unit
    for nuisance in problem.nuisances:
        if nuisance.name in factors:
            robot = nuisance.change_robot(robot, factors[nuisance.name])
    return replace(robot, effects=effects)


def predicted(
    problem: Problem, numbers: Sequence[FittedNumber], x: Array, inputs: Inputs, every: int = 1
) -> Array:
    """Return the outputs of a hypothesis along inputs, at each `every`-th row, shape (r, o), in file units.

    Args:
        problem: robot, nuisances and twin.
        numbers: what `x` is.
        x: shape (p,), in units of the parameters' scales.
        inputs: what is commanded.
        every: each so-many-th row is returned.
    """
    outputs = problem.twin([robot_with(problem, numbers, x)], inputs, every)
    return as_measured(problem, numbers, x, outputs[0])


def predicted_along(
    problem: Problem, numbers: Sequence[FittedNumber], x: Array, trials: Sequence[Inputs]
) -> list[Array]:
    """Return the outputs of a hypothesis along each of several trials' inputs, as `predicted` does."""
    robot = robot_with(problem, numbers, x)
    return [as_measured(problem, numbers, x, item[0]) for item in along(problem.twin, [robot], trials)]


def as_measured(problem: Problem, numbers: Sequence[FittedNumber], x: Array, outputs: Array) -> Array:
    """Return a robot's outputs (r, o) as they are measured: with the nuisances that act on outputs alone."""
    return all_as_measured(problem, numbers, x[None], outputs[None])[0]


def all_as_measured(problem: Problem, numbers: Sequence[FittedNumber], xs: Array, outputs: Array) -> Array:
    for index, nuisance in _acting_on_outputs(problem, numbers).items():
        assert nuisance.change_outputs is not None
        values = xs[:, index] * nuisance.parameter.scale
        outputs = nuisance.change_outputs(problem.columns, outputs, values)
    return outputs


def distinct_robots(
    problem: Problem, numbers: Sequence[FittedNumber], xs: Array
) -> tuple[list[RobotSpec], np.ndarray | slice]:
    """Return the robots of many parameter vectors, and which of them each vector has, shape (B,).

    Vectors that differ only in numbers that act on the outputs share a robot.
    """
    outside = _acting_on_outputs(problem, numbers)
    if not outside:
        return [robot_with(problem, numbers, x) for x in xs], slice(None)
    inside = np.array(xs)
    inside[:, list(outside)] = 0.0
    distinct, which = np.unique(inside, axis=0, return_inverse=True)
    return [robot_with(problem, numbers, x) for x in distinct], which.reshape(-1)


def _acting_on_outputs(problem: Problem, numbers: Sequence[FittedNumber]) -> dict[int, Nuisance]:
    """Return the nuisances that act on the outputs by their place among `numbers`."""
    by_name = {item.name: item for item in problem.nuisances if item.change_outputs is not None}
    return {
        index: by_name[fitted.parameter.name]
        for index, fitted in enumerate(numbers)
        if not fitted.effect and fitted.parameter.name in by_name
    }
