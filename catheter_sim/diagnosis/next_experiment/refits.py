"""Whether fits confirm what a programme tells: every hypothesis fitted to what every other one says of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.fitting.fit import Fit, fit
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.fitting.workers import Workers, map_calls
from catheter_sim.diagnosis.next_experiment.alive import Alive
from catheter_sim.diagnosis.next_experiment.information import Information, from_refits
from catheter_sim.diagnosis.next_experiment.predictives import as_said, playable, said, stretches_of
from catheter_sim.diagnosis.next_experiment.programmes import Programme
from catheter_sim.diagnosis.thresholds import ROWS_AS_ONE


def by_fits(
    problem: Problem, hypotheses: tuple[Alive, ...], programme: Programme, noise: Array, pool: Workers
) -> Information:
    """Return what a programme tells where every hypothesis is fitted to what every other one says of it."""
    count = range(len(hypotheses))
    pairs = [(h, g) for h in count for g in count if h != g]
    work = [(problem, hypotheses[h].fit, hypotheses[g].fit, programme, noise) for h, g in pairs]
    errors = dict(zip(pairs, map_calls(pool, _error_by_stretch, work), strict=True))
    stretches = max((len(item) for item in errors.values()), default=1)
    none = np.zeros(stretches)
    rows = [[none if h == g else np.resize(errors[h, g], stretches) for g in count] for h in count]
    return from_refits([one.belief for one in hypotheses], rows)


def _error_by_stretch(problem: Problem, truth: Fit, other: Fit, programme: Programme, noise: Array) -> Array:
    """Return half the squared error, by stretch, of a hypothesis fitted to the data and to another's outputs.

    Over the noise, rows counted as in `_predictive`; zero where it finds no posture.
    """
    inputs = playable(problem, programme)
    trial = None if inputs is None else as_said(problem, truth, inputs)
    if trial is None:
        return np.zeros(1)
    together = replace(problem, trials=(*problem.trials, trial))
    again = fit(together, other.terms, other.values, cross_validate=False)
    labels = np.unique(stretches_of(problem, trial), return_inverse=True)[1]
    outputs = as_said(problem, again, trial)
    if outputs is None:
        return np.zeros(int(labels.max()) + 1)
    apart = ((said(problem, outputs) - said(problem, trial)) / noise).reshape(-1)
    return np.asarray(0.5 * np.bincount(labels, weights=apart**2) / ROWS_AS_ONE)


def off_by(
    problem: Problem, hypotheses: Sequence[Alive], programme: Programme, noise: Array
) -> dict[str, float]:
    """Return by how much rivals, fitted anew to all data and the programme, are off, over the noise."""
    inputs = playable(problem, programme)
    trial = None if inputs is None else as_said(problem, hypotheses[0].fit, inputs)
    if trial is None:
        return {}
    found = {}
    for item in hypotheses[1:]:
        together = replace(problem, trials=(*problem.trials, trial))
        again = fit(together, item.fit.terms, item.fit.values, cross_validate=False)
        outputs = as_said(problem, again, trial)
        if outputs is not None:
            apart = (said(problem, outputs) - said(problem, trial)) / noise
            found[item.about] = float(np.sqrt(np.mean(apart**2)))
    return found
