"""The rules of the verdict: when a cause is found, and what speaks against it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from catheter_sim.diagnosis.causes.plausible import implausible
from catheter_sim.diagnosis.fitting.evidence import gain_percent, residual_series
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.noise import is_white, times_noise
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.report.result import (
    CAUSE_FOUND,
    NO_DISCREPANCY,
    UNEXPLAINED,
    StructureTest,
    UnitResult,
)
from catheter_sim.diagnosis.residuals.structure import TESTS
from catheter_sim.diagnosis.thresholds import (
    GAIN_CHANCE,
    LARGE_GAIN_PERCENT,
    LEAST_TAKEN_SHARE,
    MUCH_LEFT_NOISE,
    NEAR_NOISE,
    REMAINDER_HANGS_PERCENT,
    REMAINDER_NOISE,
    REMAINDER_SHARE,
    ROUGH_NOISE,
)


def verdict_of(
    problem: Problem,
    before: Fit,
    after: Fit,
    by_unit: Mapping[str, UnitResult],
    unit: str,
    left: StructureTest | None,
    harmful: bool = False,
    structured: bool = False,
) -> str:
    """Return the verdict.

    A cause is found where causes were chosen on the training trials, the error on the held-out ones falls, in
    at least one unit, by more than chance and on other trials too (`gains_surely`), and the error left in
    `unit` speaks for the causes: it is near the noise, or it depends on nothing (`structured_remainder`) and
    is not most of the error (`most_error_remains`). None is found where all that were chosen are implausible
    (`causes.plausible`), or where they make something worse (`harmful`; `verdict.harm`). Otherwise there is
    no discrepancy if the calibrated model's residuals are near the noise; nearer where they hang on something
    (`structured`), whether or not neighbouring rows do: commands may come in any order.
    """
    gains = any(gains_surely(item) for item in by_unit.values())
    believed = set(after.causes) - set(implausible(after))
    much_left = most_error_remains(by_unit[unit], problem.model_share)
    if believed and left is None and not harmful and not much_left and gains:
        return CAUSE_FOUND
    times = max(times_noise(result.rmse_before, result.noise_floor) for result in by_unit.values())
    white = not structured and all(is_white(series) for series in residual_series(problem, before).values())
    return NO_DISCREPANCY if times <= (ROUGH_NOISE if white else NEAR_NOISE) else UNEXPLAINED


def gains_surely(result: UnitResult) -> bool:
    """Return whether the error surely falls, on the held-out trials (`GAIN_CHANCE`) and on others.

    The interval of a small gain must lie above zero, where it is known. A cause that imitates one outside the
    list, or a small difference between two models of the same physics, does well on some trials and ill on
    others. A large gain needs no such interval, since that of few trials is wide however much is gained in
    all of them.
    """
    comes_back = result.gain_percent >= LARGE_GAIN_PERCENT or not result.gain_percent_ci95[0] <= 0.0
    return result.gain_percent > 0.0 and result.chance <= GAIN_CHANCE and comes_back


def structured_remainder(
    result: UnitResult, tests: Sequence[StructureTest], causes: int, model_share: float = 0.0
) -> StructureTest | None:
    """Return the test that shows on what the error left depends; None where on nothing, or it is small.

    A wrong cause that imitates the right one leaves what it cannot imitate: an error that depends on the
    input or the position, say. An error is small if it is near the noise, or small beside the error before.
    Several causes imitate more than one cause does; they must bring the error nearer to the noise
    (`NEAR_NOISE`). `model_share`: of the error before, what a right cause may leave of a model that is known
    to be wrong.
    """
    near = REMAINDER_NOISE if causes == 1 else NEAR_NOISE
    share = max(REMAINDER_SHARE, model_share)
    if result.rmse_after <= max(near * result.noise_floor, share * result.rmse_before):
        return None
    return strongest_structure(tests)


def strongest_structure(tests: Sequence[StructureTest]) -> StructureTest | None:
    """Return the test that shows on what much of an error hangs (`REMAINDER_HANGS_PERCENT`), if any does."""
    hanging = [test for test in tests if test.significant and test.share_percent >= REMAINDER_HANGS_PERCENT]
    return max(hanging, key=lambda test: test.share_percent, default=None)


def most_error_remains(result: UnitResult, model_share: float = 0.0) -> bool:
    """Return whether most of an error far above the noise is still there after correction.

    Then the model is mainly wrong about something else, and the causes only imitate a part of that.
    `model_share` as of `structured_remainder`.
    """
    near = result.rmse_after <= MUCH_LEFT_NOISE * result.noise_floor
    return not near and result.rmse_after > max(1.0 - LEAST_TAKEN_SHARE, model_share) * result.rmse_before


def remainder_note(after: Fit, result: UnitResult, left: StructureTest | None, in_part: bool = False) -> Note:
    """Return what to say of causes that are not named because of what they leave, or are all the same.

    Args:
        after: the corrected model.
        result: its errors in the unit that is told.
        left: on what the rest depends; None: on nothing, but there is too much of it.
        in_part: they are named, since they are surely at work whatever else is wrong.
    """
    names = ", ".join(name.replace("_", " ") for name in after.causes)
    times = times_noise(result.rmse_after, result.noise_floor)
    what = f"{100.0 - gain_percent(result.rmse_before, result.rmse_after):.0f} % of the error"
    if left is not None:
        what = f"{left.share_percent:.0f} % of it hangs on {TESTS[left.name]} ({left.coordinate})"
    if in_part:
        return Note(
            "something_else_too",
            f"{names} lowers the held-out error from {result.rmse_before:.3g} to {result.rmse_after:.3g}, as "
            "no other cause and no smooth error of unknown cause in its place would. But what is left is "
            f"{times:.1f} times the noise, and {what}: something else is at work as well, or it follows "
            "another law. The intervals are as wide as an error of that size could make them.",
        )
    return Note(
        "causes_leave_structure" if left is not None else "causes_leave_most",
        f"The best that was found, {names}, lowers the held-out error from {result.rmse_before:.3g} to "
        f"{result.rmse_after:.3g}, but what is left is {times:.1f} times the noise, and {what}: that is "
        "not the whole cause, or not the cause, so that none is named.",
    )
