"""A hypothesis about what is wrong: effects with parameters to fit, and what it predicts for trials.

A hypothesis is a set of terms, each an effect with the parameters that are freed; the empty set is the
model without causes, its nuisance parameters calibrated. Residuals are divided by their column's
weight. Every number is in units of a change that matters (`Parameter.scale`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from catheter_sim.diagnosis.nuisance import Nuisance
from catheter_sim.diagnosis.trials import Trial, cycles
from catheter_sim.diagnosis.twin import Twin
from catheter_sim.effects.face import Parameter
from catheter_sim.effects.registry import EFFECTS
from catheter_sim.robots.channels import Inputs
from catheter_sim.robots.kinds import Robot
from catheter_sim.robots.posture import Array

ENOUGH_ROWS = 600
FOLDS = 8  # of the cross-validation; a fold is a stretch of whole cycles
# Size in weights from which a residual counts by its size and no longer by its square (Huber 1964): what is
# wrong so grossly draws a fit in one direction, but does not outweigh all the rest of the data.
GROSS = 1e3
_FAILED = 1e3  # residual, in weights, of a robot that finds no equilibrium; at least, see `_failed`


@dataclass(frozen=True)
class Term:
    """An effect and the names of its parameters that are fitted."""

    effect: str
    free: tuple[str, ...]


@dataclass(frozen=True)
class Free:
    """One fitted number: a parameter of an effect, or a nuisance (then `effect` is empty).

    `spread` is its standard deviation about `parameter.null` known beforehand, inf where there is none.
    """

    effect: str
    parameter: Parameter
    spread: float = math.inf

    @property
    def key(self) -> tuple[str, str]:
        """Effect and parameter name."""
        return self.effect, self.parameter.name


@dataclass(frozen=True)
class Problem:
    """What stays the same for every hypothesis.

    Attributes:
        robot: as specified.
        nuisances: its known-uncertain numbers.
        trials: to fit.
        columns: outputs compared.
        weight: size of a residual per column that counts as one, shape (o,), in file units.
        twin: robots and inputs to outputs.
        every: each so-many-th row is compared; the others still make the history.
    """

    robot: Robot
    nuisances: tuple[Nuisance, ...]
    trials: tuple[Trial, ...]
    columns: tuple[str, ...]
    weight: Array
    twin: Twin
    every: int = 1


def terms_for(robot: Robot, effect: str) -> tuple[Term, ...]:
    """Return the ways in which `effect` may be freed for `robot`, simplest first."""
    parameters = EFFECTS[effect].parameters(robot)
    if not parameters:
        return ()
    everything = tuple(item.name for item in parameters)
    return tuple(Term(effect, names or everything) for names in EFFECTS[effect].variants(robot))


def frees_of(problem: Problem, terms: Sequence[Term]) -> tuple[Free, ...]:
    """Return what is fitted for a hypothesis: nuisances not superseded, then its effects' parameters."""
    found = []
    named = {term.effect for term in terms}
    for nuisance in problem.nuisances:
        if named.isdisjoint(nuisance.superseded_by):
            found.append(Free("", nuisance.parameter, nuisance.spread))
    for term in terms:
        by_name = {item.name: item for item in EFFECTS[term.effect].parameters(problem.robot)}
        found += [Free(term.effect, by_name[name]) for name in term.free]
    return tuple(found)


def robot_with(problem: Problem, frees: Sequence[Free], x: Array) -> Robot:
    """Return the specified robot with calibrated nuisances built in and the effects attached."""
    robot = problem.robot
    effects: dict[str, dict[str, float]] = {name: dict(values) for name, values in robot.effects.items()}
    factors = {}
    for free, value in zip(frees, x, strict=True):
        number = free.parameter.from_fit(float(value) * free.parameter.scale)
        if free.effect:
            effects.setdefault(free.effect, {})[free.parameter.name] = number
        else:
            factors[free.parameter.name] = number
    for nuisance in problem.nuisances:
        if nuisance.name in factors:
            robot = nuisance.change_robot(robot, factors[nuisance.name])
    return replace(robot, effects=effects)


