"""Every set of causes that was fitted, by its held-out error."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catheter_sim.diagnosis.causes.scored import Scored
from catheter_sim.diagnosis.data.columns import unit_of
from catheter_sim.diagnosis.fitting.evidence import rmse_by_unit
from catheter_sim.diagnosis.fitting.gross_errors import untempered
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.fitting.residuals import column_of
from catheter_sim.diagnosis.report.result import Candidate


def ranking(test: Problem, hypotheses: Sequence[Scored], unit: str) -> tuple[Candidate, ...]:
    """Return every set of causes that was fitted with its held-out error, best first.

    Args:
        test: the held-out trials.
        hypotheses: what was fitted, with what it predicts.
        unit: of the errors.
    """
    mine = np.array([unit_of(name) == unit for name in test.columns])
    scale = float(np.sqrt(np.mean(test.weight[mine] ** 2)))
    weight = test.weight[column_of(test)]
    found = [
        Candidate(
            item.fit.causes,
            rmse_by_unit(test, untempered(item.heldout) * weight)[unit],
            item.fit.left_out_error_rms * scale,
        )
        for item in hypotheses
    ]
    return tuple(sorted(found, key=lambda candidate: candidate.heldout_rmse))
