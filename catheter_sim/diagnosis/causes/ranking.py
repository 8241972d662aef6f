"""Every set of causes that was fitted, by its held-out error."""

from __future__ import annotations

import numpy as np

from catheter_sim.diagnosis.causes.choose import Selection
from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.fitting.evidence import errors_of, rmse_by_unit
from catheter_sim.diagnosis.fitting.fit import Fit, fit
from catheter_sim.diagnosis.fitting.problem import Problem, with_fewer_rows
from catheter_sim.diagnosis.report.result import Candidate


def ranking(
    problem: Problem, test: Problem, selection: Selection, named: Fit, unit: str
) -> tuple[Candidate, ...]:
    """Return every set of causes that was fitted with its held-out error, best first.

    Of several variants of a set (one value, or one per channel) the one that the cross-validation
    prefers stands for it; for the chosen set the chosen variant.

    Args:
        problem: the training trials.
        test: the held-out trials.
        selection: what was tried.
        named: the hypothesis of the verdict; where causes were taken out of the chosen set, it may not be
            among those that were tried, and is then fitted to the stretches left out too.
        unit: of the errors.
    """
    best: dict[tuple[str, ...], Fit] = {}
    for item in (selection.null, *selection.singles, *selection.tried, *selection.path):
        names = tuple(sorted(item.causes))
        if names not in best or item.cross_validated_rms < best[names].cross_validated_rms:
            best[names] = item
    best[tuple(sorted(selection.chosen.causes))] = selection.chosen
    if named.terms and tuple(sorted(named.causes)) not in best:
        best[tuple(sorted(named.causes))] = fit(with_fewer_rows(problem), named.terms, named.values)
    mine = np.array([unit_of(name) == unit for name in test.columns])
    scale = float(np.sqrt(np.mean(test.weight[mine] ** 2)))
    found = [
        Candidate(
            item.causes, rmse_by_unit(test, errors_of(test, item))[unit], item.left_out_error_rms * scale
        )
        for item in best.values()
    ]
    return tuple(sorted(found, key=lambda candidate: candidate.heldout_rmse))
