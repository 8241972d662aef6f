"""What speaks against naming a cause: no gain of its own, or numbers that may be nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.intervals import Interval
from catheter_sim.diagnosis.report.result import Cause, UnitResult
from catheter_sim.diagnosis.thresholds import LARGE_GAIN_PERCENT, LEAST_GAIN_PERCENT, NO_GAIN_PERCENT


def not_significant(result: Fit, ends: Mapping[tuple[str, str], Interval]) -> tuple[str, ...]:
    """Return the causes all of whose numbers may do nothing. A number surely does something if the value that
    does nothing lies outside its 95 % interval.

    Args:
        result: a fit.
        ends: the intervals of its numbers, as they are printed (`intervals.cause_intervals`).
    """
    sure = {
        fitted.effect
        for fitted in result.numbers
        if not ends[fitted.key][0] <= fitted.parameter.null <= ends[fitted.key][1]
    }
    return tuple(name for name in result.causes if name not in sure)


def needed(by_unit: Mapping[str, UnitResult], without: Mapping[str, UnitResult]) -> bool:
    """Return whether leaving a cause out costs a large gain in some unit (`LARGE_GAIN_PERCENT`).

    Such a cause does something, whatever its intervals: where numbers trade against one another up to their
    bounds, the curvature at the fit says too little.
    """
    return any(
        by_unit[unit].gain_percent - item.gain_percent >= LARGE_GAIN_PERCENT for unit, item in without.items()
    )


def weakest_cause(causes: Sequence[Cause], names: Sequence[str]) -> tuple[str, ...]:
    """Return the one of `names` that has the least share of the held-out error; () where there is none."""
    chosen = sorted((cause.gain_percent, cause.name) for cause in causes if cause.name in names)
    return tuple(name for _, name in chosen[:1])


def without_support(causes: Sequence[Cause], suspects: Sequence[str] | None = None) -> tuple[str, ...]:
    """Return the causes, of several, without which the held-out error would be as small.

    Never all of them: of two causes that do the same, each has no share of the gain while the other is there,
    and one is needed.

    Args:
        causes: with their shares.
        suspects: those that had none before others were left out, None where none was: then the shares of
            the rest move about, and of them only what has none at all goes too.
    """
    weak = tuple(
        cause.name
        for cause in causes
        if cause.gain_percent
        < (LEAST_GAIN_PERCENT if suspects is None or cause.name in suspects else NO_GAIN_PERCENT)
    )
    return weak if len(weak) < len(causes) else ()
