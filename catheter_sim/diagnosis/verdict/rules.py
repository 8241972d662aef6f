"""The rules of the verdict: when a cause is found, and what speaks against it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from catheter_sim.diagnosis.fitting.evidence import gain_percent, residual_series
from catheter_sim.diagnosis.fitting.fit import Fit
from catheter_sim.diagnosis.fitting.noise import is_white, times_noise
from catheter_sim.diagnosis.fitting.problem import Problem
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.report.result import (
    CAUSE_FOUND,
    IMPROVED,
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
    established: bool,
    harmful: bool = False,
    structured: bool = False,
) -> str:
    """Return the verdict.

    The corrections of a hypothesis that was chosen on the training trials hold where the error on the
    held-out ones falls, in at least one unit, by more than chance and on other trials too (`gains_surely`),
    and nothing gets worse. Then a cause is found if one of them is established; if none is, there is no
    discrepancy where the calibrated model's residuals are near the noise, else the model is improved. Without
    corrections that hold there is no discrepancy, or it is unexplained.

    Args:
        problem: the training trials.
        before: the calibrated model.
        after: the hypothesis, its numbers plausible.
        by_unit: its held-out figures.
        established: one of its causes is at least as probable as `ESTABLISHED`.
        harmful: it makes something worse (`verdict.harm`).
        structured: the calibrated model's residuals depend on something, whether or not neighbouring rows do:
            commands may come in any order.
    """
    holds = bool(after.terms) and not harmful and any(gains_surely(item) for item in by_unit.values())
    if holds and established:
        return CAUSE_FOUND
    times = max(times_noise(result.rmse_before, result.noise_floor) for result in by_unit.values())
    white = not structured and all(is_white(series) for series in residual_series(problem, before).values())
    if times <= (ROUGH_NOISE if white else NEAR_NOISE):
        return NO_DISCREPANCY
    return IMPROVED if holds else UNEXPLAINED


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


def remainder_note(after: Fit, result: UnitResult, left: StructureTest | None) -> Note:
    """Return what to say where the error that is left says that something else is wrong as well.

    Args:
        after: the hypothesis.
        result: its errors in the unit that is reported.
        left: on what the rest depends; None: on nothing, but there is too much of it.
    """
    names = ", ".join(name.replace("_", " ") for name in after.causes)
    times = times_noise(result.rmse_after, result.noise_floor)
    what = f"it is {100.0 - gain_percent(result.rmse_before, result.rmse_after):.0f} % of the error before"
    if left is not None:
        what = f"{left.share_percent:.0f} % of it depends on {TESTS[left.name]} ({left.coordinate})"
    verb = "lower" if result.rmse_after < result.rmse_before else "raise"
    many = "" if len(after.causes) > 1 else "s"
    course = f"the held-out error from {result.rmse_before:.3g} to {result.rmse_after:.3g} {result.unit}"
    return Note(
        "something_else_too",
        f"{names} {verb}{many} {course}. The error left is {times:.1f} times the row-to-row noise, and "
        f"{what}. Something else is wrong too, or a cause acts in a form that is not listed. The intervals "
        "allow for an error of that size.",
    )


def unproved_note(names: Sequence[str]) -> Note:
    """Return what to say of probable causes whose gain the held-out trials do not show."""
    told = " and ".join(name.replace("_", " ") for name in names)
    return Note(
        "cause_unproved",
        f"{told.capitalize()} explains the training trials, but the held-out trials gain nothing by it for "
        "sure. Hold out trials that move the robot as the training trials do.",
    )