def thinned(problem: Problem) -> Problem:
    """Return `problem` with as many rows compared as a choice between hypotheses needs (`ENOUGH_ROWS`)."""
    rows = sum(len(trial.inputs) for trial in problem.trials)
    return replace(problem, every=max(1, round(rows / ENOUGH_ROWS)))


def residuals(problem: Problem, frees: Sequence[Free], xs: Array) -> Array:
    """Return model minus measurement over weight for many parameter vectors, shape (B, n).

    What is larger than `GROSS` is made smaller so that its square is Huber's loss (`tempered`). A robot
    without equilibrium errs by more than any robot that stands still.

    Args:
        problem: trials and twin.
        frees: what the columns of `xs` are.
        xs: shape (B, p), in units of the parameters' scales.
    """
    parts, models = [], {}
    robots, which = _distinct_robots(problem, frees, xs)
    for trial in problem.trials:
        key = _key_of(trial.inputs)
        if key not in models:  # a trial that was repeated is computed once
            outputs = problem.twin(robots, trial.inputs, problem.every)[which]
            models[key] = _moved(problem, frees, xs, outputs)
        measured = measured_of(trial, problem.columns)[:: problem.every]
        error = (models[key] - measured) / problem.weight
        parts.append(error[:, np.isfinite(measured)])
    stacked = np.concatenate(parts, axis=1)
    found = np.isfinite(stacked)
    if found.all():
        return tempered(stacked)
    return np.where(found, tempered(np.where(found, stacked, 0.0)), _failed(problem))


def predicted(problem: Problem, frees: Sequence[Free], x: Array, inputs: Inputs, every: int = 1) -> Array:
    """Return the outputs of a hypothesis along inputs, at each `every`-th row, shape (r, o), in file units.

    Args:
        problem: robot, nuisances and twin.
        frees: what `x` is.
        x: shape (p,), in units of the parameters' scales.
        inputs: what is commanded.
        every: each so-many-th row is returned.
    """
    outputs = problem.twin([robot_with(problem, frees, x)], inputs, every)
    return moved(problem, frees, x, outputs[0])


def moved(problem: Problem, frees: Sequence[Free], x: Array, outputs: Array) -> Array:
    """Return a robot's outputs (r, o) as they are measured: by what acts on them and not on the robot."""
    return _moved(problem, frees, x[None], outputs[None])[0]


def _distinct_robots(
    problem: Problem, frees: Sequence[Free], xs: Array
) -> tuple[list[Robot], np.ndarray | slice]:
    """Return the robots of many parameter vectors, and which of them each vector has, shape (B,).

    Vectors that differ only in numbers that act on the outputs share a robot.
    """
    outside = _acting_on_outputs(problem, frees)
    if not outside:
        return [robot_with(problem, frees, x) for x in xs], slice(None)
    inside = np.array(xs)
    inside[:, list(outside)] = 0.0
    distinct, which = np.unique(inside, axis=0, return_inverse=True)
    return [robot_with(problem, frees, x) for x in distinct], which.reshape(-1)


def _moved(problem: Problem, frees: Sequence[Free], xs: Array, outputs: Array) -> Array:
    for index, nuisance in _acting_on_outputs(problem, frees).items():
        assert nuisance.change_outputs is not None
        values = xs[:, index] * nuisance.parameter.scale
        outputs = nuisance.change_outputs(problem.columns, outputs, values)
    return outputs


def _acting_on_outputs(problem: Problem, frees: Sequence[Free]) -> dict[int, Nuisance]:
    """Return the nuisances that act on the outputs by their place among `frees`."""
    by_name = {item.name: item for item in problem.nuisances if item.change_outputs is not None}
    return {
        index: by_name[free.parameter.name]
        for index, free in enumerate(frees)
        if not free.effect and free.parameter.name in by_name
    }


