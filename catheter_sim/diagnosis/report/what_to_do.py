"""What a reader does after a diagnosis: what each verdict asks, where to look, what the model is good for."""

from __future__ import annotations

from collections.abc import Mapping

from catheter_sim.diagnosis.report.headline_numbers import heldout_error, reported_model
from catheter_sim.diagnosis.report.result import (
    CAUSE_FOUND,
    DATA_SUSPECT,
    IMPROVED,
    NO_DISCREPANCY,
    UNEXPLAINED,
    Diagnosis,
)
from catheter_sim.diagnosis.report.wording import words
from catheter_sim.diagnosis.thresholds import LEAST_SHOWN_PROBABILITY
from catheter_sim.effects import EFFECTS

ASKS: Mapping[str, str] = {
    CAUSE_FOUND: "Check the named cause on the robot. Repair it and measure again, or go on with robot.toml.",
    IMPROVED: "Use robot.toml to predict motions like these. Do not repair the robot by it: no cause is "
    "established.",
    NO_DISCREPANCY: "Use the model as it is. To find smaller faults, measure with less noise or over a "
    "larger range.",
    UNEXPLAINED: "Check the robot's file against the robot: lengths, tendons, gravity. Then measure what the "
    "report proposes.",
    DATA_SUSPECT: "Correct the data where the report says, or measure again. Then diagnose again.",
}
_MOST_CHECKS = 4


def asks_of(diagnosis: Diagnosis) -> str:
    """Return what the verdict asks of a reader."""
    if diagnosis.has_too_little:
        return "Record what is missing. Then diagnose again."
    return ASKS[diagnosis.verdict]


def bench_rows(diagnosis: Diagnosis) -> list[dict[str, str]]:
    """Return what to look at on the robot itself: named causes first, then the most probable others."""
    if diagnosis.verdict in (NO_DISCREPANCY, DATA_SUSPECT):
        return []
    likely = sorted(diagnosis.probabilities, key=lambda name: -diagnosis.probabilities[name])
    names = [name for cause in diagnosis.causes for name in cause.one_of]
    alike = {name for group in diagnosis.indistinguishable for name in group}
    others = {cause.name for cause in diagnosis.corrections} if names else set(likely)
    names += [name for name in likely if name in alike]
    names += [name for group in diagnosis.indistinguishable for name in group]
    names += [
        name for name in likely if name in others and diagnosis.probabilities[name] >= LEAST_SHOWN_PROBABILITY
    ]
    if not diagnosis.causes:
        names += [cause.name for cause in (*diagnosis.corrections, *diagnosis.absorbs)]
    known = [name for name in dict.fromkeys(names) if name in EFFECTS and EFFECTS[name].bench]
    return [{"name": words(name), "words": EFFECTS[name].bench} for name in known[:_MOST_CHECKS]]


def use_words(diagnosis: Diagnosis) -> str:
    """Return how far the model can be trusted now, in a sentence or two."""
    if diagnosis.has_too_little:
        return (
            "Record what is missing, and diagnose again. These data cannot say what is wrong with the robot."
        )
    error, model = heldout_error(diagnosis), reported_model(diagnosis)
    if diagnosis.verdict == DATA_SUSPECT:
        return "Until the data are right, no number on this page says anything about the robot."
    right = f"On held-out data the {error.what} of the {model} is {error.said(error.best_known)}."
    if diagnosis.verdict == CAUSE_FOUND:
        return f"{right} This holds while the robot stays as it was measured."
    if diagnosis.verdict == IMPROVED:
        return f"{right} Its corrections are fitted numbers, not measured properties of the robot."
    if diagnosis.verdict == UNEXPLAINED:
        return (
            f"{right} Expect as much from it. What is missing may be a cause outside the list, or a wrong "
            "number in the robot's file."
        )
    return right
