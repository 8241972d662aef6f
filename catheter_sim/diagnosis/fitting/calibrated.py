"""The calibrated numbers of a fit, with their intervals."""

from __future__ import annotations

from catheter_sim.arrays import Array
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.intervals import intervals
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.fitting.profile import profile_interval
from catheter_sim.diagnosis.fitting.workers import SERIAL, Workers, map_calls
from catheter_sim.diagnosis.report.result import FittedParameter


def calibrated_numbers(
    problem: Problem,
    result: Fit,
    along_valleys: bool,
    margin: Array | None = None,
    pool: Workers = SERIAL,
) -> dict[str, FittedParameter]:
    """Return the calibrated numbers of a fit, with intervals.

    Args:
        problem: what was fitted.
        result: the fit.
        along_valleys: intervals by refitting all other numbers (`profile_interval`); needs a thorough fit.
        margin: as for `intervals`; not used along valleys.
        pool: where to do that.
    """
    numbers = [fitted.parameter for fitted in result.numbers if not fitted.effect]
    names = [item.name for item in numbers]
    if along_valleys:
        ends = map_calls(pool, profile_interval, [(problem, result, name) for name in names])
    else:
        bounds = intervals(result, margin)
        ends = [bounds["", name] for name in names]
    return {
        item.name: FittedParameter(result.values["", item.name], end, item.null)
        for item, end in zip(numbers, ends, strict=True)
    }
