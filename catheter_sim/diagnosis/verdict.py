"""The verdict, and what speaks against naming a cause."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from catheter_sim.diagnosis.evidence import residual_series
from catheter_sim.diagnosis.fit import Fit
from catheter_sim.diagnosis.hypothesis import Problem
from catheter_sim.diagnosis.intervals import Interval
from catheter_sim.diagnosis.noise import is_white
from catheter_sim.diagnosis.result import Cause, StructureTest, UnitResult
from catheter_sim.diagnosis.structure import TESTS

NEAR_NOISE = 1.5  # times the noise floor: an error so small is no discrepancy
ROUGH_NOISE = 3.0  # the same where the error shows no structure from row to row
LEFT_OVER = 2.0  # times the noise floor: an error after correction by one cause that must have no structure
LEFT_SHARE = (
    0.07  # of the error before: less than that left over, and the causes are right but for their form
)
HANGS_PERCENT = 25.0  # of what is left over, hanging on one thing: the causes are not what they seem
MUCH_LEFT = 5.0  # times the noise floor: so much of an error left says that something else is wrong besides
LEAST_SHARE = 0.5  # of the error before, that causes which leave so much must take
SURE = 0.05  # probability of the held-out gain by chance, at most
LARGE_GAIN_PERCENT = 15.0  # of the error before: so much is no accident of a few trials
LEAST_GAIN_PERCENT = 0.5  # of the error before, on held-out data, below which a cause is not named
# The same once others were left out for it: then small shares move about, and only what has none goes too.
NO_GAIN_PERCENT = 0.1


def verdict_of(
    problem: Problem,
    before: Fit,
    after: Fit,
    by_unit: Mapping[str, UnitResult],
    unit: str,
    left: StructureTest | None,
) -> str:
    """Return the verdict.

    A cause is found where causes were chosen on the training trials, the error on the held-out ones falls,
    in at least one unit, by more than chance and on other trials too (`gains_surely`), and what is left of it
    in `unit` is not well above the noise where it hangs on something (`left_over`) or is most of the error
    (`mostly_left`). Otherwise there is no discrepancy if the calibrated model's residuals are near the noise.
    """
    gains = any(gains_surely(item) for item in by_unit.values())
    if after.terms and left is None and not mostly_left(by_unit[unit]) and gains:
        return "cause_found"
    times = max(result.rmse_before / max(result.noise_floor, 1e-12) for result in by_unit.values())
    white = all(is_white(series) for series in residual_series(problem, before).values())
    return "no_discrepancy" if times <= (ROUGH_NOISE if white else NEAR_NOISE) else "unexplained"


def gains_surely(result: UnitResult) -> bool:
    """Return whether the error falls, by more than chance on the held-out trials (`SURE`) and on others.

    The interval of a gain that is not large must lie above zero, where it is known: what imitates a cause
    that is not in the list, or a small difference between two models of the same physics, does well on some
    trials and ill on others. (Of few trials the interval is wide, however much is gained in all of them.)
    """
    comes_back = result.gain_percent >= LARGE_GAIN_PERCENT or not result.gain_percent_ci95[0] <= 0.0
    return result.gain_percent > 0.0 and result.chance <= SURE and comes_back


def could_be_nothing(result: Fit, ends: Mapping[tuple[str, str], Interval]) -> tuple[str, ...]:
    """Return the causes of which no number differs surely from the one that does nothing.

    Surely: that one lies outside the number's 95 % interval.

    Args:
        result: a fit.
        ends: the intervals of its numbers, as they are printed (`intervals.cause_intervals`).
    """
    sure = {
        free.effect
        for free in result.frees
        if not ends[free.key][0] <= free.parameter.null <= ends[free.key][1]
    }
    return tuple(name for name in result.causes if name not in sure)


def needed(by_unit: Mapping[str, UnitResult], without: Mapping[str, UnitResult]) -> bool:
    """Return whether leaving a cause out costs, in some unit, as much as no accident does.

    Such a cause is not nothing, whatever its interval: where numbers trade against one another as far as
    their bounds, the curvature says too little.
    """
    return any(
        by_unit[unit].gain_percent - item.gain_percent >= LARGE_GAIN_PERCENT for unit, item in without.items()
    )


def least_of(causes: Sequence[Cause], names: Sequence[str]) -> tuple[str, ...]:
    """Return the one of `names` that has the least share of the held-out error; () where there is none."""
    chosen = sorted((cause.gain_percent, cause.name) for cause in causes if cause.name in names)
    return tuple(name for _, name in chosen[:1])


def left_over(result: UnitResult, tests: Sequence[StructureTest], causes: int) -> StructureTest | None:
    """Return on what the error after correction by so many causes hangs; None where on nothing, or small.

    Causes that are imitated by others leave what the imitation cannot do: a dependence on the input or the
    position, say. Small is an error near the noise, or beside the error before. Several causes together
    imitate more than one does, and must bring it nearer to the noise (`NEAR_NOISE`).
    """
    near = LEFT_OVER if causes == 1 else NEAR_NOISE
    if result.rmse_after <= max(near * result.noise_floor, LEFT_SHARE * result.rmse_before):
        return None
    hanging = [test for test in tests if test.significant and test.share_percent >= HANGS_PERCENT]
    return max(hanging, key=lambda test: test.share_percent, default=None)


def mostly_left(result: UnitResult) -> bool:
    """Return whether most of an error far above the noise is still there after correction.

    Then the simulation is wrong by something else in the first place, and what imitates a part of that would
    be named for it.
    """
    near = result.rmse_after <= MUCH_LEFT * result.noise_floor
    return not near and result.rmse_after > (1.0 - LEAST_SHARE) * result.rmse_before


def left_over_note(after: Fit, result: UnitResult, left: StructureTest | None) -> str:
    """Return what to say of causes that are not named because of what they leave.

    Args:
        after: the corrected model.
        result: its errors in the unit that is told.
        left: what the rest hangs on, None where on nothing but there is too much of it.
    """
    names = ", ".join(name.replace("_", " ") for name in after.causes)
    times = result.rmse_after / result.noise_floor
    what = f"{100.0 * result.rmse_after / result.rmse_before:.0f} % of the error"
    if left is not None:
        what = f"{left.share_percent:.0f} % of it hangs on {TESTS[left.name]} ({left.coordinate})"
    return (
        f"The best that was found, {names}, lowers the held-out error from {result.rmse_before:.3g} to "
        f"{result.rmse_after:.3g}, but what is left is {times:.1f} times the noise, and {what}: that is "
        "not the whole cause, or not the cause, so that none is named."
    )


def unsupported(causes: Sequence[Cause], suspects: Sequence[str] | None = None) -> tuple[str, ...]:
    """Return the causes, beside others, without which the held-out error would be as small.

    Not all at a time may be spared: two that do the same each have no share while the other is there.

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
