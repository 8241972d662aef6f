"""What fits data that hold too little to name a cause, where a search was asked for all the same."""

from __future__ import annotations

from dataclasses import replace

from catheter_sim.diagnosis.causes.plausible import implausible
from catheter_sim.diagnosis.causes.shares import with_intervals
from catheter_sim.diagnosis.fitting.evidence import errors_of, rmse_by_unit
from catheter_sim.diagnosis.fitting.fit import Fit, fit
from catheter_sim.diagnosis.fitting.intervals import cause_intervals
from catheter_sim.diagnosis.fitting.noise import times_noise
from catheter_sim.diagnosis.report.result import Unproved
from catheter_sim.diagnosis.stages.calibrate import noise_beside
from catheter_sim.diagnosis.stages.choose_causes import Choice
from catheter_sim.diagnosis.stages.decide_on_heldout import Settled
from catheter_sim.diagnosis.stages.pose import Posed
from catheter_sim.diagnosis.thresholds import EQUAL_FACTOR, PAYS_SHARE


def fit_unproved(posed: Posed, choice: Choice, settled: Settled) -> Unproved:
    """Return the hypothesis that fits: the settled one, or the simplest of the best that were tried."""
    after = settled.weighed.after
    if not after.terms:
        after = _best_tried(posed, choice)
    scales = replace(settled.scales, noise=noise_beside(posed.train, after))
    by_unit = scales.held_out(after)
    training = rmse_by_unit(posed.train, errors_of(posed.train, after))
    times = max(
        times_noise(max(training.get(unit, 0.0), item.rmse_after), item.noise_floor)
        for unit, item in by_unit.items()
    )
    unlikely = implausible(after)
    causes = tuple(cause for cause in scales.causes(after, by_unit) if cause.name not in unlikely)
    return Unproved(with_intervals(causes, cause_intervals(after)), times, by_unit)


def _best_tried(posed: Posed, choice: Choice) -> Fit:
    """Return the hypothesis of fewest numbers that errs as little as the best; the null where none does."""
    null = choice.selection.null
    best = min((null, *choice.selection.tried), key=lambda item: item.cross_validated_rms)
    most = min(EQUAL_FACTOR * best.cross_validated_rms, (1.0 - PAYS_SHARE) * null.cross_validated_rms)
    near = [item for item in choice.selection.tried if item.cross_validated_rms <= most and not item.rough]
    found = min(near, key=lambda item: (len(item.numbers), item.cross_validated_rms), default=null)
    return fit(posed.train, found.terms, found.values, cross_validate=False, thorough=posed.thorough)