def tempered(error: Array) -> Array:
    """Return errors in weights so that their squares are Huber's loss: linear beyond `GROSS`, same shape."""
    size = np.abs(error)
    root = np.sqrt(np.maximum(2.0 * size - GROSS, 0.0) * GROSS)
    return np.where(size > GROSS, np.copysign(root, error), error)


def untempered(residual: Array) -> Array:
    """Return the errors that `tempered` made the residuals of, same shape."""
    size = np.abs(residual)
    return np.where(size > GROSS, np.copysign((residual**2 / GROSS + GROSS) / 2.0, residual), residual)


def _failed(problem: Problem) -> float:
    """Return the residual of a row without equilibrium: larger than of a robot that stands still."""
    size = max(
        float(np.nanmax(np.abs(measured_of(trial, problem.columns)) / problem.weight, initial=0.0))
        for trial in problem.trials
    )
    return float(tempered(np.array(max(_FAILED, 2.0 * size))))


def _key_of(inputs: Inputs) -> tuple[bytes, ...]:
    numbers = inputs.time_s, inputs.tendon, inputs.force_tip, inputs.moment_tip
    return inputs.actuation.encode(), *(item.tobytes() for item in numbers)


def measured_of(trial: Trial, columns: Sequence[str]) -> Array:
    """Return a trial's outputs, shape (r, o), NaN where missing."""
    return np.stack([trial.outputs.columns[name] for name in columns], axis=1)


def blocks_of(problem: Problem, fewest: int = 2 * FOLDS) -> np.ndarray:
    """Return the block of each residual: a whole cycle of a trial, in order, shape (n,).

    Where there are fewer cycles than `fewest`, cycles are cut into stretches of equal length.
    """
    stretches: list[tuple[int, slice]] = [
        (index, part) for index, trial in enumerate(problem.trials) for part in cycles(trial)
    ]
    pieces = -(-fewest // max(len(stretches), 1))
    labels = [np.zeros(len(trial.inputs), dtype=int) for trial in problem.trials]
    count = 0
    for index, part in stretches:
        rows = np.arange(part.start, part.stop)
        shortest = 4 if len(rows) >= fewest else 1
        for piece in np.array_split(rows, min(pieces, max(1, len(rows) // shortest))):
            labels[index][piece] = count
            count += 1
    parts = []
    for trial, label in zip(problem.trials, labels, strict=True):
        finite = np.isfinite(measured_of(trial, problem.columns)[:: problem.every])
        parts.append(np.broadcast_to(label[:: problem.every, None], finite.shape)[finite])
    return np.concatenate(parts)


def column_of(problem: Problem) -> np.ndarray:
    """Return the index of the output column of each residual, shape (n,)."""
    parts = []
    for trial in problem.trials:
        finite = np.isfinite(measured_of(trial, problem.columns)[:: problem.every])
        parts.append(np.broadcast_to(np.arange(finite.shape[1]), finite.shape)[finite])
    return np.concatenate(parts)


def fold_of(block: np.ndarray, folds: int = FOLDS) -> np.ndarray:
    """Return the fold of each residual: stretches of neighbouring blocks, alike in rows, shape (n,)."""
    order = np.unique(block, return_inverse=True)[1]
    sizes = np.bincount(order)
    middle = np.cumsum(sizes) - 0.5 * sizes
    return np.minimum((middle * folds / sizes.sum()).astype(int), folds - 1)[order]


def start_of(frees: Sequence[Free], known: dict[tuple[str, str], float] | None = None) -> Array:
    """Return where a fit starts: `known` values, or each parameter's own start."""
    values = known or {}
    return np.array(
        [
            free.parameter.to_fit(values.get(free.key, free.parameter.start)) / free.parameter.scale
            for free in frees
        ]
    )
