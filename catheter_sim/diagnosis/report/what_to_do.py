"""What a reader does after a diagnosis: look at the robot, and go on with the model or not."""

from __future__ import annotations

from catheter_sim.diagnosis.report.result import CAUSE_FOUND, DATA_SUSPECT, NO_DISCREPANCY, Diagnosis
from catheter_sim.diagnosis.report.rows import errors_and_noise, shown_unit
from catheter_sim.diagnosis.report.wording import words
from catheter_sim.diagnosis.thresholds import LEAST_SHOWN_PROBABILITY
from catheter_sim.effects import EFFECTS

_MOST_CHECKS = 4


def bench_rows(diagnosis: Diagnosis) -> list[dict[str, str]]:
    """Return what to look at on the robot itself, by causes: those named, then what may stand in their place.

    Where none is named though the model is off: the most probable ones, and those that are not believed.
    """
    names = [cause.name for cause in diagnosis.causes]
    names += [name for group in diagnosis.indistinguishable for name in group]
    if not names and diagnosis.verdict not in (NO_DISCREPANCY, DATA_SUSPECT):
        likely = sorted(diagnosis.probabilities.items(), key=lambda item: -item[1])
        names = [name for name, value in likely if value >= LEAST_SHOWN_PROBABILITY]
        names += [cause.name for cause in diagnosis.absorbs]
    known = [name for name in dict.fromkeys(names) if name in EFFECTS and EFFECTS[name].bench]
    return [{"name": words(name), "words": EFFECTS[name].bench} for name in known[:_MOST_CHECKS]]


def use_words(diagnosis: Diagnosis) -> str:
    """Return what the model may be used for now, in a sentence or two."""
    before, after, _ = (
        f"{text} {shown_unit(diagnosis.told.unit)}".strip() for text in errors_and_noise(diagnosis.told)
    )
    if diagnosis.verdict == CAUSE_FOUND:
        return (
            f"Use the corrected robot, right to {after} on data that it had not seen, as long as the robot "
            "stays as it was measured; once it is mended, measure and diagnose again."
        )
    if diagnosis.verdict == NO_DISCREPANCY:
        return f"Use the calibrated robot: it is right to {before} on data that it had not seen."
    if diagnosis.has_too_little:
        return (
            "Record what is missing, and diagnose again. These data cannot say what is wrong with the robot."
        )
    if diagnosis.verdict == DATA_SUSPECT:
        return (
            "First mend what looks wrong in the data, or measure anew, and diagnose again: until then no "
            "number of this page says anything of the robot."
        )
    return (
        f"Trust the calibrated robot no closer than {before} until what is missing is found: a cause beyond "
        "the list, or a wrong number in the robot's file (a length, a tendon's end, gravity's direction)."
    )
