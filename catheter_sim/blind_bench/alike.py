"""Whether two explanations can be told apart on a data set at all, whoever tries.

The data's twin is made anew from the true robot, without noise and without the simulation's differences.
A rival hypothesis, nuisance numbers included, is fitted to that. What is left, over the noise and rooted
over all values, is the distance d of the two hypotheses in these data: one who knew the noise and both
hypotheses would take one for the other with probability Phi(-d / 2).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import islice, product

import numpy as np

from catheter_sim.core.robot import RobotSpec
from catheter_sim.diagnosis.fit import fit
from catheter_sim.diagnosis.problem import Problem, Term, terms_for
from catheter_sim.diagnosis.trials import Trial, measured_of, unit_of

TOLD_APART = 4.0  # distance from which on two hypotheses can be told apart: 2 % would be mistaken
_MOST_VARIANTS = 6
Known = dict[tuple[str, str], float]


def distance(
    problem: Problem,
    trials: Sequence[Trial],
    true_robot: RobotSpec,
    noise: Mapping[str, float],
    effects: Sequence[str],
    known: Known,
) -> tuple[float, float]:
    """Return how far the nearest hypothesis with `effects` stays from the truth in these data.

    Args:
        problem: the data set's, for its robot, nuisance numbers and twin.
        trials: all trials of the data set.
        true_robot: the robot that made the data, effects attached.
        noise: standard deviation by unit.
        effects: the rival's names; () is the calibrated model.
        known: values to start from.

    Returns:
        The distance d, and the root mean square over the noise of a single value.
    """
    columns = problem.columns
    weight = np.array([noise[unit_of(name)] for name in columns])
    exact = tuple(_as_true(problem, trial, true_robot) for trial in trials)
    asked = replace(problem, trials=exact, weight=weight, every=1)
    best = np.inf
    count = 1
    for terms in islice(product(*(_variants(problem, name) for name in effects)), _MOST_VARIANTS):
        found = fit(asked, terms, known, cross_validate=False)
        found = fit(asked, terms, found.values, cross_validate=False, thorough=True)
        best = min(best, float(found.residual @ found.residual))
        count = len(found.residual)
    return float(np.sqrt(best)), float(np.sqrt(best / count))


def _variants(problem: Problem, effect: str) -> tuple[Term, ...]:
    """Return an effect's variants, the most detailed first."""
    return tuple(sorted(terms_for(problem.robot, effect), key=lambda term: -len(term.free)))


def _as_true(problem: Problem, trial: Trial, true_robot: RobotSpec) -> Trial:
    values = problem.twin([true_robot], trial.inputs, 1)[0]
    values = np.where(np.isfinite(measured_of(trial, problem.columns)), values, np.nan)
    columns = {name: values[:, index] for index, name in enumerate(problem.columns)}
    return replace(trial, outputs=replace(trial.outputs, columns=columns))
