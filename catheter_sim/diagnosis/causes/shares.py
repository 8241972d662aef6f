"""The named causes, each with its share of the held-out gain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from catheter_sim.diagnosis.fitting.evidence import errors_of, rmse_by_unit
from catheter_sim.diagnosis.fitting.fit import Fit, fit
from catheter_sim.diagnosis.fitting.intervals import Interval, intervals
from catheter_sim.diagnosis.fitting.problem import Problem, with_fewer_rows
from catheter_sim.diagnosis.fitting.workers import SERIAL, Workers, map_calls
from catheter_sim.diagnosis.report.result import Cause, FittedParameter, UnitResult


def named_causes(
    problem: Problem, test: Problem, after: Fit, result: UnitResult, unit: str, pool: Workers = SERIAL
) -> tuple[Cause, ...]:
    """Return the causes of a fitted hypothesis by their share of the held-out gain, largest first.

    A cause's share is the rise of the held-out error when the hypothesis is fitted without it, divided by the
    sum of these rises.
    """
    if not after.terms:
        return ()
    others = [tuple(item for item in after.terms if item is not term) for term in after.terms]
    without = map_calls(
        pool, fit, [(with_fewer_rows(problem), terms, after.values, False) for terms in others]
    )
    rises = [
        max(rmse_by_unit(test, errors_of(test, item))[unit] - result.rmse_after, 0.0) for item in without
    ]
    total = sum(rises)
    shares = [rise / total if total > 0.0 else 1.0 / len(rises) for rise in rises]
    bounds = intervals(after)
    values = after.values
    causes = []
    for term, share in zip(after.terms, shares, strict=True):
        null = {
            fitted.parameter.name: fitted.parameter.null
            for fitted in after.numbers
            if fitted.effect == term.effect
        }
        causes.append(
            Cause(
                name=term.effect,
                parameters={
                    name: FittedParameter(values[term.effect, name], bounds[term.effect, name], null[name])
                    for name in term.free
                },
                gain_percent=result.gain_percent * share,
            )
        )
    return tuple(sorted(causes, key=lambda cause: -cause.gain_percent))


def with_intervals(causes: Sequence[Cause], ends: Mapping[tuple[str, str], Interval]) -> tuple[Cause, ...]:
    """Return the causes with their parameters' intervals taken from `ends`."""
    return tuple(
        replace(
            cause,
            parameters={
                name: replace(item, ci95=ends[cause.name, name]) for name, item in cause.parameters.items()
            },
        )
        for cause in causes
    )
